"""The surface interaction at a point: material, reflectance and roughness there, and the shading frame.

With smooth shading or a relief the frame is built on a shading normal: interpolated between vertices, or tilted by a
map. It must not leak light through the surface: directions above it must be above the facet as well (`light_side`). It
also makes scattering non-symmetric, for which Veach (1997), 5.3, gives the correction: with geometric cosines
everywhere, the value of a BSDF is  f |n_s . w| / |n_g . w|,  w the direction that the light comes from.

    path from the camera   weight of `sample` unchanged, as that has  f |n_s . i| / pdf
    path from a light      weight of `sample` times  light_side(o) / light_side(i)
    connection             f times light_side(the light's direction), once; both directions on one side of both normals
"""

from __future__ import annotations

import math

import numba
import numpy as np

from render.base.arrays import Float
from render.material.maps import POLISHED
from render.material.record import ALPHA_X, ALPHA_Y, COATED, KIND
from render.world.triangles import Surface, bilinear, scattering, to_local, uv_at

SMOOTH_NORMALS, ROUGHNESS_MAP, NORMAL_MAP, BUMP_MAP = 1, 2, 4, 8
"""Flags of `Surface.detail`."""
LEAST_COAT = 0.01
"""Least roughness of a coat, to which the values of a roughness map are clipped."""
LEAST_COSINE = 0.05
"""Least cosine of a shading normal with the facet's; one tilted further is clipped to this."""


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def interaction(  # noqa: PLR0913
    surface: Surface,
    t: int,
    p0: float,
    p1: float,
    p2: float,
    n0: float,
    n1: float,
    n2: float,
    choice: float,
    rgb: Float,
    alpha: Float,
    frame: Float,
) -> int:
    """The material (index of a row of `surface.rows`) at the point p of triangle t, n its unit normal on either side.

    -> rgb (3,) reflectance; alpha (2,) roughness, in place of the row's; frame (3, 3) axes, one a row, the last the
    shading normal, on n's side. choice: uniform in [0, 1), selects one of a blend's materials.
    """
    slot = scattering(surface, t, p0, p1, p2, choice, rgb)
    row = surface.rows[slot]
    alpha[0], alpha[1] = row[ALPHA_X], row[ALPHA_Y]
    if surface.detail[slot] == 0:
        to_local(surface, t, row, n0, n1, n2, frame)
    else:
        detailed(surface, t, slot, p0, p1, p2, n0, n1, n2, alpha, frame)
    return slot


@numba.njit(nogil=True, cache=True, error_model="numpy")
def light_side(shading: float, geometric: float) -> float:
    """|n_s . w| / |n_g . w| from a direction's two cosines; 0 where it is above one normal and below the other."""
    return shading / geometric if shading * geometric > 0.0 else 0.0


@numba.njit(nogil=True, cache=True, error_model="numpy")
def map_value(surface: Surface, slot: int, which: int, u: float, v: float, rgb: Float) -> None:
    """RGB of a material's map at (u, v) -> rgb (3,); which 0: roughness, 3: relief."""
    maps = surface.maps
    bilinear(surface.textures, maps[slot, which], maps[slot, which + 1], maps[slot, which + 2], u, v, rgb)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def mapped_roughness(surface: Surface, slot: int, u: float, v: float, rgb: Float, alpha: Float) -> None:
    """Roughness from its map -> alpha (2,); with a grain, only along it."""
    map_value(surface, slot, 0, u, v, rgb)
    row = surface.rows[slot]
    value = (rgb[0] + rgb[1] + rgb[2]) / 3.0
    if row[KIND] == COATED:
        value = max(value, LEAST_COAT)
    if row[ALPHA_X] != row[ALPHA_Y]:
        alpha[0] = max(value, POLISHED)
    else:
        alpha[0] = alpha[1] = value if value >= POLISHED else 0.0


@numba.njit(nogil=True, cache=True, error_model="numpy")
def bump_slopes(surface: Surface, slot: int, u: float, v: float, rgb: Float) -> tuple[float, float]:
    """Derivatives of the height, m, by u and v: central differences over a texel to each side."""
    du, dv = 1.0 / surface.maps[slot, 5], 1.0 / surface.maps[slot, 4]
    along = across = 0.0
    for sign in (1.0, -1.0):
        map_value(surface, slot, 3, u + sign * du, v, rgb)
        along += sign * (rgb[0] + rgb[1] + rgb[2])
        map_value(surface, slot, 3, u, v + sign * dv, rgb)
        across += sign * (rgb[0] + rgb[1] + rgb[2])
    height = surface.relief[slot, 0] / 6.0
    return height * along / du, height * across / dv


