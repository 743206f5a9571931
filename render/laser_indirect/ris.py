"""Joining a camera vertex to the best of many light vertices: resampled importance sampling along the lit curve."""

from __future__ import annotations

import math

import numba
import numpy as np
from numpy.typing import NDArray

from render.laser_indirect.connection_buffer import Joints, Lit
from render.laser_indirect.guiding import BINS, TILE, Guide
from render.laser_indirect.path_vertex import (
    BACK,
    DVC,
    DVCM,
    KIND,
    MATERIAL,
    NUMBER,
    PART,
    PIXEL,
    POWER,
    adjoint,
    chance,
    local,
    mirror_at,
    scattered,
)
from render.material.bsdf import SUBSURFACE
from render.sampling.random import uniform

Float = NDArray[np.float64]
Float32 = NDArray[np.float32]
Int = NDArray[np.int32]
MOST_CANDIDATES = 32


@numba.njit(nogil=True, cache=True, error_model="numpy")
def join_light(
    vertex: Float,
    state: Float,
    lit: Lit,
    rows: Float,
    candidates: int,
    guide: Guide,
    learnt: Float,
    seed: int,
    depth: int,
    stream: int,
    centre: Float,
    offset: float,
    joints: Joints,
) -> int:
    """Join each camera vertex to one of the light vertices -> joints. Returns their number.

    Candidates, stratified along the lit curve and denser where the guide expects most, are weighed by what they would
    bring, and one of them is chosen in that proportion (resampled importance sampling, Talbot et al. 2005); its shadow
    ray serves all. What they would have brought is learnt (rows of the guide, BINS) for the passes to come.
    """
    promise, chosen = np.empty(MOST_CANDIDATES), np.empty(MOST_CANDIDATES, np.int64)
    light_vertex, light_state = lit.vertex, lit.state
    count = light_vertex.shape[0]
    guided = lit.ordered and depth == 0 and count >= BINS
    n = 0
    if count == 0:
        return 0
    for r in range(vertex.shape[0]):
        v = vertex[r]
        if mirror_at(v, rows):
            continue
        o0, o1, o2 = v[BACK], v[BACK + 1], v[BACK + 2]
        number = int(state[r, NUMBER])
        shift = uniform(seed, number, depth, stream)
        known = -1
        if guided:
            pixel = int(state[r, PIXEL])
            known = guide.row[pixel // guide.width // TILE, pixel % guide.width // TILE]
        total, bin_ = 0.0, 0
        for k in range(candidates):
            share = (k + shift) / candidates
            shift += 0.6180339887498949
            shift -= math.floor(shift)
            first, last, expected = 0, count, 1.0
            if known >= 0:
                # the shares ascend
                while bin_ < BINS - 1 and guide.cumulative[known, bin_ + 1] <= share:
                    bin_ += 1
                expected = guide.cumulative[known, bin_ + 1] - guide.cumulative[known, bin_]
                share = (share - guide.cumulative[known, bin_]) / expected
                first, last = bin_ * count // BINS, (bin_ + 1) * count // BINS
            j = min(first + int(share * (last - first)), last - 1)
            tries = candidates * expected / (last - first)
            chosen[k] = j
            promise[k] = weigh(v, state[r], light_vertex[j], light_state[j], rows) / tries
            total += promise[k]
            if known >= 0 and promise[k] > 0.0:
                learnt[known, bin_] += promise[k] * promise[k] * tries
        if total <= 0.0:
            continue
        left = uniform(seed, number, depth, stream + 1) * total
        k = 0
        while k < candidates - 1 and left >= promise[k]:
            left -= promise[k]
            k += 1
        if promise[k] <= 0.0:
            continue
        j = chosen[k]
        w = light_vertex[j]
        e0, e1, e2 = w[0] - v[0], w[1] - v[1], w[2] - v[2]
        square = e0 * e0 + e1 * e1 + e2 * e2
        far = math.sqrt(square)
        e0, e1, e2 = e0 / far, e1 / far, e2 / far
        out, in_ = v[3] * e0 + v[4] * e1 + v[5] * e2, -(w[3] * e0 + w[4] * e1 + w[5] * e2)
        i0, i1, i2 = local(v, e0, e1, e2)
        g0, g1, g2 = local(w, -e0, -e1, -e2)
        b0, b1, b2 = w[BACK], w[BACK + 1], w[BACK + 2]
        left_over = (light_state[j, DVCM] * abs(in_) + state[r, DVCM] * abs(out)) / math.pi
        worth = total / lit.paths * (square + left_over) / square * adjoint(w)
        from_camera = chance(v, rows, o0, o1, o2, i0, i1, i2) * abs(in_) / square
        from_light = chance(w, rows, b0, b1, b2, g0, g1, g2) * abs(out) / square
        back_light = chance(w, rows, g0, g1, g2, b0, b1, b2)
        back_camera = chance(v, rows, i0, i1, i2, o0, o1, o2)
        others = from_camera * (light_state[j, DVCM] + back_light * light_state[j, DVC])
        others += from_light * (state[r, DVCM] + back_camera * state[r, DVC])
        joints.pixel[n], joints.part[n] = int(state[r, PIXEL]), int(light_state[j, PART])
        joints.kind[n] = int(state[r, KIND]) | int(light_state[j, KIND])
        joints.helped[n] = True
        joints.worth[n] = state[r, POWER] * worth / (1.0 + others)
        # from a point off this surface to one off the other
        side = offset if in_ > 0.0 else -offset
        t0, t1, t2 = w[0] + side * w[3], w[1] + side * w[4], w[2] + side * w[5]
        side = offset if out > 0.0 else -offset
        s0, s1, s2 = v[0] + side * v[3], v[1] + side * v[4], v[2] + side * v[5]
        e0, e1, e2 = t0 - s0, t1 - s1, t2 - s2
        far = math.sqrt(e0 * e0 + e1 * e1 + e2 * e2)
        joints.origin[n, 0], joints.origin[n, 1], joints.origin[n, 2] = s0 - centre[0], s1 - centre[1], s2 - centre[2]
        joints.direction[n, 0], joints.direction[n, 1], joints.direction[n, 2] = e0 / far, e1 / far, e2 / far
        joints.far[n] = far
        n += 1
    return n


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def weigh(v: Float, v_state: Float, w: Float, w_state: Float, rows: Float) -> float:
    """What a joint of camera vertex v with light vertex w would bring, were nothing between."""
    e0, e1, e2 = w[0] - v[0], w[1] - v[1], w[2] - v[2]
    square = e0 * e0 + e1 * e1 + e2 * e2
    far = math.sqrt(square)
    e0, e1, e2 = e0 / far, e1 / far, e2 / far
    out, in_ = v[3] * e0 + v[4] * e1 + v[5] * e2, -(w[3] * e0 + w[4] * e1 + w[5] * e2)
    i0, i1, i2 = local(v, e0, e1, e2)
    g0, g1, g2 = local(w, -e0, -e1, -e2)
    if out * i2 <= 0.0 or in_ * g2 <= 0.0:
        return 0.0
    # no straight way through a medium
    if (i2 < 0.0 and rows[int(v[MATERIAL]), 0] == SUBSURFACE) or (g2 < 0.0 and rows[int(w[MATERIAL]), 0] == SUBSURFACE):
        return 0.0
    value = scattered(v, rows, i0, i1, i2, v[BACK], v[BACK + 1], v[BACK + 2])
    if value <= 0.0:
        return 0.0
    value *= scattered(w, rows, w[BACK], w[BACK + 1], w[BACK + 2], g0, g1, g2)
    # what the other ways leave of it near a corner, roughly
    left_over = (w_state[DVCM] * abs(in_) + v_state[DVCM] * abs(out)) / math.pi
    return w_state[POWER] * value * abs(i2 * in_) / (square + left_over)
