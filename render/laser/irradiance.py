"""The irradiance of a line laser at a point, as kernels; the formulas are in `render.laser.laser`.

`beam` is `LineLaser.packed()`: power, sigma0, focus, z_R (or dsigma/dz where sigma0 = 0), tan(fan / 2), profile, ...
"""

from __future__ import annotations

import math

import numba
import numpy as np
from numpy.typing import NDArray

from render.laser.laser import CONSTANT, GAUSSIAN

Array = NDArray[np.float64]

SQRT2 = math.sqrt(2.0)
INV_SQRT_2PI = 1.0 / math.sqrt(2.0 * math.pi)
SHEET_SIGMAS = 5.0
"""Sigmas from the sheet's middle at which it is cut off: 6e-7 of its power lies beyond."""

MOST_SIGMAS = 7.0
"""Sigmas beyond which no photon leaves the laser: 3e-12 of its power."""


@numba.njit(nogil=True, cache=True, error_model="numpy")
def sheet_sigma(z: float, beam: Array) -> tuple[float, float]:
    """sigma(z) and d sigma / dz, m."""
    if beam[1] == 0.0:
        return beam[3] * z, beam[3]
    t = (z - beam[2]) / beam[3]
    root = math.sqrt(1.0 + t * t)
    return beam[1] * root, beam[1] * t / (beam[3] * root)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def fan_density(y: float, beam: Array) -> float:
    """Fan profile h(Y), of unit area on |Y| <= tan(fan / 2)."""
    edge = beam[4]
    if abs(y) > edge:
        return 0.0
    if beam[5] == CONSTANT:
        # dOmega = (1 + Y^2)^(-3/2) dY; integrates to 2 sin(fan / 2) = 2 edge / sqrt(1 + edge^2)
        return math.sqrt((1.0 + edge * edge) / (1.0 + y * y)) / ((1.0 + y * y) * 2.0 * edge)
    if beam[5] == GAUSSIAN:
        sigma = 0.5 * edge
        return math.exp(-0.5 * (y / sigma) ** 2) * INV_SQRT_2PI / (sigma * math.erf(edge / (sigma * SQRT2)))
    return 0.5 / edge


@numba.njit(nogil=True, cache=True, error_model="numpy")
def slope_density(x: float, beam: Array) -> float:
    """Sheet profile g(X), of unit area over the slopes X = x / z, of a sheet without a waist."""
    q = x / beam[3]
    return math.exp(-0.5 * q * q) * INV_SQRT_2PI / beam[3] if abs(q) < MOST_SIGMAS else 0.0


@numba.njit(nogil=True, cache=True, error_model="numpy")
def irradiance(x: float, y: float, z: float, nx: float, ny: float, nz: float, beam: Array) -> float:
    """Irradiance (W/m^2) at a point of the laser frame on a surface of unit normal n, either side."""
    if z <= 0.0:
        return 0.0
    sigma, slope = sheet_sigma(z, beam)
    q = x / sigma
    g = math.exp(-0.5 * q * q) * INV_SQRT_2PI / sigma
    cosine = abs(nx * x * slope / sigma + ny * y / z + nz)
    return beam[0] * g * fan_density(y / z, beam) / z * cosine


@numba.njit(nogil=True, cache=True, error_model="numpy")
def irradiance_at(points: Array, normals: Array, beam: Array) -> Array:
    """(n, 3) points and unit normals in the laser frame -> (n,) irradiance, W/m^2, without occlusion."""
    out = np.empty(points.shape[0])
    for i in range(points.shape[0]):
        out[i] = irradiance(points[i, 0], points[i, 1], points[i, 2], normals[i, 0], normals[i, 1], normals[i, 2], beam)
    return out
