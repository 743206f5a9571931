"""What is drawn of a measure is what was measured."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.gauges.outline import outline
from tests.analysis.gauges.profiles import KINDS, gauge, profile, shape


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind not in ("angle", "opening", "area")])
def test_the_dimension_that_is_drawn_is_as_long_as_the_value(kind: str) -> None:
    height, value = shape(kind)
    curves, dimension = outline(gauge(kind), profile(height))
    drawn = float(np.linalg.norm(dimension[1] - dimension[0]))
    # a top that lies between two of the points drawn is lower by less than a thousandth
    assert drawn == pytest.approx(abs(value), rel=1e-3)
    assert all(np.isfinite(curve).all() for curve in curves)


@pytest.mark.parametrize("kind", KINDS)
def test_the_curves_run_along_the_part_within_their_regions(kind: str) -> None:
    height, _ = shape(kind)
    points, asked = profile(height), gauge(kind)
    curves, _ = outline(asked, points)
    for curve, (low, high) in zip(curves, asked.regions, strict=False):
        assert curve[:, 0].min() >= low - 1e-3 and curve[:, 0].max() <= high + 1e-3
        there = np.interp(curve[:, 0], points.position[:, 0], points.position[:, 1])
        assert np.abs(there - curve[:, 1]).max() < 2e-5


def test_a_measure_without_points_draws_nothing() -> None:
    height, _ = shape("step")
    far = gauge("step").model_copy(update={"regions": ((1.0, 2.0), (3.0, 4.0))})
    curves, dimension = outline(far, profile(height))
    assert curves == [] and dimension.shape == (0, 2)
