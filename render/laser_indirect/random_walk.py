"""A random walk through a homogeneous medium: free flights, and scattering as Henyey and Greenstein (1941) say.

Flights and absorption are drawn as they happen, so a path's throughput never changes inside. The boundary is met as any
surface.
"""

from __future__ import annotations

import math

import numba

from render.base.arrays import Float, Float32, Int
from render.base.borrowed import borrowed
from render.laser_indirect.path_vertex import PassContext, Records
from render.material.bsdf import ANISOTROPY, EXTINCTION, SCATTERED
from render.material.medium import MOST_STEPS, henyey_greenstein, turn
from render.sampling.random import uniform

FIRST_WALK_DIMENSION = 1000
"""First of the random dimensions that walks use, four a step."""


@numba.njit(nogil=True, cache=True, error_model="numpy")
def random_walk_step(  # noqa: PLR0913
    walking: Int,
    distance: Float32,
    paths: Records,
    context: PassContext,
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
    walking, distance, paths, context = borrowed(walking), borrowed(distance), borrowed(paths), borrowed(context)
    origin, direction, triangle = borrowed(origin), borrowed(direction), borrowed(triangle)
    staying = 0
    for w in range(walking.shape[0]):
        r = walking[w]
        path = paths[r]
        # no connection reaches through a medium
        path.dvcm = path.dvc = 0.0
        if triangle[r] < 0:
            continue
        row = context.rows[path.medium]
        first = FIRST_WALK_DIMENSION + 4 * step
        flight = -math.log(1.0 - uniform(context.seed, path.index, depth, first)) / row[EXTINCTION]
        if flight >= distance[w]:
            continue
        absorbed = uniform(context.seed, path.index, depth, first + 1) >= row[SCATTERED]
        if absorbed or step == MOST_STEPS - 1:
            triangle[r] = -1
            continue
        for axis in range(3):
            origin[r, axis] += flight * direction[r, axis]
        cosine = henyey_greenstein(row[ANISOTROPY], uniform(context.seed, path.index, depth, first + 2))
        sine = math.sqrt(max(0.0, 1.0 - cosine * cosine))
        phi = 2.0 * math.pi * uniform(context.seed, path.index, depth, first + 3)
        turn(direction[r], sine * math.cos(phi), sine * math.sin(phi), cosine)
        walking[staying] = r
        staying += 1
    return staying
