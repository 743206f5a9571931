"""Connecting a camera vertex to one of many light vertices by resampled importance sampling (RIS).

Of M candidates x_j, drawn with pdf p(x_j) along the lit curve, one is chosen in proportion to its weight
w_j = f(x_j) / (M p(x_j)), f the target function, and contributes sum(w_j) / f times what it brings (Talbot et al.
2005). A single shadow ray tests it for all.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numba
import numpy as np

from render.base.arrays import Float, Long
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
    weights, chosen = np.empty(MOST_CANDIDATES), np.empty(MOST_CANDIDATES, np.int64)
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
        e0, e1, e2, _ = towards(v, w.p[0], w.p[1], w.p[2])
        connections.interior[n] = interior_beyond(v, path, context.rows, cosine_to(v, e0, e1, e2))
        n += 1
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


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def target_function(v: Record, path: Record, w: Record, w_path: Record, rows: Float) -> float:
    """About what a connection of camera vertex v to light vertex w contributes, MIS-weighted, if it is not occluded.

    Near a corner the geometry term is bounded by what the other techniques take of it (`corner_bound`).
    """
    e0, e1, e2 = w.p[0] - v.p[0], w.p[1] - v.p[1], w.p[2] - v.p[2]
    square = e0 * e0 + e1 * e1 + e2 * e2
    distance = math.sqrt(square)
    e0, e1, e2 = e0 / distance, e1 / distance, e2 / distance
    out, in_ = cosine_to(v, e0, e1, e2), -cosine_to(w, e0, e1, e2)
    i0, i1, i2 = to_shading(v, e0, e1, e2)
    g0, g1, g2 = to_shading(w, -e0, -e1, -e2)
    if out * i2 <= 0.0 or in_ * g2 <= 0.0:
        return 0.0
    # no straight way through a medium
    if is_turbid(v, i2) or is_turbid(w, g2):
        return 0.0
    value = eval_bsdf(v, rows, i0, i1, i2, v.wo[0], v.wo[1], v.wo[2])
    if value <= 0.0:
        return 0.0
    value *= eval_bsdf(w, rows, w.wo[0], w.wo[1], w.wo[2], g0, g1, g2)
    return w_path.throughput * value * abs(i2 * in_) / (square + corner_bound(path, out, w_path, in_))


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def corner_bound(path: Record, out: float, w_path: Record, in_: float) -> float:
    """m^2 added to the squared distance: the share of the other techniques as if both surfaces were diffuse."""
    return (w_path.dvcm * abs(in_) + path.dvcm * abs(out)) / math.pi


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def mis_weighted(v: Record, path: Record, w: Record, w_path: Record, resampled: float, rows: Float) -> float:
    """Contribution of the connection of v to w; resampled: sum of the candidates' weights, for each light path."""
    e0, e1, e2 = w.p[0] - v.p[0], w.p[1] - v.p[1], w.p[2] - v.p[2]
    square = e0 * e0 + e1 * e1 + e2 * e2
    distance = math.sqrt(square)
    e0, e1, e2 = e0 / distance, e1 / distance, e2 / distance
    out, in_ = cosine_to(v, e0, e1, e2), -cosine_to(w, e0, e1, e2)
    i0, i1, i2 = to_shading(v, e0, e1, e2)
    g0, g1, g2 = to_shading(w, -e0, -e1, -e2)
    o0, o1, o2 = v.wo[0], v.wo[1], v.wo[2]
    b0, b1, b2 = w.wo[0], w.wo[1], w.wo[2]
    # the target function over the true geometry term
    contribution = resampled * (square + corner_bound(path, out, w_path, in_)) / square * shading_normal_factor(w)
    from_camera = bsdf_pdf(v, rows, o0, o1, o2, i0, i1, i2) * abs(in_) / square
    from_light = bsdf_pdf(w, rows, b0, b1, b2, g0, g1, g2) * abs(out) / square
    back_light = bsdf_pdf(w, rows, g0, g1, g2, b0, b1, b2)
    back_camera = bsdf_pdf(v, rows, i0, i1, i2, o0, o1, o2)
    others = from_camera * (w_path.dvcm + back_light * w_path.dvc)
    others += from_light * (path.dvcm + back_camera * path.dvc)
    return path.throughput * contribution / (1.0 + others)


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def set_shadow_ray_between(connections: Connections, n: int, v: Record, w: Record, context: PassContext) -> None:
    """Shadow ray of connection n from a point off v's surface to one off w's."""
    e0, e1, e2, _ = towards(v, w.p[0], w.p[1], w.p[2])
    side = context.ray_epsilon if -cosine_to(w, e0, e1, e2) > 0.0 else -context.ray_epsilon
    t0, t1, t2 = off_surface(w.p[0], w.p[1], w.p[2], w.n[0], w.n[1], w.n[2], side)
    side = context.ray_epsilon if cosine_to(v, e0, e1, e2) > 0.0 else -context.ray_epsilon
    s0, s1, s2 = off_surface(v.p[0], v.p[1], v.p[2], v.n[0], v.n[1], v.n[2], side)
    e0, e1, e2 = t0 - s0, t1 - s1, t2 - s2
    distance = math.sqrt(e0 * e0 + e1 * e1 + e2 * e2)
    centre = context.centre
    connections.origin[n, 0], connections.origin[n, 1] = s0 - centre[0], s1 - centre[1]
    connections.origin[n, 2] = s2 - centre[2]
    connections.direction[n, 0], connections.direction[n, 1] = e0 / distance, e1 / distance
    connections.direction[n, 2] = e2 / distance
    connections.distance[n] = distance
