"""What blur along the line may move a position by: as much as it does at corners and steps, and nothing beside them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from analysis.line.result import Flag, Line
from studio.photographs.blur_along import BLUR, with_blur_along

COUNT, SIGMA = 200, 0.01
ROWS = np.arange(COUNT, dtype=np.float64)


def line_of(u: np.ndarray, width: float = 2.0) -> Line:
    """(n,) positions, NaN where there is none."""
    column, ones = u[:, None], np.ones((len(u), 1))
    flag = np.where(np.isfinite(column), Flag.OK, Flag.NO_PEAK).astype(np.uint8)
    return Line("rows", "likelihood", column, SIGMA * ones, width * ones, ones, ones, ones, flag)


def added(line: Line) -> np.ndarray:
    """(n,) px that sigma grows by, in quadrature."""
    return np.sqrt(with_blur_along(line, line).sigma_u[:, 0] ** 2 - SIGMA**2)


@pytest.mark.parametrize("slope", [0.0, 0.3])
def test_a_straight_line_is_as_sure_as_before(slope: float) -> None:
    assert added(line_of(60.0 + slope * ROWS))[5:-5].max() < 1e-6


def test_a_corner_is_told_by_what_blur_rounds_it_by() -> None:
    true = 60.0 + 0.8 * np.abs(ROWS - 100.0)
    seen = gaussian_filter1d(true, BLUR)
    told, error = added(line_of(seen)), np.abs(seen - true)
    assert error[100] == pytest.approx(1.6 * BLUR / math.sqrt(2.0 * math.pi), rel=0.05)
    assert told[100] / error[100] == pytest.approx(math.sqrt(2.0) - 1.0, rel=0.1)  # of a kernel twice over, less once
    assert np.all(error < told / (math.sqrt(2.0) - 1.0) + 0.05 * error[100])
    assert told[5:90].max() < 0.02 * error[100]


def test_a_gap_and_another_line_beside_it_are_no_bend() -> None:
    gap = 60.0 + 0.0 * ROWS
    gap[90:110] = np.nan
    assert np.nanmax(added(line_of(gap))) < 1e-6
    assert added(line_of(np.where(ROWS < 100.0, 60.0, 90.0))).max() < 1e-6
    near = added(line_of(np.where(ROWS < 100.0, 60.0, 62.0)))
    assert 0.5 < near[100] < 1.0 and near[:90].max() < 1e-6


def test_what_is_rounded_is_alike_over_the_kernel_only() -> None:
    bent = line_of(gaussian_filter1d(60.0 + 2.0 * np.abs(ROWS - 100.0), BLUR))
    length = with_blur_along(bent, bent).length_apart
    assert length is not None
    assert length[100, 0] == pytest.approx(2.0 * math.sqrt(math.pi) * BLUR, rel=0.01) and length[50, 0] < 1.01
