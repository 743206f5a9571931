"""The boundary of each method in a map, of the cells that are measured so far."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from analysis.study.boundary import Crossing, boundary
from studio.project.project import Project
from studio.study.cells import lattice_of, methods_of, on_lattice, searched
from studio.study.store import Row
from studio.study.study import Study


@dataclass(frozen=True)
class Edge:
    """Of one method, by column; `cells` of the lattice were measured for it, each with all repeats."""

    method: str
    crossings: tuple[Crossing, ...]
    cells: int


def edges_of(study: Study, number: int, bases: Mapping[str, Project], rows: Mapping[str, Row]) -> tuple[Edge, ...]:
    """None of a sweep that searches no boundary."""
    sweep = study.sweeps[number]
    if sweep.sampling != "boundary":
        return ()
    found = []
    for method in methods_of(study, sweep):
        known = on_lattice(sweep, searched(study, number, method, bases, rows))
        found.append(Edge(method, tuple(boundary(lattice_of(sweep), known)), len(known)))
    return tuple(found)
