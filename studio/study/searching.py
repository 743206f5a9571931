"""Searches that go on as soon as all that each has asked for is measured, while other cells are still under way."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence

from studio.project.project import Project
from studio.study.cells import Cell, Rows, Shard, methods_of, next_of_search
from studio.study.study import SEARCHES, Study


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
        for number, sweep in enumerate(study.sweeps):
            for method in methods_of(study, sweep) if sweep.sampling in SEARCHES else ():
                asked = next_of_search(study, number, method, bases, rows)
                self.waits_for[number, method] = {cell.key for cell in asked}

    def next_cells(self, measured: Iterable[str], rows: Callable[[], Rows]) -> list[Cell]:
        """What follows from cells that are measured now, by their keys. rows: of all that are; asked only if needed."""
        self.measured.update(measured)
        ready = [search for search, keys in self.waits_for.items() if keys and keys <= self.measured]
        known: Rows = rows() if ready else {}
        found: dict[str, Cell] = {}
        for number, method in ready:
            asked = next_of_search(self.study, number, method, self.bases, known)
            self.waits_for[number, method] = {cell.key for cell in asked}
            for cell in asked:
                if cell.key not in self.handed_out and self.shard.holds(cell.part_key(self.study)):
                    found[cell.key] = cell
        self.handed_out.update(found)
        return list(found.values())
