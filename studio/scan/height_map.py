"""The height map of a scan: a 16-bit picture of its points on a uniform grid, and what its numbers mean. Qt-free."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from analysis.cloud import Cloud, merge, ply_pieces
from analysis.deviation import far_off
from analysis.height_map import HeightMap, encoded, height_map, within
from analysis.report.units import counted, digits
from render.base.arrays import Bool
from render.base.errors import InputError
from render.base.files import atomic_write
from render.base.finite import known
from render.output.tone_mapping import Picture, mapped
from studio.preview.diverging_colours import NONE
from studio.scan.colour_scale import ColourScale
from studio.scan.own_files import check_replaceable
from studio.scan.scan_results import ScanResults

FORMAT, VERSION = "blazer-heightmap", 1
ENDS = (1.0, 99.0)
"""Percentiles of heights, where no errors are known."""
GAP, GAP_IN_HEIGHT, LARGE = 8.0, 2.0, 95.0
"""What parts stray points from a surface: usual distances of neighbours, their large steps in height, a percentile."""
SUFFIXES = (".png", ".tif", ".tiff")
NEEDED = ("x", "y", "z", "sigma_random", "correlation_length", "row", "laser", "step")
SHADES = 1024
"""Of the picture on the screen."""
MEANING = (
    "z = offset + scale * number, x = x_first + pitch * column, y = y_first - pitch * row; world frame at step 0, m"
)


@dataclass(frozen=True)
class Written:
    """What was made."""

    paths: list[Path]
    record: dict[str, Any]
    """As the file beside the picture has it."""


def points_of(source: Path) -> Path:
    """The points of a results folder, or the PLY itself. InputError: it has none."""
    file = source / "points.ply" if source.is_dir() else source
    if source.is_dir() and not file.exists():
        cure = "measure it: main.py reconstruct, or run without --no-measure"
        raise InputError(
            "the folder has no points", where=str(source), allowed="a scan's folder with points.ply", cure=cure
        )
    return file


def write_height_map(points: Path, path: Path, pitch: float | None = None, *, all_heights: bool = False) -> Written:
    """.png or .tif, by the suffix, and .json beside it; pitch: m, None as of `height_map`.

    all_heights: also those beyond `file_range`, which make the levels coarser. InputError: as `height_map` and
    `read_ply`, and as of `write_made`.
    """
    _check_suffix(path)
    read = read_points(points)
    return write_made(height_map(read, pitch), path, points, None if all_heights else file_range(read))


def file_range(points: Cloud) -> tuple[float, float] | None:
    """m, from the lowest to the highest of the points that are of the surface, where their errors are known: of those
    that are not far off it, and of what goes on from them without a gap, as a groove's bottom does.

    Else from percentile to percentile, and as much again on either side. None: nothing is to be left out.
    """
    heights, errors = points["z"], points.get("error_depth")
    if errors is not None and np.isfinite(errors).any():
        kept = heights[_of_surface(points, ~far_off(errors) & np.isfinite(heights))]
        return (float(kept.min()), float(kept.max())) if len(kept) else None
    heights = heights[np.isfinite(heights)]
    low, high = np.percentile(heights, ENDS).tolist() if len(heights) else (0.0, 0.0)
    return (2.0 * low - high, 2.0 * high - low) if high > low else None


def _of_surface(points: Cloud, near: Bool) -> Bool:
    """(n,) points that are near, and those beyond them in height that join them, one at a time, without a gap.

    A gap is one of `GAP` usual distances on the map, or of `GAP_IN_HEIGHT` of the largest steps along the profile.
    """
    from scipy.spatial import cKDTree  # takes a while: not before a map is made

    found, z = near.copy(), points["z"]
    beside = near[1:] & near[:-1]
    if not beside.any():
        return found
    across = np.hypot(np.diff(points["x"]), np.diff(points["y"]))[beside]
    gaps = GAP * float(np.median(across)), GAP_IN_HEIGHT * float(np.percentile(np.abs(np.diff(z)[beside]), LARGE))
    if not min(gaps) > 0.0:
        return found
    places = np.column_stack([points["x"] / gaps[0], points["y"] / gaps[0], z / gaps[1]])
    low, high = z[near].min(), z[near].max()
    # only what is beyond them makes the range larger, and only what is at its ends is next to that
    apart = np.flatnonzero(~near & ((z < low) | (z > high)))
    joined = np.flatnonzero(near & ((z < low + gaps[1]) | (z > high - gaps[1])))
    while len(apart) and len(joined):
        distance, _ = cKDTree(places[joined]).query(places[apart], p=np.inf, distance_upper_bound=1.0)
        joined, apart = apart[np.isfinite(distance)], apart[~np.isfinite(distance)]
        found[joined] = True
    return found


def read_points(points: Path) -> Cloud:
    """Of a PLY what is needed of it here. InputError: as `read_ply`."""
    names = (*NEEDED, "error_depth")
    return merge([{name: piece[name] for name in names if name in piece} for piece in ply_pieces(points)])


def picture(made: HeightMap, scale: ColourScale, limits: tuple[float, float]) -> Picture:
    """In the colours of a scale between limits, mm; grey where there is no surface."""
    low, high = limits
    shades = scale.colours(np.linspace(low, high, SHADES), low, high).astype(np.uint32)
    table = np.uint32(0xFF000000) | shades @ np.array([1 << 16, 1 << 8, 1], np.uint32)
    # single precision of what lies above the lower limit, not of the distance from the world's origin
    above = (1e3 * made.heights - low).astype(np.float32)
    red, green, blue = NONE
    return mapped(above, 0.0, high - low, table, 0xFF000000 | red << 16 | green << 8 | blue)


def write_made(made: HeightMap, path: Path, points: Path, limits: tuple[float, float] | None = None) -> Written:
    """.png or .tif, by the suffix, and .json beside it; points: which it is of; limits: as of `within`.

    InputError: the suffix is another, no cell has a height, or a file would replace one of other origin.
    """
    _check_suffix(path)
    beside = path.with_suffix(".json")
    check_replaceable([path, beside], [points])
    return _written(made, path, beside, points, limits)


def _check_suffix(path: Path) -> None:
    """InputError: it is of no picture that holds 16 bits."""
    if path.suffix.lower() not in SUFFIXES:
        raise InputError(
            "height maps are 16-bit pictures", where=str(path), allowed=f"a name ending in {', '.join(SUFFIXES)}"
        )


def _written(
    whole: HeightMap, path: Path, beside: Path, source: Path, limits: tuple[float, float] | None = None
) -> Written:
    import cv2

    made = within(whole, limits)
    numbers, scale, offset = encoded(made.heights)
    done, data = cv2.imencode(path.suffix.lower(), numbers)
    if not done:
        raise InputError("the height map cannot be encoded", where=str(path))
    rows, columns = numbers.shape
    record = {
        "format": FORMAT,
        "format_version": VERSION,
        "picture": path.name,
        "source": source.name,
        "width": columns,
        "height": rows,
        "meaning": MEANING,
        "invalid": 0,
        "scale": scale,
        "offset": offset,
        "pitch": made.pitch,
        "x_first": made.x,
        "y_first": made.y,
        "valid": int(np.count_nonzero(numbers)),
        "left_out": left_out_record(whole, made),
        "steep": steep_record(made),
        "points": made.points,
        "sigma": sigma_record(made, scale),
    }
    with atomic_write(path) as temporary:
        temporary.write_bytes(data.tobytes())
    with atomic_write(beside) as temporary:
        temporary.write_text(json.dumps(record, indent=2, allow_nan=False) + "\n", encoding="utf-8")
    return Written([path, beside], record)


def left_out_record(whole: HeightMap, kept: HeightMap) -> dict[str, Any]:
    """How many cells with a height the kept map lacks, in the picture and beside it, the points within them, and from
    where to where heights are without and with them; m."""
    inside, there = (one.heights[np.isfinite(one.heights)] for one in (kept, whole))
    return {
        "cells": len(there) - len(inside),
        "cells_in_picture": kept.left_out,
        "points": kept.points_left_out,
        "kept_from": float(inside.min()),
        "kept_to": float(inside.max()),
        "all_from": float(there.min()),
        "all_to": float(there.max()),
    }


def left_out_sentence(left_out: dict[str, Any]) -> str:
    """What `left_out_record` says, for a person; empty where all heights are in the picture."""
    if not left_out["cells"]:
        return ""
    kept, all_of = ([f"{1e3 * left_out[f'{name}_{end}']:.4g}" for end in ("from", "to")] for name in ("kept", "all"))
    cells = "1 cell is" if left_out["cells"] == 1 else f"{left_out['cells']} cells are"
    return (
        f"{cells} left out, beyond {' to '.join(kept)} mm, as of stray points: with them heights go from "
        f"{' to '.join(all_of)} mm."
    )


def steep_record(made: HeightMap) -> dict[str, Any]:
    """Cells that walls, jumps and contradictory points leave without a height, those that were not measured, and points
    without a height."""
    return {
        "cells": made.steep,
        "points": made.points_steep,
        "cells_not_measured": made.unmeasured,
        "points_without_height": made.points_without - made.points_left_out,
    }


def steep_sentence(steep: dict[str, Any]) -> str:
    """What `steep` of a record says, for a person; empty where every cell has a height."""
    told, cells, others = [], steep["cells"], steep["cells_not_measured"]
    if cells:
        lie = "lies" if steep["points"] == 1 else "lie"
        told.append(
            f"{counted(cells, 'cell')} {'has' if cells == 1 else 'have'} no height, at walls and jumps, where none is "
            f"the height of a place: {counted(steep['points'], 'point')} {lie} in {'it' if cells == 1 else 'them'}."
        )
    if others:
        were = "was" if others == 1 else "were"
        cells = counted(others, "other cell" if told else "cell")
        told.append(f"{cells} {were} not measured, over holes or outside of the scanned area.")
    if apart := steep["points_without_height"] - steep["points"]:
        told.append(f"{counted(apart, 'point')} there and beside walls {'has' if apart == 1 else 'have'} none.")
    return " ".join(told)


def shown_range(made: HeightMap) -> tuple[float, float] | None:
    """m, from the lowest to the highest cell; None: there are no two heights."""
    heights = made.heights[np.isfinite(made.heights)]
    low, high = (float(heights.min()), float(heights.max())) if len(heights) else (0.0, 0.0)
    return (low, high) if high > low else None


def left_out_of(beside: Path) -> str:
    """As of `left_out_sentence`, of the file beside a picture that was just written."""
    return left_out_sentence(json.loads(beside.read_text(encoding="utf-8"))["left_out"])


def sigma_record(made: HeightMap, scale: float) -> dict[str, Any]:
    """What resampling and 16 bits, a level being `scale` m, make of the random sigma; m and ratios."""
    return {
        "points": known(made.sigma_points),
        "cells": known(made.sigma_cells),
        "cells_over_points": known(made.sigma_cells / made.sigma_points if made.sigma_points > 0.0 else math.nan),
        "correlation_of_neighbours": known(made.correlation),
        "quantisation": scale / math.sqrt(12.0),
    }


def export_height_map(scan: ScanResults | None, path: Path, _: object = None) -> list[Path]:
    """Of the whole scan that a frame is a step of. InputError: it is of none, or as `write_height_map`."""
    if scan is None:
        raise InputError("a single frame has no height map", cure="run the scan, or open the results of one")
    return write_height_map(points_of(scan.found.folder), path).paths


def sigma_sentence(sigma: dict[str, Any]) -> str:
    """What resampling did to the random sigma, as of `sigma_record`, for a person."""
    if sigma["cells"] is None:
        return "The points have no sigma, so that nobody knows that of the cells."
    together = (
        ""
        if sigma["correlation_of_neighbours"] is None
        else (f"; neighbours err alike ({sigma['correlation_of_neighbours']:.2f})")
    )
    return (
        f"A cell's random sigma is {sigma['cells_over_points']:.2f} of a point's "
        f"({digits(1e6 * sigma['cells'])} of {digits(1e6 * sigma['points'])} um){together}; "
        f"16 bits add {digits(1e6 * sigma['quantisation'], 2)} um."
    )
