"""Reflection by microfacets: the GGX distribution, Smith's masking, and sampling of visible normals.

wo, wi and the facets' normal h lie above the surface; `render.material.scattering` defines them.
"""

from __future__ import annotations

import math

import numba

from render.material.scattering import Direction, Microsurface


@numba.njit(nogil=True, cache=True, error_model="numpy")
def dot(a: Direction, b: Direction) -> float:
    """a . b"""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@numba.njit(nogil=True, cache=True, error_model="numpy")
def half_vector(wo: Direction, wi: Direction) -> Direction:
    """The normal of the facets that reflect wo to wi."""
    hx, hy, hz = wo[0] + wi[0], wo[1] + wi[1], wo[2] + wi[2]
    length = math.sqrt(hx * hx + hy * hy + hz * hz)
    return hx / length, hy / length, hz / length


@numba.njit(nogil=True, cache=True, error_model="numpy")
def reflect(wo: Direction, h: Direction) -> Direction:
    """The mirror direction wi of wo about the normal h."""
    cosine = dot(wo, h)
    return 2.0 * cosine * h[0] - wo[0], 2.0 * cosine * h[1] - wo[1], 2.0 * cosine * h[2] - wo[2]


@numba.njit(nogil=True, cache=True, error_model="numpy")
def ggx(m: Microsurface, h: Direction) -> float:
    """D(h), 1/sr (Walter et al. 2007, eq. 33; anisotropic: Heitz 2014, eq. 85)."""
    if h[2] <= 0.0:
        return 0.0
    e = (h[0] / m.alpha_x) ** 2 + (h[1] / m.alpha_y) ** 2 + h[2] * h[2]
    return 1.0 / (math.pi * m.alpha_x * m.alpha_y * e * e)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def smith_lambda(m: Microsurface, w: Direction) -> float:
    """Smith's Lambda (Heitz 2014, eq. 86); masking is 1 / (1 + Lambda)."""
    if w[2] == 0.0:
        return math.inf
    return 0.5 * (math.sqrt(1.0 + ((m.alpha_x * w[0]) ** 2 + (m.alpha_y * w[1]) ** 2) / (w[2] * w[2])) - 1.0)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def sample_visible_normal(m: Microsurface, wo: Direction, r1: float, r2: float) -> Direction:
    """A normal visible from wo, by spherical caps (Dupuy and Benyoub 2023)."""
    vx, vy, vz = m.alpha_x * wo[0], m.alpha_y * wo[1], wo[2]
    length = math.sqrt(vx * vx + vy * vy + vz * vz)
    vx, vy, vz = vx / length, vy / length, vz / length
    phi = 2.0 * math.pi * r1
    cz = (1.0 - r2) * (1.0 + vz) - vz
    sine = math.sqrt(max(0.0, 1.0 - cz * cz))
    hx, hy, hz = sine * math.cos(phi) + vx, sine * math.sin(phi) + vy, cz + vz
    hx, hy, hz = m.alpha_x * hx, m.alpha_y * hy, max(hz, 1e-12)
    length = math.sqrt(hx * hx + hy * hy + hz * hz)
    return hx / length, hy / length, hz / length


@numba.njit(nogil=True, cache=True, error_model="numpy")
def visible_normal_pdf(m: Microsurface, wo: Direction, h: Direction) -> float:
    """pdf of `sample_visible_normal`, 1/sr: G1 D max(0, wo . h) / z (Heitz 2014, eq. 16)."""
    cosine = dot(wo, h)
    if cosine <= 0.0:
        return 0.0
    return ggx(m, h) * cosine / (wo[2] * (1.0 + smith_lambda(m, wo)))


@numba.njit(nogil=True, cache=True, error_model="numpy")
def reflection(m: Microsurface, wo: Direction, wi: Direction) -> tuple[float, float]:
    """f, 1/sr, with a Fresnel reflectance of 1, and the cosine of wo with the facets' normal (Heitz 2014, eq. 99)."""
    h = half_vector(wo, wi)
    masking = 1.0 + smith_lambda(m, wo) + smith_lambda(m, wi)
    return ggx(m, h) / (4.0 * wo[2] * wi[2] * masking), dot(wo, h)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def reflection_pdf(m: Microsurface, wo: Direction, wi: Direction) -> float:
    """pdf of wi by reflection at a visible normal, 1/sr."""
    h = half_vector(wo, wi)
    cosine = dot(wo, h)
    return visible_normal_pdf(m, wo, h) / (4.0 * cosine) if cosine > 0.0 else 0.0


@numba.njit(nogil=True, cache=True, error_model="numpy")
def reflection_weight(m: Microsurface, wo: Direction, wi: Direction) -> float:
    """f cos / pdf with a Fresnel reflectance of 1: G2 / G1, height-correlated (Heitz 2018)."""
    lambda_o, lambda_i = smith_lambda(m, wo), smith_lambda(m, wi)
    return (1.0 + lambda_o) / (1.0 + lambda_o + lambda_i)
