"""What kernels are given: the placed triangles with their reflectance, and the camera's view."""

from __future__ import annotations

import math
from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]
Float32 = NDArray[np.float32]
Int = NDArray[np.int32]


class Surface(NamedTuple):
    """The world's triangles; the arrays are described in `render.world.World`."""

    vertices: Float
    triangles: Int
    object_id: Int
    uv: Float32
    albedo: Float
    textures: Float32
    texture_shape: Int


class View(NamedTuple):
    """A camera in the world."""

    width: int
    intrinsics: Float
    """fx, fy, cx, cy, skew."""
    distortion: Float
    """(14,)."""
    folds: Float
    """(720,) `render.distortion.fold_radii`."""
    T_world_camera: Float


@numba.njit(nogil=True, cache=True, error_model="numpy")
def reflectance(surface: Surface, t: int, p0: float, p1: float, p2: float, rgb: Float) -> None:
    """Albedo at the point p of triangle t -> rgb (3,): the object's constant colour or its texture."""
    item = surface.object_id[t]
    if surface.texture_shape[item, 1] == 0:
        for band in range(3):
            rgb[band] = surface.albedo[item, band]
        return
    a, b, c = surface.triangles[t, 0], surface.triangles[t, 1], surface.triangles[t, 2]
    v, uv = surface.vertices, surface.uv
    ab0, ab1, ab2 = v[b, 0] - v[a, 0], v[b, 1] - v[a, 1], v[b, 2] - v[a, 2]
    ac0, ac1, ac2 = v[c, 0] - v[a, 0], v[c, 1] - v[a, 1], v[c, 2] - v[a, 2]
    q0, q1, q2 = p0 - v[a, 0], p1 - v[a, 1], p2 - v[a, 2]
    bb, bc, cc = (
        ab0 * ab0 + ab1 * ab1 + ab2 * ab2,
        ab0 * ac0 + ab1 * ac1 + ab2 * ac2,
        ac0 * ac0 + ac1 * ac1 + ac2 * ac2,
    )
    qb, qc = q0 * ab0 + q1 * ab1 + q2 * ab2, q0 * ac0 + q1 * ac1 + q2 * ac2
    det = bb * cc - bc * bc
    f, g = (cc * qb - bc * qc) / det, (bb * qc - bc * qb) / det
    s = (1.0 - f - g) * uv[t, 0, 0] + f * uv[t, 1, 0] + g * uv[t, 2, 0]
    r = (1.0 - f - g) * uv[t, 0, 1] + f * uv[t, 1, 1] + g * uv[t, 2, 1]
    start, rows, columns = surface.texture_shape[item]
    # texel centres at half integers; v points up, rows point down; repeated outside [0, 1]
    x, y = (s - math.floor(s)) * columns - 0.5, (1.0 - (r - math.floor(r))) * rows - 0.5
    i, j = int(math.floor(x)), int(math.floor(y))
    fx, fy = x - i, y - j
    rgb[0] = rgb[1] = rgb[2] = 0.0
    for dj in range(2):
        row = start + (j + dj) % rows * columns
        for di in range(2):
            texel = 3 * (row + (i + di) % columns)
            weight = (fx if di else 1.0 - fx) * (fy if dj else 1.0 - fy)
            for band in range(3):
                rgb[band] += weight * surface.textures[texel + band]
