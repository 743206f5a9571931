"""Connecting a camera vertex to one of many light vertices by resampled importance sampling (RIS).

Of M candidates x_i, drawn with probability p(x_i) along the lit curve, one is chosen in proportion to its weight
W_i = g(x_i) / (M p(x_i)), g the target function, and contributes sum(W_i) / g(x) times what it brings (Talbot et al.
2005). A single shadow ray tests it for all. The letters are those of `render/README.md`, section 4.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numba
import numpy as np

from render.base.arrays import Float, Long
from render.base.borrowed import borrowed
from render.base.vectors import Vector, divided, dot, length, minus, negative, store_row, vector
from render.laser_indirect.connection_buffer import Connections, PassBuffer
from render.laser_indirect.connections import towards
from render.laser_indirect.guiding import BINS, TILE, Guide
from render.laser_indirect.path_vertex import (
    PassContext,
    Record,
    Records,
    bsdf_pdf,
    cosine_to,
    eval_bsdf,
    interior_beyond,
    is_specular,
    is_turbid,
    shading_normal_factor,
    to_shading,
)
from render.sampling.random import uniform
from render.world.triangles import off_surface

MOST_CANDIDATES = 32
GOLDEN_RATIO = 0.6180339887498949


class LightVertices(NamedTuple):
    """Light vertices to connect to, and how a camera vertex chooses among them."""

    vertices: Records
    paths: Records
    ordered: bool
    """They ascend along the fan: those of the first surface. Only these are guided."""
    light_paths: int
    """Traced for them."""
    candidates: tuple[int, int]
    """Weighed against each other at the first surface that the camera sees, and at those after it."""
    dimension: int
    """First of two random dimensions."""


@numba.njit(nogil=True, cache=True, error_model="numpy")
def connect_by_ris(
    vertices: Records,
    paths: Records,
    light: LightVertices,
    guide: Guide,
    depth: int,
    context: PassContext,
    buffer: PassBuffer,
    connections: Connections,
) -> int:
    """Connect each camera vertex to one of the light vertices -> connections. Returns their number.

    Candidates are stratified along the lit curve, and denser where the guide expects most. The squared target weights
    that they meet go to `buffer.wave_moments`, for the guide of the passes to come.
    """
    vertices, paths, light, guide = borrowed(vertices), borrowed(paths), borrowed(light), borrowed(guide)
    context, buffer, connections = borrowed(context), borrowed(buffer), borrowed(connections)
    room = np.empty(MOST_CANDIDATES), np.empty(MOST_CANDIDATES, np.int64)
    weights, chosen = borrowed(room)
    count = light.vertices.shape[0]
    candidates = light.candidates[0] if depth == 0 else light.candidates[1]
    guided = light.ordered and depth == 0 and count >= BINS
    n = 0
    if count == 0:
        return 0
    for r in range(vertices.shape[0]):
        v, path = vertices[r], paths[r]
        if is_specular(v, context.rows):
            continue
        guide_row = -1
        if guided:
            guide_row = guide.row[path.pixel // guide.width // TILE, path.pixel % guide.width // TILE]
        shift = uniform(context.seed, path.index, depth, light.dimension)
        total = weigh_candidates(
            v, path, light, guide, guide_row, shift, context.rows, weights[:candidates], chosen, buffer.wave_moments
        )
        if total <= 0.0:
            continue
        remaining = uniform(context.seed, path.index, depth, light.dimension + 1) * total
        k = 0
        while k < candidates - 1 and remaining >= weights[k]:
            remaining -= weights[k]
            k += 1
        if weights[k] <= 0.0:
            continue
        w, w_path = light.vertices[chosen[k]], light.paths[chosen[k]]
        connections.pixel[n], connections.fan_bin[n] = path.pixel, w_path.fan_bin
        connections.kind[n] = path.kind | w_path.kind
        connections.reachable_from_camera[n] = True
        resampled = total / light.light_paths
        connections.contribution[n] = mis_weighted(v, path, w, w_path, resampled, context.rows)
        set_shadow_ray_between(connections, n, v, w, context)
        direction, _ = towards(v, vector(w.p))
        connections.interior[n] = interior_beyond(v, path, context.rows, cosine_to(v, direction))
        n += 1
    # held to here
    room[0][0] = 0.0
    return n


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def weigh_candidates(  # noqa: PLR0913
    v: Record,
    path: Record,
    light: LightVertices,
    guide: Guide,
    guide_row: int,
    shift: float,
    rows: Float,
    weights: Float,
    chosen: Long,
    moments: Float,
) -> float:
    """Draw candidates for camera vertex v -> chosen, weights (M,); returns the sum of the weights.

    guide_row: of the guide, -1 for candidates uniform along the curve; shift: in [0, 1), of their first stratum.
    """
    count, candidates = light.vertices.shape[0], weights.shape[0]
    total, bin_ = 0.0, 0
    for k in range(candidates):
        place = (k + shift) / candidates
        shift += GOLDEN_RATIO
        shift -= math.floor(shift)
        first, last, probability = 0, count, 1.0
        if guide_row >= 0:
            # the places ascend
            while bin_ < BINS - 1 and guide.cumulative[guide_row, bin_ + 1] <= place:
                bin_ += 1
            probability = guide.cumulative[guide_row, bin_ + 1] - guide.cumulative[guide_row, bin_]
            place = (place - guide.cumulative[guide_row, bin_]) / probability
            first, last = bin_ * count // BINS, (bin_ + 1) * count // BINS
        j = min(first + int(place * (last - first)), last - 1)
        density = candidates * probability / (last - first)
        chosen[k] = j
        weights[k] = target_function(v, path, light.vertices[j], light.paths[j], rows) / density
        total += weights[k]
        if guide_row >= 0 and weights[k] > 0.0:
            moments[guide_row, bin_] += weights[k] * weights[k] * density
    return total


class Edge(NamedTuple):
    """The segment from a camera vertex v to a light vertex w."""

    squared_distance: float
    cosine_v: float
    """Of its direction with v's geometric normal."""
    cosine_w: float
    """Of the opposite direction with w's."""
    at_v: Vector
    """Its direction in v's shading frame."""
    at_w: Vector
    """The opposite direction in w's."""


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def edge_between(v: Record, w: Record) -> Edge:
    """The segment from v to w."""
    to = minus(vector(w.p), vector(v.p))
    square = dot(to, to)
    direction = divided(to, math.sqrt(square))
    back = negative(direction)
    return Edge(
        square, cosine_to(v, direction), -cosine_to(w, direction), to_shading(v, direction), to_shading(w, back)
    )


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def target_function(v: Record, path: Record, w: Record, w_path: Record, rows: Float) -> float:
    """About what a connection of camera vertex v to light vertex w contributes, MIS-weighted, if it is not occluded.

    Near a corner the geometry term is bounded by what the other techniques take of it (`corner_bound`).
    """
    edge = edge_between(v, w)
    if edge.cosine_v * edge.at_v[2] <= 0.0 or edge.cosine_w * edge.at_w[2] <= 0.0:
        return 0.0
    # no straight way through a medium
    if is_turbid(v, edge.at_v[2]) or is_turbid(w, edge.at_w[2]):
        return 0.0
    value = eval_bsdf(v, rows, edge.at_v, vector(v.wo))
    if value <= 0.0:
        return 0.0
    value *= eval_bsdf(w, rows, vector(w.wo), edge.at_w)
    cosines = abs(edge.at_v[2] * edge.cosine_w)
    return w_path.throughput * value * cosines / (edge.squared_distance + corner_bound(path, w_path, edge))


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def corner_bound(path: Record, w_path: Record, edge: Edge) -> float:
    """m^2 added to the squared distance: what the other techniques take as if both surfaces were diffuse."""
    return (w_path.dvcm * abs(edge.cosine_w) + path.dvcm * abs(edge.cosine_v)) / math.pi


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def mis_weighted(v: Record, path: Record, w: Record, w_path: Record, resampled: float, rows: Float) -> float:
    """Contribution of the connection of v to w; resampled: sum of the candidates' weights, for each light path."""
    edge = edge_between(v, w)
    square, v_wo, w_wo = edge.squared_distance, vector(v.wo), vector(w.wo)
    # the target function over the true geometry term
    contribution = resampled * (square + corner_bound(path, w_path, edge)) / square * shading_normal_factor(w)
    pdf_v_to_w = bsdf_pdf(v, rows, v_wo, edge.at_v) * abs(edge.cosine_w) / square
    pdf_w_to_v = bsdf_pdf(w, rows, w_wo, edge.at_w) * abs(edge.cosine_v) / square
    reverse_pdf_w = bsdf_pdf(w, rows, edge.at_w, w_wo)
    reverse_pdf_v = bsdf_pdf(v, rows, edge.at_v, v_wo)
    others = pdf_v_to_w * (w_path.dvcm + reverse_pdf_w * w_path.dvc)
    others += pdf_w_to_v * (path.dvcm + reverse_pdf_v * path.dvc)
    return path.throughput * contribution / (1.0 + others)


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def set_shadow_ray_between(connections: Connections, n: int, v: Record, w: Record, context: PassContext) -> None:
    """Shadow ray of connection n from a point off v's surface to one off w's."""
    direction, _ = towards(v, vector(w.p))
    side = context.ray_epsilon if -cosine_to(w, direction) > 0.0 else -context.ray_epsilon
    end = off_surface(vector(w.p), vector(w.n), side)
    side = context.ray_epsilon if cosine_to(v, direction) > 0.0 else -context.ray_epsilon
    start = off_surface(vector(v.p), vector(v.n), side)
    to = minus(end, start)
    distance = length(to)
    store_row(connections.origin, n, minus(start, vector(context.centre)))
    store_row(connections.direction, n, divided(to, distance))
    connections.distance[n] = distance
