"""What `main.py heightmap` does: the height map of a scan's points."""

from __future__ import annotations

from pathlib import Path

from studio.runtime.streams import print_json
from studio.scan.height_map import left_out_sentence, points_of, sigma_sentence, steep_sentence, write_height_map


def make_height_map(
    source: Path, *, pitch: float | None, all_heights: bool, out: Path | None, quiet: bool, as_json: bool
) -> None:
    """pitch: mm. InputError: as `write_height_map`."""
    points = points_of(source)
    path = points.with_name("heightmap.png") if out is None else out
    made = write_height_map(points, path, None if pitch is None else 1e-3 * pitch, all_heights=all_heights)
    if as_json:
        print_json({"ok": True, "files": [str(file) for file in made.paths], **made.record})
        return
    record = made.record
    share = record["valid"] / (record["width"] * record["height"])
    size = f"{record['width']} x {record['height']} cells of {1e3 * record['pitch']:.4g} mm"
    print(f"{path}: {size}, {share:.1%} with a height")
    if steep := steep_sentence(record["steep"]):
        print(steep)
    if left_out := left_out_sentence(record["left_out"]):
        print(f"warning: {left_out} --all-heights keeps them, at coarser levels")
    if not quiet:
        meaning = f"{record['offset']:.9g} m + {record['scale']:g} m * number"
        print(f"Height: {meaning}; 0: none; see {made.paths[1].name}")
        print(sigma_sentence(record["sigma"]))
