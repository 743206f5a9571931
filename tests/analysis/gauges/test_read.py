"""Dimensions of exact profiles are exact, and those of noisy ones as uncertain as their sigma says."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import binom

from analysis.gauges.read import read
from tests.analysis.gauges.profiles import KINDS, gauge, noises, profile, shape

TRIALS = 250


@pytest.mark.parametrize("kind", KINDS)
def test_an_exact_profile_gives_the_closed_form(kind: str) -> None:
    height, exact = shape(kind)
    reading = read(gauge(kind), 0, profile(height), profile(height))
    # the bow is of a parabola in the axes of the points, the dimension of one in those of the profile
    assert reading.value == pytest.approx(exact, rel=1e-7)
    assert reading.error == 0.0 and reading.sigma > 0.0


@pytest.mark.parametrize("kind", KINDS)
def test_sigma_covers_and_nothing_is_biased(kind: str) -> None:
    """Half of the profiles have noise that neighbours share."""
    height, exact = shape(kind)
    told = []
    for length in (1.0, 5.0):
        for noise in noises(TRIALS // 2, length, seed=7):
            reading = read(gauge(kind), 0, profile(height, length=length, noise=noise), None)
            told.append((reading.value - exact) / reading.sigma)
    low, high = binom.ppf([0.0005, 0.9995], TRIALS, 0.9545)
    assert low <= np.count_nonzero(np.abs(told) <= 2.0) <= high
    assert abs(np.mean(told)) < 0.1 + 3.3 / np.sqrt(TRIALS)
