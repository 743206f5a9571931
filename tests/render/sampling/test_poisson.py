"""Poisson samples: the right distribution on both sides of the change of method."""

from __future__ import annotations

import numba
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import stats

from render.sampling.poisson import poisson

MEANS = (0.003, 0.5, 5.0, 9.99, 10.01, 20.0, 200.0, 30_000.0)
FALSE_ALARM = 1.0 - (1.0 - 1e-3) ** (1.0 / (3 * len(MEANS)))
N = 200_000


@numba.njit
def _draw(mean: float, seed: int, n: int) -> NDArray[np.float64]:
    out = np.empty(n)
    for i in range(n):
        out[i] = poisson(mean, seed, i, 0, 1)
    return out


@pytest.mark.parametrize("mean", MEANS)
def test_counts_follow_the_poisson_distribution(mean: float) -> None:
    counts = _draw(mean, 11, N)
    reference = stats.poisson(mean)
    edges = np.unique(reference.ppf(np.linspace(0.0, 1.0, 102)[1:-1]))  # bins of about 1 % each
    observed = np.histogram(counts, np.r_[-np.inf, edges + 0.5, np.inf])[0]
    expected = np.diff(np.r_[0.0, reference.cdf(edges), 1.0]) * N
    keep = expected > 5.0
    observed, expected = np.r_[observed[keep], observed[~keep].sum()], np.r_[expected[keep], expected[~keep].sum()]
    observed, expected = observed[expected > 0.0], expected[expected > 0.0]
    assert stats.chisquare(observed, expected).pvalue > FALSE_ALARM


@pytest.mark.parametrize("mean", MEANS)
def test_mean_and_variance_are_the_mean(mean: float) -> None:
    counts = _draw(mean, 12, N)
    limit = stats.norm.isf(FALSE_ALARM / 2)
    assert abs(counts.mean() - mean) < limit * np.sqrt(mean / N)
    assert abs(counts.var() - mean) < limit * np.sqrt((mean + 2.0 * mean**2) / N)


@pytest.mark.parametrize("mean", [0.0, -1.0, np.nan])
def test_no_light_gives_no_electron(mean: float) -> None:
    assert poisson(mean, 1, 2, 3, 4) == 0.0


@pytest.mark.parametrize("mean", [1e9, 1e12, np.inf])
def test_a_blinding_mean_still_gives_a_finite_count(mean: float) -> None:
    assert 0.99 * min(mean, 1e12) < poisson(mean, 1, 2, 3, 4) < 1.01e12
