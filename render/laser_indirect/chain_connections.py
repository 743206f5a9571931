"""Connecting light vertices to the camera over chains of plane mirrors and clear glass, by manifold walks."""

from __future__ import annotations

import math
from typing import NamedTuple

import numba
import numpy as np

from render.base.arrays import Bool, Float, Float32, Int, Long
from render.base.borrowed import borrowed
from render.base.vectors import Vector, divided, dot, length, minus, row_vector, store_row, vector
from render.camera.distortion import tilt_matrix
from render.camera.lens import lens_point, lens_position
from render.laser_indirect.connection_buffer import BLOCK, PassBuffer
from render.laser_indirect.connections import CameraSampling, is_clear_light, towards
from render.laser_indirect.manifold_walk import passed, pixel_on_way, walk
from render.laser_indirect.path_vertex import (
    MOST_FACETS,
    SPECULAR_CHAIN,
    PassContext,
    Record,
    Records,
    cosine_to,
    eval_bsdf,
    is_specular,
    shading_normal_factor,
    to_shading,
)
from render.laser_indirect.specular_chains import ChainIndex, cell_at
from render.sampling.random import uniform
from render.world.triangles import Surface, off_surface, plane_of


class Walks(NamedTuple):
    """(n,) solutions, as of `Connections`; (m, 3) shadow rays from scene-centred origins, (m,) their
    length, and whose they are."""

    pixel: Int
    fan_bin: Int
    contribution: Float
    origin: Float32
    direction: Float32
    distance: Float32
    owner: Int


def empty_walks(n: int) -> Walks:
    """Room for n solutions."""
    rays = n * (MOST_FACETS + 1)
    ends = np.empty((rays, 3), np.float32), np.empty((rays, 3), np.float32), np.empty(rays, np.float32)
    pixel, fan_bin = np.empty(n, np.int32), np.empty(n, np.int32)
    return Walks(pixel, fan_bin, np.empty(n), *ends, np.empty(rays, np.int32))


@numba.njit(nogil=True, cache=True, error_model="numpy")
def add_shadow_rays(
    surface: Surface,
    chain: Record,
    origin: Vector,
    places: Float,
    v: Record,
    context: PassContext,
    counts: Long,
    walks: Walks,
) -> None:
    """Shadow rays of solution counts[0] from the lens, or the laser, over places on facets to vertex v; counts grow."""
    start, normal = origin, (0.0, 0.0, 0.0)
    for j in range(chain.count + 1):
        if j == chain.count:
            end, next_normal = vector(v.p), vector(v.n)
        else:
            _, _, _, n0, n1, n2 = plane_of(surface, abs(chain.facets[j]) - 1)
            end, next_normal = row_vector(places, j), (n0, n1, n2)
        way, epsilon = minus(end, start), context.ray_epsilon
        begin = off_surface(start, normal, epsilon if dot(normal, way) > 0.0 else -epsilon)
        stop = off_surface(end, next_normal, epsilon if dot(next_normal, way) < 0.0 else -epsilon)
        way = minus(stop, begin)
        distance, ray = length(way), counts[1]
        store_row(walks.origin, ray, minus(begin, vector(context.centre)))
        store_row(walks.direction, ray, divided(way, distance))
        walks.distance[ray], walks.owner[ray] = distance, counts[0]
        start, normal = end, next_normal
        counts[1] += 1
    counts[0] += 1


@numba.njit(nogil=True, cache=True, error_model="numpy")
def walk_to_camera(  # noqa: PLR0913
    first: int,
    vertices: Records,
    paths: Records,
    index: ChainIndex,
    surface: Surface,
    context: PassContext,
    sampling: CameraSampling,
    depth: int,
    counts: Long,
    walks: Walks,
) -> int:
    """Walk light vertices first .. that only merging could use to the camera -> walks, to be divided by light paths.

    counts (2,): -> of solutions and shadow rays. Returns the first vertex that there was no room for.
    """
    vertices, paths, index, surface = borrowed(vertices), borrowed(paths), borrowed(index), borrowed(surface)
    context, sampling, counts, walks = borrowed(context), borrowed(sampling), borrowed(counts), borrowed(walks)
    view = sampling.camera
    m, tilt = view.T_world_camera, tilt_matrix(view.distortion[12], view.distortion[13])
    distorted = bool(np.any(view.distortion))
    places, planes, rgb = np.empty((MOST_FACETS, 3)), np.empty((MOST_FACETS, 5)), np.empty(3)
    a = b = 0.0
    counts[:] = 0
    for r in range(first, vertices.shape[0]):
        v, path = vertices[r], paths[r]
        if not path.all_specular or not path.after_specular:
            continue
        if is_specular(v, context.rows):
            continue
        x, n = vector(v.p), vector(v.n)
        i = cell_at(index, x)
        if i < 0:
            continue
        if view.lens[0] > 0.0:
            r1, r2 = uniform(context.seed, path.index, depth, 8), uniform(context.seed, path.index, depth, 9)
            a, b = lens_point(view.lens[0], r1, r2)
        origin = lens_position(view, a, b)
        start, stop = index.starts[i], index.starts[i + 1]
        if counts[0] + stop - start > walks.pixel.shape[0]:
            return r
        for j in range(start, stop):
            seen = index.seen[j]
            solution = walk(surface, seen, m, origin, x, n, planes)
            if not solution.found:
                continue
            share = passed(surface, context.weights, seen, m, origin, solution.slopes, False, places, rgb)
            if share == 0.0:
                continue
            pixel, density = pixel_on_way(view, tilt, distorted, sampling.height, row_vector(places, 0), a, b)
            direction, _ = towards(v, row_vector(places, seen.count - 1))
            wi = to_shading(v, direction)
            if pixel < 0 or is_clear_light(path, sampling, pixel):
                continue
            if cosine_to(v, direction) * wi[2] <= 0.0:
                continue
            f = eval_bsdf(v, context.rows, vector(v.wo), wi) * shading_normal_factor(v)
            contribution = path.throughput * f * share * density / solution.spread
            if contribution == 0.0:
                continue
            k = counts[0]
            walks.pixel[k], walks.contribution[k], walks.fan_bin[k] = pixel, contribution, path.fan_bin
            add_shadow_rays(surface, seen, origin, places, v, context, counts, walks)
    return vertices.shape[0]


@numba.njit(nogil=True, cache=True, error_model="numpy")
def splat_walks(walks: Walks, occluded: Bool, solutions: int, scale: float, buffer: PassBuffer) -> None:
    """Splat the solutions none of whose shadow rays (n,) is occluded."""
    walks, occluded, buffer = borrowed(walks), borrowed(occluded), borrowed(buffer)
    for ray in range(occluded.shape[0]):
        if occluded[ray]:
            walks.contribution[walks.owner[ray]] = 0.0
    for j in range(solutions):
        contribution, pixel = walks.contribution[j] * scale, walks.pixel[j]
        if not 0.0 <= contribution < math.inf:
            buffer.invalid[0] += 1.0
        elif contribution > 0.0:
            buffer.image[pixel] += contribution
            buffer.touched[pixel // BLOCK] = True
            buffer.sums[SPECULAR_CHAIN] += contribution
            buffer.fan_moments[walks.fan_bin[j]] += contribution * contribution
