"""Searches that go on as soon as all that each has asked for is measured, while other cells are still under way."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence

from analysis.study.breakdown import EXTRA
from studio.project.project import Project
from studio.study.cells import Cell, Rows, Shard, lattice_of, methods_of, next_of_search, searched
from studio.study.study import SEARCHES, Study, Sweep

A_COLUMN = 5
"""Cells of a boundary's column, about."""


def most_to_come(sweep: Sweep, points: int) -> int:
    """Points that a search may ask for, about at most, after so many that are measured or to be measured."""
    if sweep.sampling == "boundary":
        return max(lattice_of(sweep).columns * A_COLUMN - points, 0)
    return max(2 + math.ceil(math.log2(1.0 / sweep.tolerance)) + EXTRA - points, 0)


class Searching:
    """The searches of a study, from cells that were handed out."""

    def __init__(
        self, study: Study, bases: Mapping[str, Project], shard: Shard, handed_out: Sequence[Cell], rows: Rows
    ) -> None:
        self.study, self.bases, self.shard = study, bases, shard
        self.handed_out = {cell.key for cell in handed_out}
        self.measured = set(rows)
        self.waits_for: dict[tuple[int, str], set[str]] = {}
        """Keys, by sweep and method; empty: the search is over."""
        self.points: dict[tuple[int, str], int] = {}
        """That each search of the shard has asked for so far."""
        for number, sweep in enumerate(study.sweeps):
            for method in methods_of(study, sweep) if sweep.sampling in SEARCHES else ():
                asked = next_of_search(study, number, method, bases, rows)
                self.waits_for[number, method] = {cell.key for cell in asked}
                if asked and shard.holds(asked[0].part_key(study)):
                    known = searched(study, number, method, bases, rows)
                    self.points[number, method] = len(known) + len({cell.point for cell in asked})

    @property
    def to_come(self) -> int:
        """Cells that may be asked for beside those that were handed out."""
        under_way = ((number, count) for (number, of), count in self.points.items() if self.waits_for[number, of])
        sweeps = self.study.sweeps
        return self.study.repeats * sum(most_to_come(sweeps[number], count) for number, count in under_way)

    def next_cells(self, measured: Iterable[str], rows: Callable[[], Rows]) -> list[Cell]:
        """What follows from cells that are measured now, by their keys. rows: of all that are; asked only if needed."""
        self.measured.update(measured)
        ready = [search for search, keys in self.waits_for.items() if keys and keys <= self.measured]
        known: Rows = rows() if ready else {}
        found: dict[str, Cell] = {}
        for number, method in ready:
            asked = next_of_search(self.study, number, method, self.bases, known)
            self.waits_for[number, method] = {cell.key for cell in asked}
            if (number, method) in self.points:
                self.points[number, method] += len({cell.point for cell in asked})
            for cell in asked:
                if cell.key not in self.handed_out and self.shard.holds(cell.part_key(self.study)):
                    found[cell.key] = cell
        self.handed_out.update(found)
        return list(found.values())
