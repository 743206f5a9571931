"""What `main.py points` does: a scan's points in another format."""

from __future__ import annotations

from pathlib import Path

from studio.runtime.streams import print_json
from studio.scan.height_map import points_of
from studio.scan.own_files import check_replaceable
from studio.scan.whole_scan import convert_points as convert


def convert_points(folder: Path, *, out: Path, quiet: bool, as_json: bool) -> None:
    """InputError: the folder has no points, the suffix is none that is written, or a file of others is in the way."""
    source = points_of(folder)
    check_replaceable([out], [source])
    count = convert(source, out)
    if as_json:
        print_json({"ok": True, "file": str(out), "points": count})
    else:
        print(f"{out}: {count} points")
