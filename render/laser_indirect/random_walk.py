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
from render.material.medium import MOST_STEPS, turn
from render.sampling.random import uniform

Float = NDArray[np.float64]
Float32 = NDArray[np.float32]
Int = NDArray[np.int32]

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
