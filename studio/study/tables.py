"""A study's results as one tidy table, a row a cell: table.csv and table.parquet, and the seconds in times.csv.

The table holds what seeds decide and is the same to the bit on every run; seconds are not, and stand apart.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from render.base.files import atomic_write
from studio.project.project import Project
from studio.study.cells import Cell, Point, cells_at, methods_of, points, row_of, searched
from studio.study.measures import MEASURES, part_names
from studio.study.ray_units import MILLION, RAY_SPEED
from studio.study.store import Row
from studio.study.study import SEARCHES, Study

CALIBRATING = "seconds_calibrate"
"""Of a row whose cell calibrates; no part of its frame."""
SECONDS = ("seconds_render", "seconds_develop", "seconds_extract")
LOAD = "load"
"""Of a row: seconds that its task took over those of a processor: more than 1 where the machine had others to serve."""
RAY_UNITS = "ray_units"
"""Of times.csv: million rays that the machine could have traced in the frame's seconds."""


def measured_cells(
    study: Study, number: int, bases: Mapping[str, Project], rows: Mapping[str, Row]
) -> Iterator[tuple[Cell, Row]]:
    """A sweep's cells that are measured, with their rows: by point, method and repeat, whatever the order of work."""
    sweep = study.sweeps[number]
    wanted: dict[str | None, list[Point]]
    if sweep.sampling not in SEARCHES:
        wanted = {None: points(sweep)}
    else:
        wanted = {method: sorted(searched(study, number, method, bases, rows)) for method in methods_of(study, sweep)}
    for method, found in wanted.items():
        for cell in cells_at(study, number, bases, found):
            row = row_of(cell, rows)
            if row is not None and method in (None, cell.method):
                yield cell, row


def write_tables(folder: Path, study: Study, bases: Mapping[str, Project], rows: Mapping[str, Row]) -> list[Path]:
    """Write the three files, each whole or not at all; their paths.

    Columns: sweep, key, method, repeat, seed, one for every field varied, the measures in SI units, reason.
    """
    import pyarrow as pa
    import pyarrow.csv
    import pyarrow.parquet

    asked = {name for base in bases.values() for name in part_names(base.measures)}
    numbers = [*MEASURES, *sorted(asked)]
    fields = sorted({one.field for sweep in study.sweeps for one in sweep.vary})
    columns: dict[str, list[Any]] = {
        name: [] for name in ("sweep", "key", "method", "repeat", "seed", *fields, *numbers, "reason")
    }
    times: dict[str, list[Any]] = {name: [] for name in ("key", *SECONDS, CALIBRATING, RAY_UNITS)}
    cells = (measured_cells(study, number, bases, rows) for number in range(len(study.sweeps)))
    for cell, row in chain.from_iterable(cells):
        sweep = study.sweeps[cell.sweep]
        values = {one.field: value for one, value in zip(sweep.vary, cell.point, strict=True)}
        said = {"sweep": sweep.name, "key": cell.key, "method": cell.method, "repeat": cell.repeat}
        for name, column in columns.items():
            if name == "seed":
                column.append(cell.seed)
            else:
                column.append(
                    said[name]
                    if name in said
                    else values.get(name)
                    if name in fields
                    else row.get(name, math.nan if name in asked else None)
                )
        for name, column in times.items():
            value = rays_of([row], "frame")[0] if name == RAY_UNITS else row.get(name, math.nan)
            column.append(cell.key if name == "key" else value)
    tables = {"table": pa.table({k: _typed(v, k in numbers) for k, v in columns.items()})}
    tables["times"] = pa.table({k: _typed(v, k != "key") for k, v in times.items()})
    written = []
    for name, suffix in (("table", "csv"), ("table", "parquet"), ("times", "csv")):
        write = pyarrow.csv.write_csv if suffix == "csv" else pyarrow.parquet.write_table
        with atomic_write(folder / f"{name}.{suffix}") as temporary:
            write(tables[name], str(temporary))
        written.append(folder / f"{name}.{suffix}")
    return written


def _typed(values: list[Any], number: bool) -> Any:
    """A column; numbers and other values of one field side by side become text, and what is not finite is missing."""
    import pyarrow as pa

    if number:
        return pa.array([None if v is None or not math.isfinite(v) else float(v) for v in values], pa.float64())
    kinds = {type(value) for value in values if value is not None}
    if kinds == {int, float}:
        return pa.array([None if v is None else float(v) for v in values], pa.float64())
    return pa.array(values if len(kinds) <= 1 else [None if v is None else str(v) for v in values])


def grouped(
    study: Study, bases: Mapping[str, Project], rows: Mapping[str, Row], number: int
) -> dict[tuple[Any, str], list[Row]]:
    """Rows of one sweep's repeats by point and method, in order."""
    groups: dict[tuple[Any, str], list[Row]] = {}
    for cell, row in measured_cells(study, number, bases, rows):
        groups.setdefault((cell.point, cell.method), []).append(row)
    return groups


def seconds_of(rows: list[Row], time: str) -> np.ndarray:
    """(repeats,) processor seconds: of the whole "frame", of finding the "line", or of the "calibration"."""
    parts = {"frame": SECONDS, "line": SECONDS[-1:], "calibration": (CALIBRATING,)}[time]
    return np.array([sum(row.get(part, math.nan) for part in parts) for row in rows])


def task_seconds(rows: Sequence[Mapping[str, float]]) -> float:
    """Processor seconds of the cells of one render."""
    each = [sum(row.get(part, 0.0) for part in (*SECONDS[1:], CALIBRATING)) for row in rows]
    return max((row.get(SECONDS[0], 0.0) for row in rows), default=0.0) + sum(each)


def rays_of(rows: list[Row], time: str) -> np.ndarray:
    """(repeats,) million rays that the machine traces in that time, so that two machines compare."""
    speed = np.array([row.get(RAY_SPEED, math.nan) for row in rows], dtype=np.float64)
    return seconds_of(rows, time) * speed / MILLION


def values_of(rows: list[Row], name: str) -> np.ndarray:
    """(repeats,) of a measure."""
    return np.array([np.nan if row.get(name) is None else row[name] for row in rows], dtype=np.float64)
