"""Points in the formats of other programs: PCD, XYZ, LAS and E57. Whole columns, in metres."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from pathlib import Path

import numpy as np

from analysis.cloud import INTEGERS, UNITS, Cloud
from render.base.arrays import Float
from render.base.errors import InputError
from render.base.files import atomic_write

LAS_SCALE = 1e-9
"""m a step of LAS's whole numbers at least: they reach 2 m, and longer parts have wider steps."""
MOST_LAS = 2**31 - 1
MADE_BY = "Blazer Studio"
DROPPED = ("x", "y", "z")
Writer = Callable[[Path, Cloud], None]


def write_points(path: Path, points: Cloud) -> None:
    """.pcd, .xyz, .las or .e57, by the suffix; what a format has no room for is left out.

    PCD and LAS have all columns, XYZ coordinates alone, E57 coordinates and the error in depth as its intensity.
    InputError: the suffix is another, there are no points, a library of the extra "points" is missing, or the file
    cannot be written.
    """
    writer = WRITERS.get(path.suffix.lower())
    if writer is None:
        raise InputError("points are not written so", where=str(path), found=path.suffix, allowed=", ".join(WRITERS))
    if len(points["x"]) == 0:
        raise InputError("there are no points to write", where=str(path))
    with atomic_write(path) as temporary:
        writer(temporary, points)


def _xyz(path: Path, points: Cloud) -> None:
    """A line a point, all digits."""
    np.savetxt(path, _places(points), fmt="%.17g")


def _pcd(path: Path, points: Cloud) -> None:
    """Version 0.7, binary (pointclouds.org, "The PCD file format"): doubles, and ints of four bytes."""
    names = list(points)
    kinds = ["<i4" if name in INTEGERS else "<f8" for name in names]
    table = np.empty(len(points["x"]), dtype=list(zip(names, kinds, strict=True)))
    for name in names:
        table[name] = points[name]
    count = len(table)
    header = [
        "# .PCD v0.7 - Point Cloud Data file format",
        f"# {MADE_BY}",
        "VERSION 0.7",
        f"FIELDS {' '.join(names)}",
        f"SIZE {' '.join(kind[-1] for kind in kinds)}",
        f"TYPE {' '.join('I' if kind == '<i4' else 'F' for kind in kinds)}",
        f"COUNT {' '.join('1' for _ in names)}",
        f"WIDTH {count}",
        "HEIGHT 1",
        "VIEWPOINT 0 0 0 1 0 0 0",
        f"POINTS {count}",
        "DATA binary",
        "",
    ]
    path.write_bytes("\n".join(header).encode("ascii") + table.tobytes())


def _las(path: Path, points: Cloud) -> None:
    """LAS 1.4 by laspy: coordinates as whole numbers of a step, the other columns as extra bytes."""
    _require("laspy", "LAS", path)
    import laspy

    places = _places(points)
    low, high = places.min(axis=0), places.max(axis=0)
    header = laspy.LasHeader(version="1.4", point_format=6)
    header.generating_software = MADE_BY
    header.offsets = low
    header.scales = np.maximum(LAS_SCALE, (high - low) / (MOST_LAS - 1))
    for name in points:
        if name not in DROPPED:
            kind = np.int32 if name in INTEGERS else np.float64
            header.add_extra_dim(laspy.ExtraBytesParams(name=name, type=kind, description=UNITS.get(name, "")))
    made = laspy.LasData(header)
    made.x, made.y, made.z = places.T
    for name in points:
        if name not in DROPPED:
            made[name] = points[name]
    with open(path, "wb") as file:
        made.write(file)


def _e57(path: Path, points: Cloud) -> None:
    """ASTM E2807 by libE57, in single precision about the points' middle, which is the scan's pose."""
    _require("pye57", "E57", path)
    import pye57

    file = pye57.E57(str(path), mode="w")
    places = _places(points)
    middle = 0.5 * (places.min(axis=0) + places.max(axis=0))
    x, y, z = np.ascontiguousarray((places - middle).T)
    columns = {"cartesianX": x, "cartesianY": y, "cartesianZ": z}
    if "error_depth" in points and np.isfinite(points["error_depth"]).all():
        columns["intensity"] = np.ascontiguousarray(points["error_depth"], dtype=np.float64)
    file.write_scan_raw(columns, name=MADE_BY, rotation=np.array([1.0, 0.0, 0.0, 0.0]), translation=middle)
    file.close()


def _places(points: Cloud) -> Float:
    return np.column_stack([points[name] for name in "xyz"])


def _require(module: str, kind: str, path: Path) -> None:
    if importlib.util.find_spec(module) is None:
        cure = 'install it: pip install "blazer-studio[points]"; or write PLY, PCD or XYZ'
        raise InputError(f"{module}, which writes {kind} files, is not installed", where=str(path), cure=cure)


WRITERS: dict[str, Writer] = {".pcd": _pcd, ".xyz": _xyz, ".las": _las, ".e57": _e57}
