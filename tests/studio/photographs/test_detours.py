"""A chain that leaves the line for something smoother comes back; one that leaves something for the line does not."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.line.result import Line
from analysis.line.selection.continuity import select_chain
from studio.photographs.detours import without_detours_of

COUNT, START, STOP, EDGE = 300, 100, 220, 20.0


def candidates(rough: float, brightness: float, wide: float) -> Line:
    """A line at 200 px, rough on some scan lines, and there an even edge, `brightness` and `wide` times the line's."""
    rng = np.random.default_rng(4)
    rows = np.arange(COUNT)
    there = (rows >= START) & (rows < STOP)
    u = np.stack([200.0 + np.where(there, rough, 0.1) * rng.standard_normal(COUNT), np.where(there, EDGE, np.nan)], 1)
    width = np.stack([np.full(COUNT, 2.0), np.full(COUNT, 2.0 * wide)], 1)
    amplitude = np.stack([np.full(COUNT, 100.0), np.full(COUNT, 100.0 * brightness)], 1)
    flag = np.where(np.isfinite(u), 0, 2).astype(np.uint8)
    same = np.ones_like(u)
    return Line("rows", "likelihood", u, 0.1 * same, width, amplitude, same, same, flag)


def test_a_chain_that_took_an_even_edge_comes_back_to_the_line() -> None:
    peaks = candidates(rough=1.2, brightness=0.6, wide=2.0)
    chain = select_chain(peaks)
    assert np.mean(chain.u[START:STOP, 0] == EDGE) > 0.9  # smoothness alone takes the edge
    line = without_detours_of(peaks, chain)
    assert np.nanmax(np.abs(line.u[:, 0] - 200.0)) < 6.0 and line.valid.mean() > 0.99


@pytest.mark.parametrize(("brightness", "wide"), [(1.5, 2.0), (0.6, 1.0)])
def test_what_is_brighter_or_as_wide_as_the_line_is_left_as_it_was_chosen(brightness: float, wide: float) -> None:
    peaks = candidates(rough=1.2, brightness=brightness, wide=wide)
    chain = select_chain(peaks)
    np.testing.assert_array_equal(without_detours_of(peaks, chain).u, chain.u)
