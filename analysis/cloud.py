"""Point clouds as files: binary PLY with error and source row as attributes, and CSV with units in the header."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Mapping, Sequence
from itertools import chain
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from analysis.error import Errors
from analysis.spool import Spool
from analysis.triangulate import Points
from render.base.arrays import Float
from render.base.errors import InputError
from render.base.files import atomic_write, check_regular, read_bytes
from render.base.pose import invert, transform_points
from render.scene.scene import Scene

Column = NDArray[Any]
Cloud = dict[str, Column]
"""Columns of equal length; the names of `UNITS`, float64 or int32."""

UNITS = {
    "x": "m",
    "y": "m",
    "z": "m",
    "sigma_random": "m",
    "sigma_systematic": "m",
    "sigma_depth_random": "m",
    "sigma_depth_systematic": "m",
    "sigma_surface_random": "m",
    "sigma_surface_systematic": "m",
    "correlation_length": "rows",
    "error_depth": "m",
    "error_surface": "m",
    "sheet_bias": "px",
    "u": "px",
    "v": "px",
    "row": "",
    "laser": "",
    "step": "",
}
INTEGERS = ("row", "laser", "step")
FORMER = {"sigma": ("sigma_random", 1.0), "error_distance": ("error_surface", -1.0)}
"""Columns of older files, by what they are called now, and the factor: the distance was positive towards the camera."""
MAX_BYTES = 2**32
PLY_TYPES = {
    "char": "i1", "uchar": "u1", "short": "<i2", "ushort": "<u2", "int": "<i4", "uint": "<u4", "float": "<f4",
    "double": "<f8", "int8": "i1", "uint8": "u1", "int16": "<i2", "uint16": "<u2", "int32": "<i4", "uint32": "<u4",
    "float32": "<f4", "float64": "<f8",
}  # fmt: skip
LONGEST_HEADER = 65536
PART = 1 << 16
"""Points that are in memory at a time, of a spooled cloud or of a file."""
MOST_BYTES = 2**36


def cloud(points: Points, errors: Errors | None, laser: int, step: int, scene: Scene | None = None) -> Cloud:
    """Valid points of one laser and step; errors are NaN without `errors`. "row" is the scan line.

    The sigmas of the surface are along its normal at the point, those of depth along the camera's axis.
    With `errors` the systematic sigmas hold, beside the calibration, the bias that the truth predicts of the sheet's
    own width, as one standard deviation; of photographs nobody knows it.
    With a scene whose objects move, x, y, z are carried back to step 0, so that the clouds of all steps fit together.
    """
    here = points.valid
    xyz = points.world[here] if scene is None else at_first_step(points.world[here], scene, step)
    count = len(xyz)
    nan = np.full(count, np.nan)
    sheet = np.zeros(count) if errors is None else np.nan_to_num(errors.sheet_bias[here])
    gradient = points.gradient[here]
    return {
        "x": xyz[:, 0].copy(),
        "y": xyz[:, 1].copy(),
        "z": xyz[:, 2].copy(),
        "sigma_random": points.sigma[here],
        "sigma_systematic": np.hypot(points.sigma_systematic[here], np.linalg.norm(gradient, axis=1) * sheet),
        "sigma_depth_random": points.sigma_depth[here],
        "sigma_depth_systematic": np.hypot(points.sigma_depth_systematic[here], gradient[:, 2] * sheet),
        "sigma_surface_random": nan if errors is None else errors.sigma_off_surface[here],
        "sigma_surface_systematic": nan if errors is None else errors.systematic_off_surface[here],
        "correlation_length": points.correlation_length[here],
        "error_depth": nan if errors is None else errors.depth[here],
        "error_surface": nan if errors is None else errors.off_surface[here],
        "sheet_bias": nan if errors is None else errors.sheet_bias[here],
        "u": points.pixel[here, 0],
        "v": points.pixel[here, 1],
        "row": points.index[here].astype(np.int32),
        "laser": np.full(count, laser, dtype=np.int32),
        "step": np.full(count, step, dtype=np.int32),
    }


def at_first_step(world: Float, scene: Scene, step: int) -> Float:
    """(m, 3) world points of a step, moved with the objects to where they are at step 0."""
    return transform_points(T_first_step(scene, step), world)


def T_first_step(scene: Scene, step: int) -> Float:
    """(4, 4) from the world of a step to where its objects are at step 0."""
    motion = scene.motion
    if motion.kind == "none" or motion.moves != "objects":
        return np.eye(4)
    return np.asarray(motion.displacement(0) @ invert(motion.displacement(step)))


def at_step(first: Float, scene: Scene, step: int) -> Float:
    """The inverse of `at_first_step`: (m, 3) points as they stand at step 0, moved with the objects to a step."""
    motion = scene.motion
    if motion.kind == "none" or motion.moves != "objects":
        return first
    return transform_points(motion.displacement(step) @ invert(motion.displacement(0)), first)


def merge(clouds: Sequence[Cloud]) -> Cloud:
    """One after the other; no cloud at all gives empty columns."""
    if not clouds:
        return {name: np.zeros(0, dtype=np.int32 if name in INTEGERS else np.float64) for name in UNITS}
    return {name: np.concatenate([part[name] for part in clouds]) for name in clouds[0]}


class SpooledCloud:
    """A cloud of any length outside memory, of the columns of `UNITS`."""

    def __init__(self, folder: Path | None = None) -> None:
        """folder: of its file, as `Spool`."""
        self.count = 0
        self._spool = Spool(folder)
        self._dtype = _table(merge([])).dtype

    def add(self, columns: Cloud) -> None:
        """InputError: as `Spool.append`."""
        table = _table(columns)
        if table.dtype != self._dtype:
            raise ValueError(f"columns {table.dtype.names}; allowed: {self._dtype.names}")
        self._spool.append(table.tobytes())
        self.count += len(table)

    def parts(self) -> Iterator[Cloud]:
        """All of it, one part after the other; at least one, be it empty."""
        size = self._dtype.itemsize
        for start in range(0, max(self.count, 1), PART):
            table = np.frombuffer(self._spool.read(start * size, PART * size), self._dtype)
            yield {name: table[name] for name in UNITS}

    def close(self) -> None:
        self._spool.close()


def _table(columns: Mapping[str, Column]) -> NDArray[np.void]:
    """As the vertices of a PLY file: doubles for float64 columns, ints for int32."""
    kinds = [(name, "<i4" if column.dtype.kind == "i" else "<f8") for name, column in columns.items()]
    table = np.empty(len(next(iter(columns.values()))), dtype=kinds)
    for name, column in columns.items():
        table[name] = column
    return table


def _parts(points: Mapping[str, Column] | SpooledCloud) -> tuple[int, Iterator[Cloud]]:
    if isinstance(points, SpooledCloud):
        return points.count, points.parts()
    return len(next(iter(points.values()))), iter([dict(points)])


def write_ply(path: Path | str, points: Mapping[str, Column] | SpooledCloud) -> None:
    """Binary little-endian PLY: doubles for float64 columns, ints for int32. InputError: the file cannot be written."""
    count, parts = _parts(points)
    first = next(parts)
    header = [
        "ply",
        "format binary_little_endian 1.0",
        "comment metre, pixel; world frame",
        f"element vertex {count}",
        *(f"property {'int' if column.dtype.kind == 'i' else 'double'} {name}" for name, column in first.items()),
    ]
    with atomic_write(path) as temporary, open(temporary, "wb") as file:
        file.write("\n".join([*header, "end_header", ""]).encode("ascii"))
        for part in chain([first], parts):
            file.write(_table(part).tobytes())


def read_ply(path: Path | str) -> Cloud:
    """The scalar columns of a binary little-endian PLY's vertices, as float64 or int32; older names as they are now.

    InputError: it is none.
    """
    return merge(list(ply_pieces(path)))


def ply_pieces(path: Path | str, rows: int = PART) -> Iterator[Cloud]:
    """As `read_ply`, so many points at a time, at least one piece: for clouds that do not fit in memory."""
    where = str(path)
    check_regular(Path(path), MOST_BYTES, "point cloud")
    try:
        with open(path, "rb") as file:
            count, dtype = _ply_header(file, where)
            for start in range(0, max(count, 1), rows):
                size = min(rows, count - start) * dtype.itemsize
                data = file.read(size)
                if len(data) < size:
                    raise InputError("the PLY file is cut short", where=where, found=f"fewer than {count} points")
                yield _columns(np.frombuffer(data, dtype=dtype))
    except OSError as error:
        raise InputError("the file cannot be read", where=where, found=error.strerror or error) from error


def _columns(table: NDArray[Any]) -> Cloud:
    kinds = {name: np.float64 if table[name].dtype.kind == "f" else np.int32 for name in table.dtype.names or ()}
    cells: Cloud = {}
    for name, kind in kinds.items():
        now, factor = FORMER.get(name, (name, 1.0))
        cells[now] = np.asarray(table[name].astype(kind))
        if factor != 1.0:
            cells[now] *= factor
    return cells


def _ply_header(file: BinaryIO, where: str) -> tuple[int, np.dtype[Any]]:
    """Number and layout of the vertices; the file is left at the first of them."""
    data = file.read(LONGEST_HEADER)
    end = data.find(b"end_header\n")
    if not data.startswith(b"ply\n") or end < 0:
        raise InputError("not a PLY file", where=where, allowed="a PLY header")
    count = 0
    fields: list[tuple[str, str]] = []
    for text in data[:end].decode("ascii", "replace").splitlines():
        words = text.split()
        if words[:1] == ["format"] and words[1:2] != ["binary_little_endian"]:
            raise InputError("the PLY format is not read", where=where, found=text, allowed="binary_little_endian")
        if words[:1] == ["element"]:
            if len(words) != 3 or words[1] != "vertex" or fields or not words[2].isdecimal():
                raise InputError("an element is not read", where=where, found=text, allowed="one element, vertex")
            count = int(words[2])
        if words[:1] == ["property"]:
            if len(words) != 3 or words[1] not in PLY_TYPES or words[2] in dict(fields):
                raise InputError("a property is not read", where=where, found=text, allowed="scalars, each name once")
            fields.append((words[2], PLY_TYPES[words[1]]))
    if not fields:
        raise InputError("the PLY file has no points", where=where, allowed="scalar properties of a vertex")
    file.seek(end + len(b"end_header\n"))
    return count, np.dtype(fields)


def title(name: str) -> str:
    """A column's title in a table: its name and unit."""
    return f"{name}_{UNITS[name]}" if UNITS.get(name) else name


