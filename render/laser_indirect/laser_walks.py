"""Camera paths over mirrors and clear glass alone, and the laser's light where they end, by walks to the laser.

Behind a plate no shadow ray reaches the laser. But the laser is a point whose power in each direction is known, so that
the irradiance that comes over a chain of plane mirrors and faces of glass is known as well (`manifold_walk`),

    E(x)  =  P g(X) h(Y) T / |dF/dX x dF/dY|,

(X, Y) the slopes at which light leaves the laser to come to x, T what Fresnel's equations let through. A camera path is
divided where it meets clear glass, reflected and refracted, and no random number decides anything.
"""

from __future__ import annotations

import math

import numba
import numpy as np

from render.base.arrays import Bool, Float, Long
from render.base.borrowed import borrowed
from render.base.vectors import row_vector, vector
from render.laser.irradiance import fan_density, slope_density
from render.laser_indirect.chain_connections import Walks, add_shadow_rays
from render.laser_indirect.connections import LaserSampling, towards
from render.laser_indirect.manifold_walk import passed, walk
from render.laser_indirect.path_vertex import (
    MOST_FACETS,
    SPECULAR_CHAIN,
    PassContext,
    Records,
    cosine_to,
    eval_bsdf,
    is_specular,
    to_shading,
)
from render.laser_indirect.specular_chains import ChainIndex, cell_at
from render.world.triangles import Surface

AFTER_NONE, AFTER_SOME = 0, 1
"""Columns of what is found: the camera sees the lit surface itself, or over mirrors and glass."""


@numba.njit(nogil=True, cache=True, error_model="numpy")
def walk_to_laser(  # noqa: PLR0913
    first: int,
    vertices: Records,
    paths: Records,
    index: ChainIndex,
    surface: Surface,
    context: PassContext,
    laser: LaserSampling,
    counts: Long,
    walks: Walks,
) -> int:
    """Walk camera vertices first .. to the laser -> walks, whose `fan_bin` is a column of what is found.

    counts (2,): -> of solutions and shadow rays. Returns the first vertex that there was no room for.
    """
    vertices, paths, index, surface = borrowed(vertices), borrowed(paths), borrowed(index), borrowed(surface)
    context, laser, walks = borrowed(context), borrowed(laser), borrowed(walks)
    m = laser.T_world_laser
    origin = (m[0, 3], m[1, 3], m[2, 3])
    places, planes, rgb = np.empty((MOST_FACETS, 3)), np.empty((MOST_FACETS, 5)), np.empty(3)
    counts[:] = 0
    for r in range(first, vertices.shape[0]):
        v, path = vertices[r], paths[r]
        if is_specular(v, context.rows) or (path.after_specular and not context.kinds & SPECULAR_CHAIN):
            continue
        x, n = vector(v.p), vector(v.n)
        i = cell_at(index, x)
        if i < 0:
            continue
        start, stop = index.starts[i], index.starts[i + 1]
        if counts[0] + stop - start > walks.pixel.shape[0]:
            return r
        for j in range(start, stop):
            seen = index.seen[j]
            solution = walk(surface, seen, m, origin, x, n, planes)
            if not solution.found:
                continue
            density = slope_density(solution.slopes[0], laser.beam) * fan_density(solution.slopes[1], laser.beam)
            if density == 0.0:
                continue
            share = passed(surface, context.weights, seen, m, origin, solution.slopes, True, places, rgb)
            if share == 0.0:
                continue
            direction, _ = towards(v, row_vector(places, seen.count - 1))
            cosine, wi = cosine_to(v, direction), to_shading(v, direction)
            if cosine * wi[2] <= 0.0:
                continue
            light = laser.beam[0] * density * share / solution.spread
            contribution = path.throughput * eval_bsdf(v, context.rows, wi, vector(v.wo)) * light * abs(wi[2] / cosine)
            if contribution == 0.0:
                continue
            k = counts[0]
            walks.pixel[k], walks.contribution[k] = path.pixel, contribution
            walks.fan_bin[k] = AFTER_SOME if path.after_specular else AFTER_NONE
            add_shadow_rays(surface, seen, origin, places, v, context, counts, walks)
    return vertices.shape[0]


@numba.njit(nogil=True, cache=True, error_model="numpy")
def add_walks(walks: Walks, occluded: Bool, solutions: int, values: Float) -> int:
    """Add the solutions none of whose shadow rays (n,) is occluded to values (pixels, 2). Returns how many are no
    numbers, which are left out."""
    for ray in range(occluded.shape[0]):
        if occluded[ray]:
            walks.contribution[walks.owner[ray]] = 0.0
    invalid = 0
    for j in range(solutions):
        if 0.0 <= walks.contribution[j] < math.inf:
            values[walks.pixel[j], walks.fan_bin[j]] += walks.contribution[j]
        else:
            invalid += 1
    return invalid


@numba.njit(nogil=True, cache=True, error_model="numpy")
def mark_near(vertices: Records, paths: Records, rows: Float, index: ChainIndex, near: Bool) -> None:
    """Pixels (n,) of camera vertices that lie in a listed cell: near."""
    for r in range(vertices.shape[0]):
        v = vertices[r]
        if not is_specular(v, rows) and cell_at(index, vector(v.p)) >= 0:
            near[paths[r].pixel] = True
