"""What `main.py points` does: a scan's points in another format."""

from __future__ import annotations

from pathlib import Path

from analysis.cloud import read_ply, write_csv, write_ply
from analysis.cloud_formats import write_points
from studio.runtime.streams import print_json
from studio.scan.height_map import points_of
from studio.scan.own_files import check_replaceable


def convert_points(folder: Path, *, out: Path, quiet: bool, as_json: bool) -> None:
    """InputError: the folder has no points, the suffix is none that is written, or a file of others is in the way."""
    source = points_of(folder)
    check_replaceable([out], [source])
    points = read_ply(source)
    {".ply": write_ply, ".csv": write_csv}.get(out.suffix.lower(), write_points)(out, points)
    if as_json:
        print_json({"ok": True, "file": str(out), "points": len(points["x"])})
    else:
        print(f"{out}: {len(points['x'])} points")