def write_csv(path: Path | str, points: Mapping[str, Column] | SpooledCloud) -> None:
    """One row a point, header `x_m, ..., u_px, ..., row`; floats with all digits, NaN as an empty cell.

    InputError: the file cannot be written.
    """
    import pyarrow  # it takes longer to load than a small table to write, and only who writes one needs it
    from pyarrow.csv import WriteOptions
    from pyarrow.csv import write_csv as write_table

    _, parts = _parts(points)
    first = next(parts)
    header, options = [title(name) for name in first], WriteOptions(include_header=False)
    with atomic_write(path) as temporary, open(temporary, "wb") as file:
        file.write(f"{','.join(header)}\n".encode())
        for part in chain([first], parts):
            columns = {name: pyarrow.array(column, from_pandas=True) for name, column in part.items()}
            write_table(pyarrow.table(columns), file, options)


def read_csv(path: Path | str) -> Cloud:
    """Inverse of `write_csv`. InputError: a cell is no number, or a row is short."""
    names = {title(name): (name, 1.0) for name in UNITS} | {f"{name}_m": now for name, now in FORMER.items()}
    data = read_bytes(Path(path), MAX_BYTES, "table")
    try:
        header, *rows = list(csv.reader(io.StringIO(data.decode("utf-8"), newline=""))) or [[]]
    except (UnicodeDecodeError, csv.Error):
        found = "bytes that are not UTF-8, or a cell without end"
        raise InputError("the table cannot be read", where=str(path), found=found) from None
    cells: Cloud = {}
    for i, heading in enumerate(header):
        name, factor = names.get(heading, (heading, 1.0))
        try:
            texts = [row[i] for row in rows]
            if name in INTEGERS:
                cells[name] = np.array(texts, dtype=np.int32)
            else:
                cells[name] = factor * np.array([text or "nan" for text in texts], dtype=np.float64)
        except (ValueError, IndexError, OverflowError):
            kind = "whole numbers" if name in INTEGERS else "numbers"
            raise InputError(
                "the table holds a cell that is no number", where=f"{path}: {heading}", allowed=f"{kind} in every row"
            ) from None
    return cells
