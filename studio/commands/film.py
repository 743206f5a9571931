"""What `main.py film` does: a scan as an MP4."""

from __future__ import annotations

from pathlib import Path

from studio.runtime.console import stage_progress
from studio.runtime.streams import print_json
from studio.scan.film import write_film


def make_film(folder: Path, *, rate: float, out: Path | None, quiet: bool, as_json: bool) -> None:
    """rate: steps a second. InputError: as `write_film`."""
    path = folder / "scan.mp4" if out is None else out
    with stage_progress(quiet or as_json) as progress:
        count = write_film(folder, path, rate, lambda done: progress("film", done))
    if as_json:
        print_json({"ok": True, "file": str(path), "frames": count, "rate": rate})
    else:
        print(f"{path}: {count} steps, {count / rate:.1f} s")
