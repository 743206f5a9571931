"""The GGX distribution of facet normals, anisotropic, and sampling of its visible normals.

Local frame: z is the surface's normal; directions point away from the surface and lie above it.
"""

from __future__ import annotations

import math

import numba


@numba.njit(nogil=True, cache=True, error_model="numpy")
def density(hx: float, hy: float, hz: float, ax: float, ay: float) -> float:
    """D(h), 1/sr (Walter et al. 2007, eq. 33; anisotropic: Heitz 2014, eq. 85)."""
    if hz <= 0.0:
        return 0.0
    e = (hx / ax) ** 2 + (hy / ay) ** 2 + hz * hz
    return 1.0 / (math.pi * ax * ay * e * e)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def smith_lambda(x: float, y: float, z: float, ax: float, ay: float) -> float:
    """Smith's Lambda (Heitz 2014, eq. 86); masking is 1 / (1 + Lambda)."""
    if z == 0.0:
        return math.inf
    return 0.5 * (math.sqrt(1.0 + ((ax * x) ** 2 + (ay * y) ** 2) / (z * z)) - 1.0)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def sample_normal(
    x: float, y: float, z: float, ax: float, ay: float, r1: float, r2: float
) -> tuple[float, float, float]:
    """A normal visible from (x, y, z), z > 0, by spherical caps (Dupuy and Benyoub 2023)."""
    vx, vy, vz = ax * x, ay * y, z
    length = math.sqrt(vx * vx + vy * vy + vz * vz)
    vx, vy, vz = vx / length, vy / length, vz / length
    phi = 2.0 * math.pi * r1
    cz = (1.0 - r2) * (1.0 + vz) - vz
    sine = math.sqrt(max(0.0, 1.0 - cz * cz))
    hx, hy, hz = sine * math.cos(phi) + vx, sine * math.sin(phi) + vy, cz + vz
    hx, hy, hz = ax * hx, ay * hy, max(hz, 1e-12)
    length = math.sqrt(hx * hx + hy * hy + hz * hz)
    return hx / length, hy / length, hz / length


@numba.njit(nogil=True, cache=True, error_model="numpy")
def visible_density(x: float, y: float, z: float, hx: float, hy: float, hz: float, ax: float, ay: float) -> float:
    """Density of `sample_normal`, 1/sr: G1 D max(0, v . h) / z (Heitz 2014, eq. 16)."""
    cosine = x * hx + y * hy + z * hz
    if cosine <= 0.0:
        return 0.0
    return density(hx, hy, hz, ax, ay) * cosine / (z * (1.0 + smith_lambda(x, y, z, ax, ay)))
