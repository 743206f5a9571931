"""The Gaussian line profile on a row of pixels, with its derivatives: integrated over each pixel or at its centre."""

from __future__ import annotations

import math

from numba import njit

from analysis.line.methods.seed_loop import Array

POSITION, ELECTRONS, FLOOR, VARIANCE = range(4)
"""Rows of the pixels (4, n) of a fit: px, e-, e-^2 that does not come from the signal, e-^2."""
ROOT_HALF = math.sqrt(0.5)
ROOT_HALF_PI = math.sqrt(0.5 * math.pi)


@njit(nogil=True, cache=True, error_model="numpy")
def profile(x: Array, n: int, centre: float, sigma: float, integrated: bool, out: Array) -> None:
    """x (n,) ascending pixels -> out (3, n): unit-amplitude profile g, dg/dcentre, dg/dsigma.

    Integrated: g = s sqrt(pi/2) [erf(z+/sqrt2) - erf(z-/sqrt2)], z+- = (x +- 1/2 - c)/s (Winick, JOSA A 3, 1986).
    """
    if not integrated:
        for i in range(n):
            z = (x[i] - centre) / sigma
            g = math.exp(-0.5 * z * z)
            out[0, i] = g
            out[1, i] = g * z / sigma
            out[2, i] = g * z * z / sigma
        return
    last, erf_right, exp_right, z_right = -1e300, 0.0, 0.0, 0.0
    for i in range(n):
        if x[i] - last == 1.0:  # neighbours share an edge
            z_left, erf_left, exp_left = z_right, erf_right, exp_right
        else:
            z_left = (x[i] - 0.5 - centre) / sigma
            erf_left, exp_left = math.erf(z_left * ROOT_HALF), math.exp(-0.5 * z_left * z_left)
        z_right = (x[i] + 0.5 - centre) / sigma
        erf_right, exp_right = math.erf(z_right * ROOT_HALF), math.exp(-0.5 * z_right * z_right)
        unit = ROOT_HALF_PI * (erf_right - erf_left)
        out[0, i] = sigma * unit
        out[1, i] = exp_left - exp_right
        out[2, i] = unit - (z_right * exp_right - z_left * exp_left)
        last = x[i]


@njit(nogil=True, cache=True, error_model="numpy")
def linear_variance(weight: Array, variance: Array, x: Array, n: int, correlation: Array) -> float:
    """Variance of sum(weight * pixel) over (n,) pixels; their covariance at distance d is correlation[d] * variance.

    correlation (m,): [1] for a raw image; smoothing spreads it over more distances.
    """
    total = 0.0
    for i in range(n):
        total += correlation[0] * weight[i] * weight[i] * variance[i]
        for j in range(i + 1, n):
            distance = int(x[j] - x[i])
            if distance >= correlation.shape[0]:
                break
            half_way = 0.5 * (variance[(i + j) // 2] + variance[(i + j + 1) // 2])
            total += 2.0 * correlation[distance] * weight[i] * weight[j] * half_way
    return total
