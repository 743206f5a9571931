"""Exact Poisson samples for kernels: the photons and dark electrons that a pixel counts.

mean < 10     inversion by sequential search; a mean near zero is answered without an exponential
mean >= 10    transformed rejection, PTRS (Hoermann 1993, "The transformed rejection method for generating Poisson
              random variables", Insurance: Mathematics and Economics 12)
"""

from __future__ import annotations

import math

import numba

from render.random import uniform

SMALL_MEAN = 10.0
LARGEST_MEAN = 1e12
"""Means are cut here: a thousand times the largest full well, and still exact in float64."""


@numba.njit(nogil=True, cache=True, error_model="numpy")
def poisson(mean: float, seed: int, index: int, sample: int, dimension: int) -> float:
    """A count from the Poisson distribution. Takes the numbers of `dimension` and, by rejection, of those above it.

    A mean that is not positive (NaN included) gives 0.
    """
    if not mean > 0.0:
        return 0.0
    if mean < SMALL_MEAN:
        u = uniform(seed, index, sample, dimension)
        if u < 1.0 - mean:  # below exp(-mean), so the count is 0
            return 0.0
        return _by_inversion(mean, u)
    return _by_rejection(min(mean, LARGEST_MEAN), seed, index, sample, dimension)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _by_inversion(mean: float, u: float) -> float:
    """The smallest k whose distribution function exceeds u in [0, 1)."""
    term = math.exp(-mean)
    total, k = term, 0.0
    while u >= total and k < 100.0:  # rounding can keep the total below u; beyond 100 the rest is below 1e-60
        k += 1.0
        term *= mean / k
        total += term
    return k


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _by_rejection(mean: float, seed: int, index: int, sample: int, dimension: int) -> float:
    """Hoermann's PTRS, steps 0 to 3; two numbers a trial, about 1.1 trials."""
    b = 0.931 + 2.53 * math.sqrt(mean)
    a = -0.059 + 0.02483 * b
    v_r = 0.9277 - 3.6224 / (b - 2.0)
    trial = dimension
    while True:
        u = uniform(seed, index, sample, trial) - 0.5
        v = uniform(seed, index, sample, trial + 1)
        trial += 2
        us = 0.5 - abs(u)
        if us == 0.0:
            continue
        k = float(math.floor((2.0 * a / us + b) * u + mean + 0.43))
        if us >= 0.07 and v <= v_r:
            return k
        if k < 0.0 or v == 0.0 or (us < 0.013 and v > us):
            continue
        inverse_alpha = 1.1239 + 1.1328 / (b - 3.4)
        log_mean = math.log(mean)
        if math.log(v * inverse_alpha / (a / (us * us) + b)) <= k * log_mean - mean - math.lgamma(k + 1.0):
            return k