@numba.njit(nogil=True, cache=True, error_model="numpy")
def detailed(  # noqa: PLR0913, PLR0915
    surface: Surface,
    t: int,
    slot: int,
    p0: float,
    p1: float,
    p2: float,
    n0: float,
    n1: float,
    n2: float,
    alpha: Float,
    frame: Float,
) -> None:
    """Roughness and frame of a material with shading normals or maps; arguments as of `interaction`."""
    flags, row = surface.detail[slot], surface.rows[slot]
    v, uv, rgb = surface.vertices, surface.uv, np.empty(3)
    at_u = at_v = 0.0
    if flags & (ROUGHNESS_MAP | NORMAL_MAP | BUMP_MAP):
        at_u, at_v = uv_at(surface, t, p0, p1, p2)
    if flags & ROUGHNESS_MAP:
        mapped_roughness(surface, slot, at_u, at_v, rgb, alpha)
    a, b, c = surface.triangles[t, 0], surface.triangles[t, 1], surface.triangles[t, 2]
    ab0, ab1, ab2 = v[b, 0] - v[a, 0], v[b, 1] - v[a, 1], v[b, 2] - v[a, 2]
    ac0, ac1, ac2 = v[c, 0] - v[a, 0], v[c, 1] - v[a, 1], v[c, 2] - v[a, 2]
    q0, q1, q2 = p0 - v[a, 0], p1 - v[a, 1], p2 - v[a, 2]
    # the frame is built on the winding's normal and flipped to n's side at the end
    outward = n0 * (ab1 * ac2 - ab2 * ac1) + n1 * (ab2 * ac0 - ab0 * ac2) + n2 * (ab0 * ac1 - ab1 * ac0)
    side = 1.0 if outward >= 0.0 else -1.0
    g0, g1, g2 = side * n0, side * n1, side * n2
    s0, s1, s2 = g0, g1, g2
    bb, bc, cc = ab0 * ab0 + ab1 * ab1 + ab2 * ab2, ab0 * ac0 + ab1 * ac1 + ab2 * ac2, ac0 * ac0 + ac1 * ac1 + ac2 * ac2
    det = bb * cc - bc * bc
    if flags & SMOOTH_NORMALS:
        qb, qc = q0 * ab0 + q1 * ab1 + q2 * ab2, q0 * ac0 + q1 * ac1 + q2 * ac2
        f, g = (cc * qb - bc * qc) / det, (bb * qc - bc * qb) / det
        e, corner = 1.0 - f - g, surface.normals[t]
        s0 = e * corner[0, 0] + f * corner[1, 0] + g * corner[2, 0]
        s1 = e * corner[0, 1] + f * corner[1, 1] + g * corner[2, 1]
        s2 = e * corner[0, 2] + f * corner[1, 2] + g * corner[2, 2]
        length = math.sqrt(s0 * s0 + s1 * s1 + s2 * s2)
        if length > 0.0:
            s0, s1, s2 = s0 / length, s1 / length, s2 / length
        else:
            s0, s1, s2 = g0, g1, g2
    if flags & (NORMAL_MAP | BUMP_MAP):
        # gradients of u and v on the facet, 1/m
        du1, du2 = uv[t, 1, 0] - uv[t, 0, 0], uv[t, 2, 0] - uv[t, 0, 0]
        dv1, dv2 = uv[t, 1, 1] - uv[t, 0, 1], uv[t, 2, 1] - uv[t, 0, 1]
        ub, uc = (cc * du1 - bc * du2) / det, (bb * du2 - bc * du1) / det
        vb, vc = (cc * dv1 - bc * dv2) / det, (bb * dv2 - bc * dv1) / det
        u0, u1, u2 = ub * ab0 + uc * ac0, ub * ab1 + uc * ac1, ub * ab2 + uc * ac2
        v0, v1, v2 = vb * ab0 + vc * ac0, vb * ab1 + vc * ac1, vb * ab2 + vc * ac2
        if flags & NORMAL_MAP:
            map_value(surface, slot, 3, at_u, at_v, rgb)
            along, across = 2.0 * rgb[0] - 1.0, 2.0 * rgb[1] - 1.0
            along, across = along * surface.relief[slot, 0], across * surface.relief[slot, 1]
            out = max(2.0 * rgb[2] - 1.0, 1e-3)
            # the map's u and v run along dP/du and dP/dv, each perpendicular to the other's gradient
            x0, x1, x2 = v1 * s2 - v2 * s1, v2 * s0 - v0 * s2, v0 * s1 - v1 * s0
            y0, y1, y2 = s1 * u2 - s2 * u1, s2 * u0 - s0 * u2, s0 * u1 - s1 * u0
            turned = 1.0 if x0 * u0 + x1 * u1 + x2 * u2 >= 0.0 else -1.0
            lx, ly = math.sqrt(x0 * x0 + x1 * x1 + x2 * x2), math.sqrt(y0 * y0 + y1 * y1 + y2 * y2)
            if lx > 0.0 and ly > 0.0:
                along, across = turned * along / lx, turned * across / ly
                s0 = out * s0 + along * x0 + across * y0
                s1 = out * s1 + along * x1 + across * y1
                s2 = out * s2 + along * x2 + across * y2
        else:
            slope_u, slope_v = bump_slopes(surface, slot, at_u, at_v, rgb)
            s0 -= slope_u * u0 + slope_v * v0
            s1 -= slope_u * u1 + slope_v * v1
            s2 -= slope_u * u2 + slope_v * v2
        length = math.sqrt(s0 * s0 + s1 * s1 + s2 * s2)
        s0, s1, s2 = s0 / length, s1 / length, s2 / length
    cosine = s0 * g0 + s1 * g1 + s2 * g2
    if cosine < LEAST_COSINE:
        # keep the direction of the tilt
        s0, s1, s2 = s0 - cosine * g0, s1 - cosine * g1, s2 - cosine * g2
        length = math.sqrt(s0 * s0 + s1 * s1 + s2 * s2)
        lean = math.sqrt(1.0 - LEAST_COSINE * LEAST_COSINE) / length if length > 0.0 else 0.0
        s0, s1, s2 = lean * s0 + LEAST_COSINE * g0, lean * s1 + LEAST_COSINE * g1, lean * s2 + LEAST_COSINE * g2
        if length == 0.0:
            s0, s1, s2 = g0, g1, g2
    to_local(surface, t, row, side * s0, side * s1, side * s2, frame)
