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
from render.base.errors import InputError
from render.base.files import atomic_write
from render.base.finite import known
from studio.scan.own_files import check_replaceable
from studio.scan.scan_results import ScanResults

FORMAT, VERSION = "blazer-heightmap", 1
SUFFIXES = (".png", ".tif", ".tiff")
NEEDED = ("x", "y", "z", "sigma_random", "correlation_length", "row", "laser", "step")

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

    InputError: as `height_map` and `read_ply`, the suffix is another, or a file would replace one of other origin.
    """
    if path.suffix.lower() not in SUFFIXES:
        raise InputError(
            "height maps are 16-bit pictures", where=str(path), allowed=f"a name ending in {', '.join(SUFFIXES)}"
        )
    beside = path.with_suffix(".json")
    check_replaceable([path, beside], [points])
    made = height_map(_read(points), pitch)
    return _written(made, path, beside, points)


def _read(points: Path) -> Cloud:
    pieces = [{name: piece[name] for name in NEEDED if name in piece} for piece in ply_pieces(points)]
    return merge(pieces)


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
        "sigma": {
            "points": known(made.sigma_points),
            "cells": known(made.sigma_cells),
            "cells_over_points": known(made.sigma_cells / made.sigma_points if made.sigma_points > 0.0 else math.nan),
            "correlation_of_neighbours": known(made.correlation),
            "quantisation": scale / math.sqrt(12.0),
        },
    }
    with atomic_write(path) as temporary:
        temporary.write_bytes(data.tobytes())
    with atomic_write(beside) as temporary:
        temporary.write_text(json.dumps(record, indent=2, allow_nan=False) + "\n", encoding="utf-8")
    return Written([path, beside], record)


def export_height_map(scan: ScanResults | None, path: Path, _: object = None) -> list[Path]:
    """Of the whole scan that a frame is a step of. InputError: it is of none, or as `write_height_map`."""
    if scan is None:
        raise InputError("a single frame has no height map", cure="run the scan, or open the results of one")
    return write_height_map(points_of(scan.found.folder), path).paths


def sigma_sentence(record: dict[str, Any]) -> str:
    """What resampling did to the random sigma, for a person."""
    sigma = record["sigma"]
    if sigma["cells"] is None:
        return "The points have no sigma, so that nobody knows that of the cells."
    together = (
        ""
        if sigma["correlation_of_neighbours"] is None
        else (f"; neighbours err alike ({sigma['correlation_of_neighbours']:.2f})")
    )
    return (
        f"A cell's random sigma is {sigma['cells_over_points']:.2f} of a point's "
        f"({1e6 * sigma['cells']:.3g} of {1e6 * sigma['points']:.3g} um){together}; "
        f"16 bits add {1e6 * sigma['quantisation']:.2g} um."
    )
