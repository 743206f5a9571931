"""Counter-based random numbers: flat, normal, independent along every counter, and a pure function of them."""

from __future__ import annotations

from collections.abc import Callable

import numba
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import stats

from render.sampling import random

TESTS = 20
FALSE_ALARM = 1.0 - (1.0 - 1e-3) ** (1.0 / TESTS)  # Sidak: one chance in a thousand over all the tests of this file
N = 400_000
COUNTERS = {"seed": 0, "index": 1, "sample": 2, "dimension": 3}


@numba.njit
def _draw(kind: int, start: NDArray[np.int64], step: NDArray[np.int64], n: int) -> NDArray[np.float64]:
    out = np.empty(n)
    for i in range(n):
        a, b, c, d = start[0] + i * step[0], start[1] + i * step[1], start[2] + i * step[2], start[3] + i * step[3]
        out[i] = random.uniform(a, b, c, d) if kind == 0 else random.normal(a, b, c, d)
    return out


@numba.njit
def _raw(n_index: int, n_sample: int, n_dimension: int) -> NDArray[np.uint64]:
    out = np.empty(n_index * n_sample * n_dimension, dtype=np.uint64)
    k = 0
    for i in range(n_index):
        for j in range(n_sample):
            for d in range(n_dimension):
                out[k] = random.bits(1, i, j, d)
                k += 1
    return out


def draws(kind: str, along: str, n: int = N, start: tuple[int, ...] = (7, 0, 0, 0)) -> NDArray[np.float64]:
    step = np.zeros(4, dtype=np.int64)
    step[COUNTERS[along]] = 1
    return np.asarray(_draw(int(kind == "normal"), np.array(start, dtype=np.int64), step, n))


@pytest.mark.parametrize("along", COUNTERS)
def test_uniform_is_flat_along_each_counter(along: str) -> None:
    counts = np.histogram(draws("uniform", along), bins=1000, range=(0.0, 1.0))[0]
    assert stats.chisquare(counts).pvalue > FALSE_ALARM


@pytest.mark.parametrize("along", COUNTERS)
def test_neighbouring_draws_are_independent_along_each_counter(along: str) -> None:
    u = draws("uniform", along)
    pairs = np.histogram2d(u[:-1:2], u[1::2], bins=32, range=((0.0, 1.0), (0.0, 1.0)))[0]
    assert stats.chisquare(pairs.ravel()).pvalue > FALSE_ALARM


@pytest.mark.parametrize("other", ["seed", "sample", "dimension"])
def test_the_same_pixels_are_independent_under_another_counter(other: str) -> None:
    start = [7, 0, 0, 0]
    start[COUNTERS[other]] += 1
    a, b = draws("uniform", "index"), draws("uniform", "index", start=tuple(start))
    pairs = np.histogram2d(a, b, bins=32, range=((0.0, 1.0), (0.0, 1.0)))[0]
    assert stats.chisquare(pairs.ravel()).pvalue > FALSE_ALARM


def test_no_two_draws_of_a_million_are_equal() -> None:
    raw = _raw(1000, 50, 20)
    assert np.unique(raw).size == raw.size  # by chance: 3e-8


def test_every_bit_is_fair() -> None:
    raw = _raw(20_000, 5, 2)
    ones = ((raw[:, None] >> np.arange(64, dtype=np.uint64)) & np.uint64(1)).sum(axis=0)
    chi2 = float((((ones - raw.size / 2) ** 2) / (raw.size / 4)).sum())
    assert stats.chi2(64).sf(chi2) > FALSE_ALARM


def test_uniform_stays_below_one_and_has_53_bits() -> None:
    u = draws("uniform", "index")
    assert u.min() >= 0.0 and u.max() < 1.0
    assert np.all(u * 2.0**53 == np.floor(u * 2.0**53)) and np.any(u * 2.0**52 != np.floor(u * 2.0**52))


@pytest.mark.parametrize("along", ["index", "dimension"])
def test_normal_follows_the_normal_distribution_into_its_tails(along: str) -> None:
    z = draws("normal", along, 4 * N)
    edges = np.linspace(-4.0, 4.0, 161)
    counts = np.histogram(z, np.r_[-np.inf, edges, np.inf])[0]
    expected = np.diff(np.r_[0.0, stats.norm.cdf(edges), 1.0]) * z.size
    assert stats.chisquare(counts, expected).pvalue > FALSE_ALARM
    assert abs(z.mean()) < stats.norm.isf(FALSE_ALARM / 2) / np.sqrt(z.size)
    assert abs(z.var() - 1.0) < stats.norm.isf(FALSE_ALARM / 2) * np.sqrt(2.0 / z.size)


def test_normal_beyond_the_ziggurat_follows_the_conditional_tail() -> None:
    z = np.abs(draws("normal", "index", 20 * N))
    tail = z[z > 3.442619855899]
    assert stats.kstest(tail, lambda x: 1.0 - stats.norm.sf(x) / stats.norm.sf(3.442619855899)).pvalue > FALSE_ALARM
    assert stats.binomtest(tail.size, z.size, 2 * float(stats.norm.sf(3.442619855899))).pvalue > FALSE_ALARM


@pytest.mark.parametrize("draw", [random.uniform, random.normal])
def test_a_draw_is_a_pure_function_of_its_counters(draw: Callable[..., float]) -> None:
    assert draw(3, 10**12, 5, 2) == draw(3, 10**12, 5, 2)
    assert len({draw(*c) for c in ((3, 1, 5, 2), (4, 1, 5, 2), (3, 2, 5, 2), (3, 1, 6, 2), (3, 1, 5, 3))}) == 5


def test_a_negative_seed_is_as_good_as_any() -> None:
    assert 0.0 <= random.uniform(-1, 0, 0, 0) < 1.0
    assert random.uniform(-1, 0, 0, 0) != random.uniform(1, 0, 0, 0)
