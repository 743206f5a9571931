"""The placed triangles and materials as kernels read them: planes, UV, textures and local frames at a point."""

from __future__ import annotations

import math
from typing import NamedTuple

import numba
import numpy as np

from render.base.arrays import Float, Float32, Int
from render.base.vectors import Vector, along, dot, minus, vector
from render.material.record import ALPHA_X, ALPHA_Y, EMITTER, KIND, LAMBERTIAN, SUBSURFACE


class Surface(NamedTuple):
    """The world's triangles and materials; the arrays are described in `render.world.world.World`."""

    vertices: Float
    triangles: Int
    object_id: Int
    uv: Float32
    albedo: Float
    textures: Float32
    texture_shape: Int
    rows: Float
    second: Int
    mask_shape: Int
    normals: Float32
    detail: Int
    maps: Int
    relief: Float


def has_gloss(surface: Surface) -> bool:
    """Some material is not Lambertian, or has a shading normal that differs from its facet's."""
    plain = (surface.rows[:, KIND] == LAMBERTIAN) | (surface.rows[:, KIND] == EMITTER)
    return not bool(np.all(plain & (surface.detail == 0)))


def has_medium(surface: Surface) -> bool:
    """Some object holds a scattering medium."""
    return bool(np.any(surface.rows[:, KIND] == SUBSURFACE))


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def facet_of(surface: Surface, t: int) -> tuple[float, float, float, float, float, float]:
    """A corner of triangle t, and its normal by the winding, of twice its area."""
    return facet(surface.vertices, surface.triangles, t)


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def facet(vertices: Float, triangles: Int, t: int) -> tuple[float, float, float, float, float, float]:
    """As `facet_of`, from the arrays, which cost less than a named tuple of arrays where rays are many."""
    ia, ib, ic = triangles[t, 0], triangles[t, 1], triangles[t, 2]
    a0, a1, a2 = vertices[ia, 0], vertices[ia, 1], vertices[ia, 2]
    ab0, ab1, ab2 = vertices[ib, 0] - a0, vertices[ib, 1] - a1, vertices[ib, 2] - a2
    ac0, ac1, ac2 = vertices[ic, 0] - a0, vertices[ic, 1] - a1, vertices[ic, 2] - a2
    return a0, a1, a2, ab1 * ac2 - ab2 * ac1, ab2 * ac0 - ab0 * ac2, ab0 * ac1 - ab1 * ac0


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def plane_of(surface: Surface, t: int) -> tuple[float, float, float, float, float, float]:
    """A corner of triangle t, and its unit normal by the winding; NaN where it has no area."""
    a0, a1, a2, n0, n1, n2 = facet_of(surface, t)
    length = math.sqrt(n0 * n0 + n1 * n1 + n2 * n2)
    return a0, a1, a2, n0 / length, n1 / length, n2 / length


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def off_surface(p: Vector, n: Vector, side: float) -> Vector:
    """The point p moved by `side`, m, along the normal n: origin of a ray that must not hit its own surface."""
    return along(p, side, n)


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def reflectance(surface: Surface, t: int, p0: float, p1: float, p2: float, rgb: Float) -> None:
    """Albedo at the point p of triangle t -> rgb (3,): the object's constant colour or its texture."""
    slot_reflectance(surface, surface.object_id[t], t, p0, p1, p2, rgb)


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def scattering(surface: Surface, t: int, p0: float, p1: float, p2: float, choice: float, rgb: Float) -> int:
    """The material (a row of `surface.rows`) at the point p of triangle t, and its reflectance -> rgb (3,).

    A blend is one of its two materials, the second with the mask's value as its probability; `choice` is uniform in
    [0, 1).
    """
    slot = surface.object_id[t]
    # one inlined lookup serves mask and albedo: a second would cost more than the lookup itself
    masked = surface.second[slot] >= 0
    while True:
        shape = surface.mask_shape if masked else surface.texture_shape
        start, rows, columns = shape[slot, 0], shape[slot, 1], shape[slot, 2]
        if rows > 0:
            lookup(surface, (start, rows, columns), t, (p0, p1, p2), rgb)
        else:
            for band in range(3):
                rgb[band] = surface.albedo[slot, band]
        if not masked:
            return slot
        if choice < rgb[0]:
            slot = surface.second[slot]
        masked = False


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def slot_reflectance(surface: Surface, slot: int, t: int, p0: float, p1: float, p2: float, rgb: Float) -> None:
    """Reflectance of one material at the point p of triangle t -> rgb (3,)."""
    if surface.texture_shape[slot, 1] == 0:
        for band in range(3):
            rgb[band] = surface.albedo[slot, band]
        return
    shape = surface.texture_shape
    lookup(surface, (shape[slot, 0], shape[slot, 1], shape[slot, 2]), t, (p0, p1, p2), rgb)


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def to_local(surface: Surface, t: int, row: Float, n0: float, n1: float, n2: float, frame: Float) -> None:
    """Orthonormal axes (3, 3), one a row, z the normal n; x follows the texture's u where the material has a grain."""
    x0 = x1 = x2 = 0.0
    if row[ALPHA_X] != row[ALPHA_Y] and surface.uv.shape[0] > 0:
        a, b, c = surface.triangles[t, 0], surface.triangles[t, 1], surface.triangles[t, 2]
        v, uv = surface.vertices, surface.uv
        # dP/du from the two edges
        r1, r2 = uv[t, 1, 1] - uv[t, 0, 1], uv[t, 2, 1] - uv[t, 0, 1]
        x0 = r2 * (v[b, 0] - v[a, 0]) - r1 * (v[c, 0] - v[a, 0])
        x1 = r2 * (v[b, 1] - v[a, 1]) - r1 * (v[c, 1] - v[a, 1])
        x2 = r2 * (v[b, 2] - v[a, 2]) - r1 * (v[c, 2] - v[a, 2])
        along = x0 * n0 + x1 * n1 + x2 * n2
        x0, x1, x2 = x0 - along * n0, x1 - along * n1, x2 - along * n2
    length = math.sqrt(x0 * x0 + x1 * x1 + x2 * x2)
    if length > 0.0:
        x0, x1, x2 = x0 / length, x1 / length, x2 / length
    else:
        # Duff et al. 2017
        sign = 1.0 if n2 >= 0.0 else -1.0
        k = -1.0 / (sign + n2)
        x0, x1, x2 = 1.0 + sign * n0 * n0 * k, sign * n0 * n1 * k, -sign * n0
    frame[0, 0], frame[0, 1], frame[0, 2] = x0, x1, x2
    frame[1, 0], frame[1, 1], frame[1, 2] = n1 * x2 - n2 * x1, n2 * x0 - n0 * x2, n0 * x1 - n1 * x0
    frame[2, 0], frame[2, 1], frame[2, 2] = n0, n1, n2


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def to_world(frame: Float, local: Vector) -> Vector:
    """A local direction in the world."""
    x, y, z = local
    return (
        x * frame[0, 0] + y * frame[1, 0] + z * frame[2, 0],
        x * frame[0, 1] + y * frame[1, 1] + z * frame[2, 1],
        x * frame[0, 2] + y * frame[1, 2] + z * frame[2, 2],
    )


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def lookup(surface: Surface, shape: tuple[int, int, int], t: int, point: Vector, rgb: Float) -> None:
    """Bilinear value -> rgb (3,) of a texture, its first texel, rows and columns given, at the point of triangle t."""
    s, r = uv_at(surface, t, point)
    bilinear(surface.textures, shape[0], shape[1], shape[2], s, r, rgb)


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def edges_of(surface: Surface, t: int) -> tuple[Vector, Vector, Vector]:
    """The first corner of triangle t, and the edges from there to the second and to the third."""
    triangles, vertices = surface.triangles, surface.vertices
    a = vector(vertices[triangles[t, 0]])
    return a, minus(vector(vertices[triangles[t, 1]]), a), minus(vector(vertices[triangles[t, 2]]), a)


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def barycentric(surface: Surface, t: int, point: Vector) -> tuple[float, float]:
    """How much of the second and of the third corner of triangle t there is in a point of it."""
    a, ab, ac = edges_of(surface, t)
    q = minus(point, a)
    bb, bc, cc = dot(ab, ab), dot(ab, ac), dot(ac, ac)
    qb, qc = dot(q, ab), dot(q, ac)
    det = bb * cc - bc * bc
    return (cc * qb - bc * qc) / det, (bb * qc - bc * qb) / det


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def uv_at(surface: Surface, t: int, point: Vector) -> tuple[float, float]:
    """UV of a point of triangle t."""
    f, g = barycentric(surface, t, point)
    uv = surface.uv
    s = (1.0 - f - g) * uv[t, 0, 0] + f * uv[t, 1, 0] + g * uv[t, 2, 0]
    r = (1.0 - f - g) * uv[t, 0, 1] + f * uv[t, 1, 1] + g * uv[t, 2, 1]
    return s, r


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def bilinear(textures: Float32, start: int, rows: int, columns: int, s: float, r: float, rgb: Float) -> None:
    """Value -> rgb (3,) of the texture of rows x columns from `start`, at the UV (s, r)."""
    # texel centres at half integers; v points up, rows point down; repeated outside [0, 1]
    x, y = (s - math.floor(s)) * columns - 0.5, (1.0 - (r - math.floor(r))) * rows - 0.5
    i, j = int(math.floor(x)), int(math.floor(y))
    fx, fy = x - i, y - j
    rgb[0] = rgb[1] = rgb[2] = 0.0
    for dj in range(2):
        # wrap by comparison: a remainder costs more than the rest of the lookup
        row = j + dj
        row = row + rows if row < 0 else (row - rows if row >= rows else row)
        for di in range(2):
            column = i + di
            column = column + columns if column < 0 else (column - columns if column >= columns else column)
            texel = 3 * (start + row * columns + column)
            weight = (fx if di else 1.0 - fx) * (fy if dj else 1.0 - fy)
            for band in range(3):
                rgb[band] += weight * textures[texel + band]
