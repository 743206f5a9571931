"""Which files this program wrote, told by their content: only those are replaced or removed unasked."""

from __future__ import annotations

import os
import re
import stat
from collections.abc import Iterable
from pathlib import Path

from analysis.cloud import UNITS, title
from analysis.cloud_formats import MADE_BY
from render.base.errors import InputError

HEAD = 64 * 1024
"""Bytes at the beginning of a file that tell what it is."""
EXR_MAGIC = b"\x76\x2f\x31\x01"
EXR_LAYERS = re.compile(rb"laser\.[^\0]*\.direct\.Y\0|object_id\.Y\0|ambient\.B\0.{16}ambient\.G\0|sigma_time\0", re.S)
JSON_FORMAT = re.compile(rb'\{\s*"format": "blazer-(frame|scan|heightmap|deviation)"')
FILM_TITLE = b"blazer-film"
"""In the last box of a film, where players do not look."""
OF_A_POSITION = ("rank", "u", "v", "sigma_u", "width", "amplitude", "background", "chi2", "correlation_length", "flag")


def line_columns(axis: str) -> tuple[str, ...]:
    """Titles of a line's table; the first column counts the image's rows or columns."""
    return (axis.removesuffix("s"), *OF_A_POSITION)


RIDGE_COLUMNS = (
    "line",
    "u",
    "v",
    "sigma",
    "normal_u",
    "normal_v",
    "width",
    "amplitude",
    "background",
    "significance",
    "flag",
)
MEASURE_COLUMNS = (
    "name",
    "kind",
    "unit",
    "laser",
    "step",
    "value",
    "sigma_random",
    "sigma_systematic",
    "sigma",
    "points",
    "truth",
    "error",
    "error_in_sigmas",
    "nominal",
    "lower",
    "upper",
    "verdict",
    "reason",
    "remark",
    "section",
)
POINT_COLUMNS = tuple(title(name) for name in UNITS)
DEVIATION_COLUMNS = ("x_m", "y_m", "z_m", "deviation_m", "sigma_m", "verdict", "laser", "step", "row")
SECTION_COLUMNS = ("of", "line", "across_m", "up_m", "x_m", "y_m", "z_m", "off_plane_m", "sigma_m", "step", "row")
FORMER_POINT_COLUMNS = tuple(name for name in POINT_COLUMNS if not name.startswith("sigma_surface"))
FORMER_COLUMNS = (
    MEASURE_COLUMNS[:-1],
    MEASURE_COLUMNS[:-2],
    FORMER_POINT_COLUMNS,
    tuple("error_distance_m" if name == "error_surface_m" else name for name in FORMER_POINT_COLUMNS),
    ("scan_line", *OF_A_POSITION),
    ("scan_line", "rank", "u", "v", "sigma_u", "width", "amplitude", "background", "chi2", "flag"),
    (
        "x_m",
        "y_m",
        "z_m",
        "sigma_m",
        "error_depth_m",
        "error_distance_m",
        "u_px",
        "v_px",
        "row",
        "laser",
        "step",
    ),
)
"""Of versions before this one."""
TABLES = tuple(
    ",".join(columns).encode()
    for columns in (
        line_columns("rows"),
        line_columns("columns"),
        RIDGE_COLUMNS,
        POINT_COLUMNS,
        MEASURE_COLUMNS,
        DEVIATION_COLUMNS,
        SECTION_COLUMNS,
        *FORMER_COLUMNS,
    )
)


def is_own(path: Path) -> bool:
    """An earlier run of this program wrote the file, as far as its content tells; False: another kind, or unreadable.

    A PNG belongs to the frame or table beside it, a PDF to the HTML.
    """
    suffix = path.suffix.lower()
    if suffix in (".tif", ".tiff"):
        return is_own(path.with_suffix(".json"))
    if suffix == ".png":
        return any(is_own(path.with_suffix(other)) for other in (".exr", ".json", ".csv"))
    if suffix == ".pdf":
        return is_own(path.with_suffix(".html"))
    head = _head(path)
    if suffix == ".csv":
        return head.split(b"\n", 1)[0].strip() in TABLES
    if suffix == ".ply":
        return head.startswith(b"ply\nformat binary_little_endian 1.0\ncomment metre, pixel; world frame\n")
    if suffix == ".exr":
        return head.startswith(EXR_MAGIC) and EXR_LAYERS.search(head) is not None
    if suffix == ".html":
        return b'<meta name="generator" content="Blazer Studio">' in head
    if suffix in (".pcd", ".las"):
        return MADE_BY.encode() in head[:400]
    if suffix == ".e57":
        return MADE_BY.encode() in _tail(path)
    if suffix == ".mp4":
        return FILM_TITLE in _tail(path)
    if suffix == ".dxf":
        return head.startswith(b"999\nBlazer Studio\n")
    if suffix == ".json":
        return JSON_FORMAT.match(head) is not None
    return path.name.endswith(".state.npz") and path.is_file()


def check_replaceable(paths: Iterable[Path], reads: Iterable[Path] = ()) -> None:
    """InputError: writing to `paths` would replace a file that this program did not write, or one that it `reads`.

    A folder in the way is told in the same words, before anything is computed.
    """
    paths = list(paths)
    check_not_read(paths, reads)
    for path in paths:
        if os.path.lexists(path) and not is_own(path):
            raise InputError(
                "a result would replace a file that this program did not write",
                where=str(path),
                cure="choose another folder for results, or move the file away",
            )


def check_not_read(paths: Iterable[Path], reads: Iterable[Path]) -> None:
    """InputError: one of `paths` is one of the files that are read, if by another name."""
    sources = {identity: file for file in reads if (identity := _identity(file)) is not None}
    for path in paths:
        if (identity := _identity(path)) in sources:
            raise InputError(
                "a result would replace a file that is read",
                where=str(path),
                found=str(sources[identity]),
                cure="choose another folder for results",
            )


def _identity(path: Path) -> tuple[int, int] | None:
    """The same for all names of one file."""
    try:
        status = path.stat()
    except (OSError, ValueError):
        return None
    return status.st_dev, status.st_ino


def _tail(path: Path) -> bytes:
    try:
        if not stat.S_ISREG(path.stat().st_mode):
            return b""
        with open(path, "rb") as file:
            file.seek(max(0, path.stat().st_size - HEAD))
            return file.read(HEAD)
    except (OSError, ValueError):
        return b""


def _head(path: Path) -> bytes:
    try:
        if not stat.S_ISREG(path.stat().st_mode):  # a pipe would block
            return b""
        with open(path, "rb") as file:
            return file.read(HEAD)
    except (OSError, ValueError):
        return b""
