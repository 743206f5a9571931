"""Reflectance at a point of a triangle, as a kernel: an object's constant colour or its texture."""

from __future__ import annotations

import math

import numba
import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]
Float32 = NDArray[np.float32]
Int = NDArray[np.int32]


@numba.njit(nogil=True, cache=True)
def reflectance(
    t: int,
    a: Float,
    ab0: float,
    ab1: float,
    ab2: float,
    ac0: float,
    ac1: float,
    ac2: float,
    p0: float,
    p1: float,
    p2: float,
    weights: Float,
    object_id: Int,
    uv: Float32,
    albedo: Float,
    textures: Float32,
    texture_shape: Int,
) -> float:
    """Albedo, weighted over R, G, B by `weights` (3,), at point p of triangle t with corner a and edges ab, ac."""
    item = object_id[t]
    if texture_shape[item, 1] == 0:
        return weights[0] * albedo[item, 0] + weights[1] * albedo[item, 1] + weights[2] * albedo[item, 2]
    q0, q1, q2 = p0 - a[0], p1 - a[1], p2 - a[2]
    bb, bc, cc = (
        ab0 * ab0 + ab1 * ab1 + ab2 * ab2,
        ab0 * ac0 + ab1 * ac1 + ab2 * ac2,
        ac0 * ac0 + ac1 * ac1 + ac2 * ac2,
    )
    qb, qc = q0 * ab0 + q1 * ab1 + q2 * ab2, q0 * ac0 + q1 * ac1 + q2 * ac2
    det = bb * cc - bc * bc
    f, g = (cc * qb - bc * qc) / det, (bb * qc - bc * qb) / det
    u = (1.0 - f - g) * uv[t, 0, 0] + f * uv[t, 1, 0] + g * uv[t, 2, 0]
    v = (1.0 - f - g) * uv[t, 0, 1] + f * uv[t, 1, 1] + g * uv[t, 2, 1]
    start, rows, columns = texture_shape[item, 0], texture_shape[item, 1], texture_shape[item, 2]
    # texel centres at half integers; v points up, rows point down; repeated outside [0, 1]
    x, y = (u - math.floor(u)) * columns - 0.5, (1.0 - (v - math.floor(v))) * rows - 0.5
    i, j = int(math.floor(x)), int(math.floor(y))
    fx, fy = x - i, y - j
    total = 0.0
    for dj in range(2):
        for di in range(2):
            texel = 3 * (start + (j + dj) % rows * columns + (i + di) % columns)
            weight = (fx if di else 1.0 - fx) * (fy if dj else 1.0 - fy)
            for band in range(3):
                if weights[band] != 0.0:
                    total += weight * weights[band] * textures[texel + band]
    return total
