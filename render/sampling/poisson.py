"""Exact Poisson samples for kernels: the photons and dark electrons that a pixel counts.

mean < 10     inversion by sequential search; a mean near zero is answered without an exponential
mean >= 10    a normal rounded down, with a correction to the exact distribution: PD (Ahrens and Dieter 1982, "Computer
              generation of Poisson deviates from modified normal distributions", ACM TOMS 8)
"""

from __future__ import annotations

import math

import numba
import numpy as np

from render.sampling.random import normal, uniform

SMALL_MEAN = 10.0
LARGEST_MEAN = 1e12
"""Larger means are clipped to this: a thousand times the largest full well, and still exact in float64."""
_1_SQRT_2PI = 1.0 / math.sqrt(2.0 * math.pi)
_MOST_TERMS = 100
_INVERSE = np.append(0.0, 1.0 / np.arange(1.0, _MOST_TERMS + 1))


@numba.njit(nogil=True, cache=True, error_model="numpy")
def poisson(mean: float, seed: int, index: int, sample: int, dimension: int) -> float:
    """A count from the Poisson distribution; uses the random numbers of `dimension` and, by rejection, of those above.

    A mean that is not positive (NaN included) gives 0.
    """
    if not mean > 0.0:
        return 0.0
    if mean < SMALL_MEAN:
        u = uniform(seed, index, sample, dimension)
        if u < 1.0 - mean:  # below exp(-mean), so the count is 0
            return 0.0
        return _by_inversion(mean, u)
    return _by_normal(min(mean, LARGEST_MEAN), seed, index, sample, dimension)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _by_inversion(mean: float, u: float) -> float:
    """The smallest k whose distribution function exceeds u in [0, 1)."""
    term = math.exp(-mean)
    total, k = term, 0
    while u >= total and k < _MOST_TERMS:  # rounding can keep the total below u; beyond 100 the rest is below 1e-60
        k += 1
        term *= mean * _INVERSE[k]
        total += term
    return float(k)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _by_normal(mean: float, seed: int, index: int, sample: int, dimension: int) -> float:
    """Ahrens and Dieter's PD, steps N, I and S: one normal, and below the mean one uniform number suffice mostly."""
    sigma = math.sqrt(mean)
    deviate = mean + sigma * normal(seed, index, sample, dimension)
    k, u = math.floor(deviate), 0.0
    if deviate >= 0.0:
        if k >= math.floor(mean - 1.1484):
            return k
        u = uniform(seed, index, sample, dimension + 1)
        if 6.0 * mean * mean * u >= (mean - k) ** 3:
            return k
        normal_at_k, poisson_at_k = _probabilities(mean, sigma, k, 0.0)
        if (1.0 - u) * normal_at_k <= poisson_at_k:  # step Q
            return k
    return _from_difference(mean, sigma, seed, index, sample, dimension + 2)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _from_difference(mean: float, sigma: float, seed: int, index: int, sample: int, dimension: int) -> float:
    """Steps E and H: a count from the excess of the Poisson over the normal, by rejection from a double exponential."""
    while True:
        e = -math.log(1.0 - uniform(seed, index, sample, dimension))
        u = 2.0 * uniform(seed, index, sample, dimension + 1) - 1.0
        dimension += 2
        t = 1.8 + math.copysign(e, u)
        if t <= -0.6744:
            continue
        k = math.floor(mean + sigma * t)
        normal_at_k, poisson_at_k = _probabilities(mean, sigma, k, e)
        if 0.1069 / mean * sigma * abs(u) <= poisson_at_k - normal_at_k:
            return k


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _probabilities(mean: float, sigma: float, k: float, e: float) -> tuple[float, float]:
    """Procedure F: the probability of k in the rounded normal (by series) and in the Poisson, both times sigma exp(e).

    Stirling's series for k! from 10 on: within 1e-8.
    """
    b1 = 1.0 / (24.0 * mean)
    b2 = 0.3 * b1 * b1
    c3 = b1 * b2 / 7.0
    c2, c1, c0 = b2 - 15.0 * c3, b1 - 6.0 * b2 + 45.0 * c3, 1.0 - b1 + 3.0 * b2 - 15.0 * c3
    x = ((0.5 - (mean - k)) / sigma) ** 2
    of_normal = _1_SQRT_2PI * (((c3 * x + c2) * x + c1) * x + c0) * math.exp(e - 0.5 * x)
    if k < 10.0:
        of_poisson = math.exp(e - mean) * sigma
        for i in range(1, int(k) + 1):
            of_poisson *= mean / i
    else:
        v, small = (mean - k) / k, 1.0 / (12.0 * k)
        power = k * (math.log1p(v) - v) - (small - 4.8 * small**3)
        of_poisson = _1_SQRT_2PI * math.sqrt(mean / k) * math.exp(power + e)
    return of_normal, of_poisson
