"""Statistics of a region: their sigma is what repeated draws show, and its table holds its points alone."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import binom

from analysis.measures import error_statistics

TRIALS, COUNT = 400, 120


@pytest.mark.parametrize("r", [0.0, 0.6])
def test_the_sigmas_of_a_region_cover_what_repeated_draws_show(r: float) -> None:
    """About the truth of AR(1) errors: mean 0.3, sigma 1. The share within 2 sigma, with the slack of 400 draws."""
    rng = np.random.default_rng(17)
    white = rng.standard_normal((TRIALS, COUNT)) * np.sqrt(1.0 - r**2)
    white[:, 0] /= np.sqrt(1.0 - r**2)
    errors = 0.3 + lfilter([1.0], [1.0, -r], white, axis=1)
    truth = (0.3, np.sqrt(1.09), 1.0)
    index, length = np.arange(COUNT), (1.0 + r) / (1.0 - r)
    figures = np.array([error_statistics(error, index, length) for error in errors])
    for value, sigma, true in zip(figures[:, :, 0].T, figures[:, :, 1].T, truth, strict=True):
        inside = np.count_nonzero(np.abs(value - true) < 2.0 * sigma)
        # estimated sigmas make heavier tails than the normal's 95.4 %
        assert binom.ppf(1e-3, TRIALS, 0.92) <= inside <= binom.ppf(1.0 - 1e-3, TRIALS, 0.975)
