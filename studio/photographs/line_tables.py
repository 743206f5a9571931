"""A line as a table, what is told of it in a few words, and where the table goes."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.line.result import Flag, Line
from render.base.csv_file import write_csv
from studio.photographs.region import Region
from studio.scan.own_files import check_replaceable, line_columns


def write_line(path: Path, line: Line) -> None:
    """One row of the table for each scan line and peak: where it is, or the reason why there is none. Units: px, e-."""
    along, across = (line.u, line.v) if line.axis == "rows" else (line.v, line.u)
    length = np.ones_like(line.u) if line.correlation_length is None else line.correlation_length
    numbers = (along, across, line.sigma_u, line.width, line.amplitude, line.background, line.chi2, length)
    told = np.stack([np.where(line.valid, values, np.nan) for values in numbers], axis=-1).tolist()
    names = {flag.value: flag.name for flag in Flag}
    rows = []
    for i, (row, flags) in enumerate(zip(told, line.flag.tolist(), strict=True)):
        for k, (cells, flag) in enumerate(zip(row, flags, strict=True)):
            rows.append([i, k, *(f"{cell:.9g}" if math.isfinite(cell) else "" for cell in cells), names[flag]])
    write_csv(path, line_columns(line.axis), rows)


def summary(path: Path, line: Line, table: Path, region: Region) -> dict[str, Any]:
    """What a person or a program wants to know of one image; scan lines beyond the region do not count."""
    found = line.valid[:, 0]

    def typical(values: NDArray[np.float64]) -> float | None:
        known = values[found, 0][np.isfinite(values[found, 0])]
        return float(np.median(known)) if len(known) else None

    flags, counts = np.unique(line.flag[:, 0], return_counts=True)
    return {
        "image": str(path),
        "method": line.method,
        "note": line.note,
        "axis": line.axis,
        "scan_lines": region.scan_lines(len(found), line.axis),
        "found": int(found.sum()),
        "sigma_u_px": typical(line.sigma_u),
        "correlation_length_rows": None if line.correlation_length is None else typical(line.correlation_length),
        "width_px": typical(line.width),
        "amplitude_e": typical(line.amplitude),
        "flags": {Flag(int(flag)).name: int(count) for flag, count in zip(flags, counts, strict=True)},
        "file": str(table),
    }


def table_path(path: Path, out: Path | None, taken: set[Path], what: str = "line") -> Path:
    """Where an image's table goes: beside it or in `out`; a number tells images of one name apart.

    InputError: a file of that name is there which is no such table.
    """
    folder, number = out if out is not None else path.parent, 1
    target = folder / f"{path.stem}_{what}.csv"
    while target in taken:
        number += 1
        target = folder / f"{path.stem}_{number}_{what}.csv"
    check_replaceable([target])
    taken.add(target)
    return target
