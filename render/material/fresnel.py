"""Fresnel reflectance of unpolarised light at a smooth boundary."""

from __future__ import annotations

import math

import numba


@numba.njit(nogil=True, cache=True, error_model="numpy")
def fresnel_dielectric(cosine: float, eta: float) -> tuple[float, float]:
    """Reflectance, and cosine of the refracted ray (0: total internal reflection), for light that meets a boundary.

    cosine >= 0: of the angle of incidence; eta: refractive index beyond the boundary over that before it.
    """
    sine2 = (1.0 - cosine * cosine) / (eta * eta)
    if sine2 >= 1.0:
        return 1.0, 0.0
    beyond = math.sqrt(1.0 - sine2)
    s = (cosine - eta * beyond) / (cosine + eta * beyond)
    p = (eta * cosine - beyond) / (eta * cosine + beyond)
    return 0.5 * (s * s + p * p), beyond


@numba.njit(nogil=True, cache=True, error_model="numpy")
def fresnel_conductor(cosine: float, n: float, k: float) -> float:
    """Reflectance of a metal of index n + i k in air (Born and Wolf, Principles of Optics, 14.2)."""
    c2 = cosine * cosine
    s2 = 1.0 - c2
    a = n * n - k * k - s2
    root = math.sqrt(a * a + 4.0 * n * n * k * k)
    b = math.sqrt(max(0.5 * (root + a), 0.0))
    s = (root + c2 - 2.0 * b * cosine) / (root + c2 + 2.0 * b * cosine)
    p = (c2 * root + s2 * s2 - 2.0 * b * cosine * s2) / (c2 * root + s2 * s2 + 2.0 * b * cosine * s2)
    return 0.5 * s * (1.0 + p)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def diffuse_reflectance(eta: float) -> float:
    """Reflectance averaged over a cosine-weighted hemisphere, eta as in `fresnel_dielectric`."""
    total, n = 0.0, 256
    for i in range(n):
        # midpoints of s = sin^2: the weight 2 sin cos d(angle) is d s
        cosine = math.sqrt(1.0 - (i + 0.5) / n)
        reflected, _ = fresnel_dielectric(cosine, eta)
        total += reflected
    return total / n
