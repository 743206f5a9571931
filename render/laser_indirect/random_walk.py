"""A random walk through a homogeneous medium: free flights, and scattering as Henyey and Greenstein (1941) say.

Flights and absorption are drawn as they happen, so a path's power never changes inside. The boundary is met as any
surface.
"""

from __future__ import annotations

import math

import numba
import numpy as np
from numpy.typing import NDArray

from render.laser_indirect.path_vertex import DVC, DVCM, MEDIUM, NUMBER
from render.material.bsdf import ANISOTROPY, EXTINCTION, SCATTERED
from render.sampling.random import uniform

Float = NDArray[np.float64]
Float32 = NDArray[np.float32]
Int = NDArray[np.int32]

MOST_STEPS = 4096
"""Scatterings between two meetings with the boundary; a path that needs more is ended: e^-41 of them at 0.99 albedo."""
WALK = 1000
"""First of the random dimensions that walks use."""


@numba.njit(nogil=True, cache=True, error_model="numpy")
def scatter_inside(
    walking: Int,
    distance: Float32,
    state: Float,
    rows: Float,
    seed: int,
    depth: int,
    step: int,
    origin: Float,
    direction: Float,
    triangle: Int,
) -> int:
    """One flight of each path in `walking` (n,): those that scatter before the boundary stay in it, in front.

    distance (n,): to the boundary along each path's ray. origin, direction are moved; a path that is absorbed gets
    triangle -1. Returns how many stay.
    """
    left = 0
    for w in range(walking.shape[0]):
        r = walking[w]
        state[r, DVCM] = state[r, DVC] = 0.0
        if triangle[r] < 0:
            continue
        row = rows[int(state[r, MEDIUM]) - 1]
        number, stream = int(state[r, NUMBER]), WALK + 4 * step
        flight = -math.log(1.0 - uniform(seed, number, depth, stream)) / row[EXTINCTION]
        if flight >= distance[w]:
            continue
        if uniform(seed, number, depth, stream + 1) >= row[SCATTERED] or step == MOST_STEPS - 1:
            triangle[r] = -1
            continue
        for axis in range(3):
            origin[r, axis] += flight * direction[r, axis]
        g = row[ANISOTROPY]
        r1 = uniform(seed, number, depth, stream + 2)
        if abs(g) < 1e-3:
            cosine = 1.0 - 2.0 * r1
        else:
            part = (1.0 - g * g) / (1.0 - g + 2.0 * g * r1)
            cosine = (1.0 + g * g - part * part) / (2.0 * g)
        sine = math.sqrt(max(0.0, 1.0 - cosine * cosine))
        phi = 2.0 * math.pi * uniform(seed, number, depth, stream + 3)
        turn(direction[r], sine * math.cos(phi), sine * math.sin(phi), cosine)
        walking[left] = r
        left += 1
    return left


@numba.njit(nogil=True, cache=True, error_model="numpy")
def turn(d: Float, x: float, y: float, z: float) -> None:
    """Give the unit vector d (3,) the direction (x, y, z) that it has in a frame about d (Duff et al. 2017)."""
    n0, n1, n2 = d[0], d[1], d[2]
    sign = 1.0 if n2 >= 0.0 else -1.0
    a = -1.0 / (sign + n2)
    b = n0 * n1 * a
    d[0] = x * (1.0 + sign * n0 * n0 * a) + y * b + z * n0
    d[1] = x * sign * b + y * (sign + n1 * n1 * a) + z * n1
    d[2] = -x * sign * n0 - y * n1 + z * n2
