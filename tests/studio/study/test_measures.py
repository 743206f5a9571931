"""What a cell is measured by."""

from __future__ import annotations

import numpy as np

from render.frame import LaserCurve
from studio.study.measures import at_end


def curve_of(index: list[int], position: list[float]) -> LaserCurve:
    rows, one = np.array(index, np.int64), np.ones(len(index))
    point = np.zeros((len(index), 3))
    return LaserCurve(
        "rows", rows, np.array(position, float), point, one, one, 0 * rows, one, one, one, np.zeros((0, 2, 3)), one
    )


def test_a_line_ends_where_it_stops_and_on_either_side_of_a_step_or_a_gap() -> None:
    rows = [*range(3, 10), *range(12, 20)]
    steep = [100.0 + 2.0 * row + (60.0 if row >= 16 else 0.0) for row in rows]
    found = at_end(curve_of(rows, steep))
    assert np.array(rows)[found].tolist() == [3, 9, 12, 15, 16, 19]


def test_each_of_two_lines_on_the_same_rows_has_its_own_ends() -> None:
    left, right = [(row, 50.0 + row) for row in range(10)], [(row, 200.0 - row) for row in range(4, 10)]
    both = sorted(left + right)
    found = at_end(curve_of([row for row, _ in both], [place for _, place in both]))
    assert [both[i] for i in np.flatnonzero(found)] == [(0, 50.0), (4, 196.0), (9, 59.0), (9, 191.0)]


def test_without_a_line_nothing_ends() -> None:
    assert at_end(curve_of([], [])).shape == (0,)
