"""The height map of a scan: a 16-bit picture of its points on a uniform grid, and what its numbers mean. Qt-free."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from analysis.cloud import Cloud, merge, ply_pieces
from analysis.height_map import HeightMap, encoded, height_map
from analysis.report.units import digits
from render.base.errors import InputError
from render.base.files import atomic_write
from render.base.finite import known
from render.output.tone_mapping import Picture, mapped
from studio.preview.diverging_colours import NONE
from studio.scan.colour_scale import ColourScale
from studio.scan.own_files import check_replaceable
from studio.scan.scan_results import ScanResults

FORMAT, VERSION = "blazer-heightmap", 1
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


def write_height_map(points: Path, path: Path, pitch: float | None = None) -> Written:
    """.png or .tif, by the suffix, and .json beside it; pitch: m, None as of `height_map`.

    InputError: as `height_map` and `read_ply`, and as of `write_made`.
    """
    _check_suffix(path)
    return write_made(read_map(points, pitch), path, points)


def read_map(points: Path, pitch: float | None = None) -> HeightMap:
    """Of the points of a PLY. InputError: as `height_map` and `read_ply`."""
    return height_map(read_points(points), pitch)


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


def write_made(made: HeightMap, path: Path, points: Path) -> Written:
    """.png or .tif, by the suffix, and .json beside it; points: which it is of.

    InputError: the suffix is another, no cell has a height, or a file would replace one of other origin.
    """
    _check_suffix(path)
    beside = path.with_suffix(".json")
    check_replaceable([path, beside], [points])
    return _written(made, path, beside, points)


def _check_suffix(path: Path) -> None:
    """InputError: it is of no picture that holds 16 bits."""
    if path.suffix.lower() not in SUFFIXES:
        raise InputError(
            "height maps are 16-bit pictures", where=str(path), allowed=f"a name ending in {', '.join(SUFFIXES)}"
        )


def _written(made: HeightMap, path: Path, beside: Path, source: Path) -> Written:
    import cv2

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
        "points": made.points,
        "sigma": sigma_record(made, scale),
    }
    with atomic_write(path) as temporary:
        temporary.write_bytes(data.tobytes())
    with atomic_write(beside) as temporary:
        temporary.write_text(json.dumps(record, indent=2, allow_nan=False) + "\n", encoding="utf-8")
    return Written([path, beside], record)


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
