"""The Gaussian across the sheet, averaged over a cell of a pixel in closed form.

On a facet the sheet's coordinate q = x / sigma(z) is linear over a pixel, so along one side of a cell its mean is a
difference of error functions; along the other a few Gauss-Legendre nodes suffice. q is linear over the aperture as
well: the disc, projected on the gradient of q, has a semicircular density, for which Gauss-Chebyshev nodes are used.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numba

from render.base.arrays import Float
from render.laser.irradiance import INV_SQRT_2PI, SHEET_SIGMAS, SQRT2

Vector = tuple[float, float, float]

SERIES_LIMIT = 0.3
"""Sum of a cell's half-widths, in sigmas, below which a Taylor series replaces the error functions, to 1e-6."""


class SheetHit(NamedTuple):
    """Where a ray o + s d meets a facet in the sheet."""

    normal: Vector
    """Unit normal n of the facet, world frame."""
    direction: Vector
    """Direction d of the ray, of any length, world frame."""
    s: float
    """Ray parameter of the hit."""
    cosine: float
    """n . d."""
    q: float
    """Sheet's coordinate x / sigma at the hit."""
    sigma: float
    """Sigma of the sheet at the hit, m."""
    slope: float
    """d sigma / dz of the sheet at the hit."""


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def sheet_slope(xs: float, ys: float, m: Float, w: Float, hit: SheetHit) -> float:
    """Derivative of q = x / sigma(z) by a pixel coordinate along which the ray's (x, y) has the derivative (xs, ys).

    m, w: T_world_camera and T_laser_world, (4, 4).
    """
    n0, n1, n2 = hit.normal
    d0, d1, d2 = hit.direction
    e0, e1, e2 = (
        m[0, 0] * xs + m[0, 1] * ys,
        m[1, 0] * xs + m[1, 1] * ys,
        m[2, 0] * xs + m[2, 1] * ys,
    )
    f = (n0 * e0 + n1 * e1 + n2 * e2) / hit.cosine
    g0, g1, g2 = hit.s * (e0 - f * d0), hit.s * (e1 - f * d1), hit.s * (e2 - f * d2)
    dx = w[0, 0] * g0 + w[0, 1] * g1 + w[0, 2] * g2
    dz = w[2, 0] * g0 + w[2, 1] * g1 + w[2, 2] * g2
    return (dx - hit.q * hit.slope * dz) / hit.sigma


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _mean_gaussian(q: float, half: float) -> float:
    """Mean of the unit Gaussian over [q - half, q + half]; 0 beyond the sheet's cut-off."""
    half = abs(half)
    if abs(q) - half > SHEET_SIGMAS:
        return 0.0
    if half < 1e-3:
        return math.exp(-0.5 * q * q) * INV_SQRT_2PI
    # erfc on the positive side keeps the tail's digits
    p = abs(q)
    return 0.25 * (math.erfc((p - half) / SQRT2) - math.erfc((p + half) / SQRT2)) / half


@numba.njit(nogil=True, cache=True, error_model="numpy")
def mean_over(q: float, half_u: float, half_v: float) -> float:
    """Mean of the unit Gaussian over a cell: closed form along u, Gauss-Legendre along v; a series for small ones."""
    half_u, half_v = abs(half_u), abs(half_v)
    if half_u + half_v < SERIES_LIMIT:
        if abs(q) - half_u - half_v > SHEET_SIGMAS:
            return 0.0
        # moments of the cell times Hermite polynomials: Taylor, to 1e-6
        a, b, square = half_u * half_u, half_v * half_v, q * q
        second, fourth = (a + b) / 6.0, (a * a + b * b) / 120.0 + a * b / 36.0
        series = 1.0 + second * (square - 1.0) + fourth * ((square - 6.0) * square + 3.0)
        return math.exp(-0.5 * square) * INV_SQRT_2PI * max(series, 0.0)
    if half_v < 0.02:
        return _mean_gaussian(q, half_u)
    if half_v < 0.5:
        offset = half_v * 0.5773502691896257
        return 0.5 * (_mean_gaussian(q - offset, half_u) + _mean_gaussian(q + offset, half_u))
    nodes = 2 * int(min(16.0, math.ceil(2.0 * half_v)))
    total = 0.0
    for i in range(nodes):
        # two Gauss-Legendre nodes in each of nodes / 2 pieces
        centre = (2.0 * (i // 2) + 1.0) / (nodes // 2) - 1.0
        offset = (0.5773502691896257 if i % 2 else -0.5773502691896257) / (nodes // 2)
        total += _mean_gaussian(q + half_v * (centre + offset), half_u)
    return total / nodes


@numba.njit(nogil=True, cache=True, error_model="numpy")
def about_over(q: float, half_u: float, half_v: float) -> float:
    """`mean_over`, approximated: the cell as a Gaussian of its variance; to 1e-3 for half-widths of half a sigma."""
    if abs(q) - abs(half_u) - abs(half_v) > SHEET_SIGMAS:
        return 0.0
    variance = 1.0 + (half_u * half_u + half_v * half_v) / 3.0
    return math.exp(-0.5 * q * q / variance) * INV_SQRT_2PI / math.sqrt(variance)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def mean_over_aperture(q: float, half_u: float, half_v: float, reach: float) -> float:
    """Mean over a cell, as `mean_over`, and over an aperture from whose centre to rim q changes by at most `reach`."""
    reach = abs(reach)
    if reach < 0.02:
        return mean_over(q, half_u, half_v)
    if abs(q) - reach - abs(half_u) - abs(half_v) > SHEET_SIGMAS:
        return 0.0
    # to 1e-5 of the peak
    nodes = 3 + int(min(250.0, 2.5 * reach))
    angle = math.pi / (nodes + 1)
    step_cosine, step_sine = math.cos(angle), math.sin(angle)
    cosine, sine, total = 1.0, 0.0, 0.0
    for _ in range(nodes):
        cosine, sine = cosine * step_cosine - sine * step_sine, sine * step_cosine + cosine * step_sine
        total += sine * sine * mean_over(q + reach * cosine, half_u, half_v)
    return 2.0 * total / (nodes + 1)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def about_over_aperture(q: float, half_u: float, half_v: float, reach: float) -> float:
    """`mean_over_aperture`, approximated by one `mean_over`: the disc as a Gaussian of its variance, reach^2 / 4."""
    narrower = 1.0 / math.sqrt(1.0 + 0.25 * reach * reach)
    return narrower * mean_over(q * narrower, half_u * narrower, half_v * narrower)
