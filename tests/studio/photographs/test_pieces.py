"""A photograph without a line has none, and a line in pieces is one."""

from __future__ import annotations

import numpy as np

from studio.photographs.pieces import lines_only
from tests.studio.photographs.test_line_ends import COUNT, line_of


def test_short_pieces_that_go_on_nowhere_are_no_line() -> None:
    rng = np.random.default_rng(9)
    there = np.arange(COUNT) % 14 < 11
    u = np.repeat(rng.uniform(0.0, 500.0, -(-COUNT // 14)), 14)[:COUNT]
    assert not lines_only(line_of(np.where(there, 100.0, 0.0), u)).valid.any()


def test_a_line_with_gaps_and_steps_stays_whole() -> None:
    rows = np.arange(COUNT)
    u = 50.0 + 0.4 * rows + 30.0 * (rows // 40)
    line = line_of(np.where(rows % 40 < 34, 100.0, 0.0), u)
    assert (lines_only(line).valid == line.valid).all()
