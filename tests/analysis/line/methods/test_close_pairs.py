"""Two lines so close that they have one peak: mostly one line of another shape, which a single Gaussian measures."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.line.extract import extract
from analysis.line.result import Flag
from tests.analysis.line.troubles import TROUBLES, photographed


@pytest.mark.parametrize(
    ("trouble", "sigma", "most"), [("texture of 5 %", 2.0, 0.05), ("slanted edge to 30 %", 2.0, 0.03)]
)
def test_on_texture_and_edges_they_are_measured_about_as_well_as_by_a_single_gaussian(trouble, sigma, most):
    """By the brighter of the two they were off by five to eight times as much."""
    image, centre, noise = photographed(TROUBLES[trouble], 10000.0, sigma, 1000, seed=77)
    line, single = (extract(image, noise=noise, method=method) for method in ("likelihood", "gaussian"))
    blended = line.flag[:, 0] == Flag.BLENDED
    assert blended.sum() > 10
    error, plain = (np.sqrt(np.mean((one.u[blended, 0] - centre[blended]) ** 2)) for one in (line, single))
    assert error < most * sigma and error < 3.0 * plain
    assert np.all(np.abs(line.u[blended, 0] - centre[blended]) < 2.0 * line.sigma_u[blended, 0])


def test_a_position_of_two_is_never_told_to_be_less_sure_than_the_width_where_they_have_one_peak():
    """The brighter one of a pair whose fit hardly converges was told to 300 px."""
    image, _, noise = photographed(TROUBLES["reflection of 10 %"], 1000.0, 2.0, 1000, seed=77)
    line = extract(image, noise=noise)
    blended = line.flag[:, 0] == Flag.BLENDED
    assert blended.sum() > 500 and line.sigma_u[blended, 0].max() < 2.5 * line.width[blended, 0].max()
