"""Where a measure crosses its limit over two parameters: a curve through a lattice, of few of its cells.

Columns are searched from coarse to fine. Each starts on the line through its neighbours' crossings, gallops until it
has the limit between two cells (Bentley and Yao (1976), Information Processing Letters 5, 82), halves that down to
neighbours, and gallops out again until the cells at both ends of its interval are clear of noise: some four cells a
column. Of a column that crosses the limit more than once one crossing is found.

Like `breakdown.py` the search keeps no state: what to measure next follows from what has been measured.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from analysis.study.breakdown import Ending, breaks
from analysis.study.intervals import mean_interval
from render.base.arrays import Float

Node = tuple[int, int]
"""Column and row of the lattice."""
Column = Mapping[int, Float]
"""Repeats (n,) of the measure by row; NaN where a run measured nothing."""
Bracket = tuple[int, int]
"""Rows, neighbours: the first holds the limit, the second breaks it. -1 and the count of rows are beyond the window."""


@dataclass(frozen=True)
class Lattice:
    """columns, rows: values of the first and of the second parameter; row 0 is to hold the limit, the last to break it.

    above: the limit is broken by a measure above it, otherwise by one below it.
    """

    columns: int
    rows: int
    limit: float
    above: bool = True


@dataclass(frozen=True)
class Crossing:
    """Of one column; places in rows, from 0 to rows - 1."""

    column: int
    ending: Ending
    """found; holds: the limit is kept along the whole column; fails: it is broken at row 0 already."""
    row: float
    low: float
    """Of an interval that holds the crossing in 95 % of cases or more; NaN, as `row`, where none was found."""
    high: float


def next_nodes(lattice: Lattice, measured: Mapping[Node, Float]) -> list[Node]:
    """Cells to measure next, all with as many repeats; empty: the search has ended."""
    for _, asked in _levels(lattice, measured):
        if asked:
            return asked
    return []


def boundary(lattice: Lattice, measured: Mapping[Node, Float]) -> list[Crossing]:
    """The columns that are searched to their end, from the first to the last."""
    found: list[Crossing] = []
    columns = _by_column(measured)
    for brackets, _ in _levels(lattice, measured):
        for column, bracket in brackets.items():
            rows = columns[column]
            if not _missing_ends(lattice, rows, bracket):
                found.append(_crossing(lattice, rows, column, bracket))
    return sorted(found, key=lambda one: one.column)


def _levels(lattice: Lattice, measured: Mapping[Node, Float]) -> Iterator[tuple[dict[int, Bracket], list[Node]]]:
    """Level by level: brackets of the columns that have one, and what is still asked for; ends where anything is."""
    known: dict[int, Bracket] = {}
    columns = _by_column(measured)
    for level in _coarse_to_fine(lattice.columns):
        brackets: dict[int, Bracket] = {}
        asked: list[Node] = []
        for column in level:
            rows = columns.get(column, {})
            found = _search(lattice, rows, *_start(lattice, known, column))
            if isinstance(found, int):
                asked.append((column, found))
                continue
            brackets[column] = found
            asked += [(column, row) for row in _missing_ends(lattice, rows, found)]
        yield brackets, asked
        if asked:
            return
        known |= brackets


def _coarse_to_fine(columns: int) -> list[list[int]]:
    """Both outer columns, then those in the middle between neighbours, and so on."""
    levels, known = [sorted({0, columns - 1})], [0, columns - 1]
    while True:
        level = [(a + b) // 2 for a, b in itertools.pairwise(known) if b - a > 1]
        if not level:
            return levels
        levels.append(level)
        known = sorted({*known, *level})


def _start(lattice: Lattice, known: Mapping[int, Bracket], column: int) -> tuple[int, int]:
    """Row at which a column's search starts, on the line through its neighbours' crossings, and its first stride."""
    if not known:
        return (lattice.rows - 1) // 2, max((lattice.rows - 1) // 2, 1)
    left, right = max(i for i in known if i < column), min(i for i in known if i > column)
    share = (column - left) / (right - left)
    row = (1.0 - share) * sum(known[left]) / 2.0 + share * sum(known[right]) / 2.0
    return min(max(math.floor(row), 0), lattice.rows - 1), 1


def _search(lattice: Lattice, rows: Column, start: int, stride: int) -> Bracket | int:
    """The bracket, or the row that is to be measured for it."""
    good, bad, row = -1, lattice.rows, start
    while bad - good > 1:
        if row not in rows:
            return row
        good, bad = (good, row) if breaks(lattice.limit, lattice.above, rows[row]) else (row, bad)
        if good < 0:
            row, stride = max(bad - stride, 0), 2 * stride
        elif bad == lattice.rows:
            row, stride = min(good + stride, lattice.rows - 1), 2 * stride
        else:
            row = (good + bad) // 2
    return good, bad


def _missing_ends(lattice: Lattice, rows: Column, bracket: Bracket) -> list[int]:
    """Rows that are still to be measured for the interval of a bracket within the window."""
    if bracket[0] < 0 or bracket[1] == lattice.rows:
        return []
    return [row for row in (_end(lattice, rows, bracket[0], -1), _end(lattice, rows, bracket[1], 1)) if row not in rows]


def _end(lattice: Lattice, rows: Column, first: int, way: int) -> int:
    """From the first row outwards the nearest that is clear of noise, or not measured yet, or at the window's edge."""
    row, stride = first, 1
    while row in rows and 0 < row < lattice.rows - 1 and not _clear(lattice, rows[row], broken=way > 0):
        row, stride = min(max(row + way * stride, 0), lattice.rows - 1), 2 * stride
    return row


def _clear(lattice: Lattice, repeats: Float, *, broken: bool) -> bool:
    """The mean is on the side asked for, with the limit outside its 95 % interval; nothing measured is broken."""
    mean = mean_interval(repeats)
    if mean.count == 0:
        return broken
    return breaks(lattice.limit, lattice.above, repeats) == broken and not mean.low < lattice.limit < mean.high


def _crossing(lattice: Lattice, rows: Column, column: int, bracket: Bracket) -> Crossing:
    """The limit by the straight line between the means at both ends of the bracket."""
    good, bad = bracket
    if good < 0 or bad == lattice.rows:
        return Crossing(column, "fails" if good < 0 else "holds", math.nan, math.nan, math.nan)
    first, second = mean_interval(rows[good]).mean, mean_interval(rows[bad]).mean
    share = (lattice.limit - first) / (second - first) if math.isfinite(second) and second != first else 0.5
    low, high = _end(lattice, rows, good, -1), _end(lattice, rows, bad, 1)
    return Crossing(column, "found", good + share, float(low), float(high))


def _by_column(measured: Mapping[Node, Float]) -> dict[int, dict[int, Float]]:
    found: dict[int, dict[int, Float]] = {}
    for (column, row), repeats in measured.items():
        found.setdefault(column, {})[row] = repeats
    return found
