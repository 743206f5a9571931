"""Cells of a study's folder that the study, as it is now, could never ask for."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from studio.project.project import Project
from studio.study.cells import Cell, Point, cells_at, methods_of, next_points, row_of
from studio.study.store import Row
from studio.study.study import SEARCHES, Study
from studio.study.tables import measured_cells

LEAST_REPEATS, MOST_REPEATS = 3, 20
"""Of a search, and of one that is followed once more as it went before the study was extended."""


def left_over(study: Study, bases: Mapping[str, Project], rows: Mapping[str, Row]) -> int:
    """How many neither the values of a sweep nor its search have asked for."""
    asked: set[str] = set()
    for number in range(len(study.sweeps)):
        for cell, _ in measured_cells(study, number, bases, rows):
            asked |= {cell.key, cell.former_key}
    for number, sweep in enumerate(study.sweeps):
        if sweep.sampling in SEARCHES and rows.keys() - asked:
            asked |= _asked_by_search(study, number, bases, rows)
    return len(rows.keys() - asked)


def _asked_by_search(study: Study, number: int, bases: Mapping[str, Project], rows: Mapping[str, Row]) -> set[str]:
    """Keys of all that a sweep's search has asked for, as far as it was measured and one step beyond.

    With fewer repeats it went its own way, and what it asked for on that is no less its own: `measured_cells` follows
    it only as far as all repeats are there.
    """
    sweep, at, asked = study.sweeps[number], dict[Point, list[Cell]](), set[str]()
    assert sweep.limit is not None
    for method in methods_of(study, sweep):
        for repeats in {study.repeats, *range(LEAST_REPEATS, min(study.repeats, MOST_REPEATS))}:
            known: dict[Point, np.ndarray] = {}
            while wanted := next_points(sweep, known):
                complete: dict[Point, np.ndarray] = {}
                for point in wanted:
                    if point not in at:
                        at[point] = list(cells_at(study, number, bases, [point]))
                    cells = [cell for cell in at[point] if cell.method == method]
                    asked |= {key for cell in cells for key in (cell.key, cell.former_key)}
                    found = [row for row in (row_of(cell, rows) for cell in cells[:repeats]) if row is not None]
                    if len(found) == repeats:
                        complete[point] = np.array([row[sweep.limit.measure] for row in found], dtype=np.float64)
                known |= complete
                if len(complete) < len(wanted):
                    break
    return asked
