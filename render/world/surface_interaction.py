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
from render.base.vectors import Vector, cross, divided, dot, length, minus, plus, scaled
from render.material.maps import POLISHED
from render.material.record import ALPHA_X, ALPHA_Y, COATED, KIND
from render.world.triangles import Surface, barycentric, bilinear, edges_of, scattering, to_local, uv_at

SMOOTH_NORMALS, ROUGHNESS_MAP, NORMAL_MAP, BUMP_MAP = 1, 2, 4, 8
"""Flags of `Surface.detail`."""
LEAST_COAT = 0.01
"""Least roughness of a coat, to which the values of a roughness map are clipped."""
LEAST_COSINE = 0.05
"""Least cosine of a shading normal with the facet's; one tilted further is clipped to this."""


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def interaction(
    surface: Surface, t: int, point: Vector, normal: Vector, choice: float, rgb: Float, alpha: Float, frame: Float
) -> int:
    """The material (index of a row of `surface.rows`) at a point of triangle t; normal: unit, on either side.

    -> rgb (3,) reflectance; alpha (2,) roughness, in place of the row's; frame (3, 3) axes, one a row, the last the
    shading normal, on the side of `normal`. choice: uniform in [0, 1), selects one of a blend's materials.
    """
    slot = scattering(surface, t, point[0], point[1], point[2], choice, rgb)
    row = surface.rows[slot]
    alpha[0], alpha[1] = row[ALPHA_X], row[ALPHA_Y]
    if surface.detail[slot] == 0:
        to_local(surface, t, row, normal[0], normal[1], normal[2], frame)
    else:
        detailed(surface, t, slot, point, normal, alpha, frame)
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
def detailed(surface: Surface, t: int, slot: int, point: Vector, normal: Vector, alpha: Float, frame: Float) -> None:
    """Roughness and frame of a material with shading normals or maps; arguments as of `interaction`."""
    flags = surface.detail[slot]
    u = v = 0.0
    if flags & (ROUGHNESS_MAP | NORMAL_MAP | BUMP_MAP):
        u, v = uv_at(surface, t, point)
    if flags & ROUGHNESS_MAP:
        mapped_roughness(surface, slot, u, v, np.empty(3), alpha)
    # the frame is built on the winding's normal and flipped to the given one's side at the end
    _, ab, ac = edges_of(surface, t)
    side = 1.0 if dot(normal, cross(ab, ac)) >= 0.0 else -1.0
    facet = scaled(side, normal)
    shading = smooth_normal(surface, t, point, facet) if flags & SMOOTH_NORMALS else facet
    if flags & (NORMAL_MAP | BUMP_MAP):
        shading = mapped_normal(surface, t, slot, u, v, shading)
    shading = scaled(side, bounded_tilt(shading, facet))
    to_local(surface, t, surface.rows[slot], shading[0], shading[1], shading[2], frame)


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def smooth_normal(surface: Surface, t: int, point: Vector, facet: Vector) -> Vector:
    """The normal interpolated between the corners of triangle t; the facet's where they cancel."""
    f, g = barycentric(surface, t, point)
    e, corner = 1.0 - f - g, surface.normals[t]
    s0 = e * corner[0, 0] + f * corner[1, 0] + g * corner[2, 0]
    s1 = e * corner[0, 1] + f * corner[1, 1] + g * corner[2, 1]
    s2 = e * corner[0, 2] + f * corner[1, 2] + g * corner[2, 2]
    size = length((s0, s1, s2))
    return divided((s0, s1, s2), size) if size > 0.0 else facet


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def uv_gradients(surface: Surface, t: int) -> tuple[Vector, Vector]:
    """Gradients of u and v on the facet of triangle t, 1/m."""
    _, ab, ac = edges_of(surface, t)
    uv = surface.uv
    bb, bc, cc = dot(ab, ab), dot(ab, ac), dot(ac, ac)
    det = bb * cc - bc * bc
    du1, du2 = uv[t, 1, 0] - uv[t, 0, 0], uv[t, 2, 0] - uv[t, 0, 0]
    dv1, dv2 = uv[t, 1, 1] - uv[t, 0, 1], uv[t, 2, 1] - uv[t, 0, 1]
    ub, uc = (cc * du1 - bc * du2) / det, (bb * du2 - bc * du1) / det
    vb, vc = (cc * dv1 - bc * dv2) / det, (bb * dv2 - bc * dv1) / det
    return plus(scaled(ub, ab), scaled(uc, ac)), plus(scaled(vb, ab), scaled(vc, ac))


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def mapped_normal(surface: Surface, t: int, slot: int, u: float, v: float, normal: Vector) -> Vector:
    """The unit normal, tilted by the material's normal map or bump map at (u, v)."""
    along_u, along_v = uv_gradients(surface, t)
    rgb = np.empty(3)
    if surface.detail[slot] & NORMAL_MAP:
        map_value(surface, slot, 3, u, v, rgb)
        tilt_x = (2.0 * rgb[0] - 1.0) * surface.relief[slot, 0]
        tilt_y = (2.0 * rgb[1] - 1.0) * surface.relief[slot, 1]
        out = max(2.0 * rgb[2] - 1.0, 1e-3)
        # the map's u and v run along dP/du and dP/dv, each perpendicular to the other's gradient
        x, y = cross(along_v, normal), cross(normal, along_u)
        mirrored = 1.0 if dot(x, along_u) >= 0.0 else -1.0
        if length(x) > 0.0 and length(y) > 0.0:
            tilt_x, tilt_y = mirrored * tilt_x / length(x), mirrored * tilt_y / length(y)
            normal = plus(plus(scaled(out, normal), scaled(tilt_x, x)), scaled(tilt_y, y))
    else:
        slope_u, slope_v = bump_slopes(surface, slot, u, v, rgb)
        normal = minus(normal, plus(scaled(slope_u, along_u), scaled(slope_v, along_v)))
    return divided(normal, length(normal))


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def bounded_tilt(shading: Vector, facet: Vector) -> Vector:
    """The shading normal, tilted from the facet's by no more than LEAST_COSINE allows, in the same direction."""
    cosine = dot(shading, facet)
    if not cosine < LEAST_COSINE:
        return shading
    aside = minus(shading, scaled(cosine, facet))
    size = length(aside)
    if size == 0.0:
        return facet
    lean = math.sqrt(1.0 - LEAST_COSINE * LEAST_COSINE) / size
    return plus(scaled(lean, aside), scaled(LEAST_COSINE, facet))
