"""Joining paths: a light path's vertex to the camera, a camera path's vertex to the laser or to light vertices.

A path over k surfaces can be made in k + 1 ways, by where the joint lies. Each way's contribution is weighted by its
density, times how often it is tried, over the sum of all ways' (balance heuristic, Veach 1997, eq. 9.8; in the
recursive form of Georgiev et al. 2012). The ways are tried

    light_paths               times for the joint at the camera,
    samples[pixel] JOINS      times for a joint between two surfaces,
    samples[pixel]            times for the joint at the laser,

samples being the camera paths to be expected, a fraction where not every pass has one; a pixel without is left to light
tracing, with weight 1. Light that met one surface only is left
to `render.direct`. All joints go into `Joints`; a shadow ray each decides whether they count.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from render.beam import irradiance
from render.bsdf import SUBSURFACE, evaluate, pdf
from render.distortion import tilt_matrix
from render.emission import Fan, emitted_density
from render.guide import BINS, TILE, Guide
from render.lens import lens_point, lens_position, lens_project
from render.random import uniform
from render.surface import View
from render.vertex import BACK, DVC, DVCM, KIND, MATERIAL, NUMBER, PART, PIXEL, POWER, local, material_of

Float = NDArray[np.float64]
Float32 = NDArray[np.float32]
Int = NDArray[np.int32]

JOINS = 32.0
"""What one resampled joint among many candidates counts for, in joints to a single random vertex."""
MOST_CANDIDATES = 32


class Joints(NamedTuple):
    """(n,) pixel and worth of joints; (n, 3) origins (scene-centred), directions and (n,) length of shadow rays."""

    pixel: Int
    kind: Int
    part: Int
    """Of the fan that the light left by; -1: not known."""
    helped: NDArray[np.bool_]
    """Camera paths make this path as well."""
    worth: Float
    origin: Float32
    direction: Float32
    far: Float32


class Take(NamedTuple):
    """What a pass adds to."""

    image: Float
    """(pixels,) radiance."""
    helped: Float32
    """(pixels,) of it, what camera paths could help with."""
    sums: Float
    """(KINDS,) by kind of light (`render.vertex`)."""
    found: Float
    """(PARTS,) squared worth of what came from each part of the fan."""
    learnt: Float
    """As in `join_light`."""
    dropped: Float
    """(1,) joints whose worth was no number, infinite or negative."""


class Lit(NamedTuple):
    """Light vertices to be joined to: the rows of `render.vertex`."""

    vertex: Float
    state: Float
    ordered: bool
    """They follow each other along the fan: the first surface's."""
    paths: int
    """Traced in all."""


def no_joints(n: int) -> Joints:
    """Room for n."""
    return Joints(
        np.empty(n, np.int32),
        np.empty(n, np.int32),
        np.empty(n, np.int32),
        np.ones(n, np.bool_),
        np.empty(n),
        np.empty((n, 3), np.float32),
        np.empty((n, 3), np.float32),
        np.empty(n, np.float32),
    )


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def cast(
    joints: Joints,
    j: int,
    v: Float,
    d0: float,
    d1: float,
    d2: float,
    out: float,
    far: float,
    centre: Float,
    offset: float,
) -> None:
    """Aim the shadow ray of joint j from vertex v along d; out: cosine with the geometric normal."""
    side = offset if out > 0.0 else -offset
    for axis in range(3):
        joints.origin[j, axis] = v[axis] - centre[axis] + side * v[3 + axis]
    joints.direction[j, 0], joints.direction[j, 1], joints.direction[j, 2] = d0, d1, d2
    joints.far[j] = far


@numba.njit(nogil=True, cache=True, error_model="numpy")
def join_camera(
    vertex: Float,
    state: Float,
    rows: Float,
    view: View,
    height: int,
    samples: Float,
    light_paths: int,
    seed: int,
    depth: int,
    centre: Float,
    offset: float,
    joints: Joints,
) -> int:
    """Join light vertices (n, .) to the camera -> joints, to be divided by the light paths. Returns their number."""
    tilt = tilt_matrix(view.distortion[12], view.distortion[13])
    distorted = bool(np.any(view.distortion))
    rgb, row, f = np.empty(3), np.empty(rows.shape[1]), np.empty(1)
    a = b = 0.0
    n = 0
    for r in range(vertex.shape[0]):
        v = vertex[r]
        if material_of(v, rows, row, rgb):
            continue
        if view.lens[0] > 0.0:
            number = int(state[r, NUMBER])
            a, b = lens_point(view.lens[0], uniform(seed, number, depth, 8), uniform(seed, number, depth, 9))
        x, y, area = lens_project(view, tilt, distorted, v[0], v[1], v[2], a, b)
        if not (area > 0.0 and -0.5 <= x < view.width - 0.5 and -0.5 <= y < height - 0.5):
            continue
        pixel = int(math.floor(y + 0.5)) * view.width + int(math.floor(x + 0.5))
        c0, c1, c2 = lens_position(view, a, b)
        e0, e1, e2 = c0 - v[0], c1 - v[1], c2 - v[2]
        far = math.sqrt(e0 * e0 + e1 * e1 + e2 * e2)
        e0, e1, e2 = e0 / far, e1 / far, e2 / far
        out = v[3] * e0 + v[4] * e1 + v[5] * e2
        i0, i1, i2 = local(v, e0, e1, e2)
        if out * i2 <= 0.0:
            continue
        o0, o1, o2 = v[BACK], v[BACK + 1], v[BACK + 2]
        evaluate(row, rgb, o0, o1, o2, i0, i1, i2, f)
        if f[0] <= 0.0:
            continue
        density = area * abs(out)
        weight = 1.0
        joints.helped[n] = state[r, DVCM] > 0.0 or state[r, DVC] > 0.0
        if samples[pixel] > 0.0 and joints.helped[n]:
            reverse = pdf(row, rgb, i0, i1, i2, o0, o1, o2)
            others = density * (state[r, DVCM] + reverse * state[r, DVC])
            weight = 1.0 / (1.0 + JOINS * samples[pixel] / light_paths * others)
        back = adjoint(v, o2, i2, out)
        joints.pixel[n], joints.kind[n], joints.part[n] = pixel, int(state[r, KIND]), int(state[r, PART])
        joints.worth[n] = state[r, POWER] * f[0] * density * weight * back
        cast(joints, n, v, e0, e1, e2, out, far, centre, offset)
        n += 1
    return n


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def adjoint(v: Float, o2: float, i2: float, out: float) -> float:
    """What a shading normal changes for light that leaves by a direction (Veach 1997, eq. 5.20), cosines included.

    The factor on  f |cos with the geometric normal|  for light; 1 where both normals agree.
    """
    z0, z1, z2, x0, x1, x2 = v[6], v[7], v[8], v[9], v[10], v[11]
    if z0 == v[3] and z1 == v[4] and z2 == v[5]:
        return 1.0
    y0, y1, y2 = z1 * x2 - z2 * x1, z2 * x0 - z0 * x2, z0 * x1 - z1 * x0
    o0, o1 = v[BACK], v[BACK + 1]
    back = (
        v[3] * (x0 * o0 + y0 * o1 + z0 * o2)
        + v[4] * (x1 * o0 + y1 * o1 + z1 * o2)
        + v[5] * (x2 * o0 + y2 * o1 + z2 * o2)
    )
    return abs(o2 / back)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def laser_light(v: Float, T_laser_world: Float, beam: Float, fan: Fan) -> tuple[float, float]:
    """Irradiance (W/m^2, on the geometric normal) at a vertex by the laser, and the photons a path and m^2 there."""
    m = T_laser_world
    x = m[0, 0] * v[0] + m[0, 1] * v[1] + m[0, 2] * v[2] + m[0, 3]
    y = m[1, 0] * v[0] + m[1, 1] * v[1] + m[1, 2] * v[2] + m[1, 3]
    z = m[2, 0] * v[0] + m[2, 1] * v[1] + m[2, 2] * v[2] + m[2, 3]
    nx = m[0, 0] * v[3] + m[0, 1] * v[4] + m[0, 2] * v[5]
    ny = m[1, 0] * v[3] + m[1, 1] * v[4] + m[1, 2] * v[5]
    nz = m[2, 0] * v[3] + m[2, 1] * v[4] + m[2, 2] * v[5]
    value = irradiance(x, y, z, nx, ny, nz, beam)
    return value, value / beam[0] * emitted_density(y / z, fan, beam) if value > 0.0 else 0.0


@numba.njit(nogil=True, cache=True, error_model="numpy")
def begin_light(vertex: Float, state: Float, T_laser_world: Float, beam: Float, fan: Fan) -> None:
    """The weights' partial sums at the first surface that light meets."""
    for r in range(vertex.shape[0]):
        _, density = laser_light(vertex[r], T_laser_world, beam, fan)
        state[r, DVCM] = 1.0 / (JOINS * density) if density > 0.0 else 0.0
        state[r, DVC] = 0.0


@numba.njit(nogil=True, cache=True, error_model="numpy")
def begin_camera(vertex: Float, state: Float, view: View, samples: Float, light_paths: int, seed: int) -> None:
    """The weights' partial sums at the first surface that the camera sees."""
    tilt = tilt_matrix(view.distortion[12], view.distortion[13])
    distorted = bool(np.any(view.distortion))
    for r in range(vertex.shape[0]):
        v = vertex[r]
        a, b = path_lens_point(view, seed, int(state[r, NUMBER]))
        _, _, area = lens_project(view, tilt, distorted, v[0], v[1], v[2], a, b)
        c0, c1, c2 = lens_position(view, a, b)
        e0, e1, e2 = c0 - v[0], c1 - v[1], c2 - v[2]
        density = area * abs(v[3] * e0 + v[4] * e1 + v[5] * e2) / math.sqrt(e0 * e0 + e1 * e1 + e2 * e2)
        state[r, DVCM] = light_paths / (JOINS * samples[int(state[r, PIXEL])] * density) if density > 0.0 else 0.0
        state[r, DVC] = 0.0


@numba.njit(nogil=True, cache=True, error_model="numpy")
def path_lens_point(view: View, seed: int, number: int) -> tuple[float, float]:
    """(a, b) on the aperture through which camera path `number` goes."""
    if view.lens[0] == 0.0:
        return 0.0, 0.0
    return lens_point(view.lens[0], uniform(seed, number, 0, 94), uniform(seed, number, 0, 95))


@numba.njit(nogil=True, cache=True, error_model="numpy")
def join_laser(
    vertex: Float,
    state: Float,
    rows: Float,
    T_laser_world: Float,
    beam: Float,
    fan: Fan,
    centre: Float,
    offset: float,
    joints: Joints,
) -> int:
    """Join camera vertices (n, .) to the laser -> joints. Returns their number."""
    m = T_laser_world
    l0 = -(m[0, 0] * m[0, 3] + m[1, 0] * m[1, 3] + m[2, 0] * m[2, 3])
    l1 = -(m[0, 1] * m[0, 3] + m[1, 1] * m[1, 3] + m[2, 1] * m[2, 3])
    l2 = -(m[0, 2] * m[0, 3] + m[1, 2] * m[1, 3] + m[2, 2] * m[2, 3])
    rgb, row, f = np.empty(3), np.empty(rows.shape[1]), np.empty(1)
    n = 0
    for r in range(vertex.shape[0]):
        v = vertex[r]
        light, density = laser_light(v, m, beam, fan)
        if light <= 0.0:
            continue
        if material_of(v, rows, row, rgb):
            continue
        e0, e1, e2 = l0 - v[0], l1 - v[1], l2 - v[2]
        far = math.sqrt(e0 * e0 + e1 * e1 + e2 * e2)
        e0, e1, e2 = e0 / far, e1 / far, e2 / far
        out = v[3] * e0 + v[4] * e1 + v[5] * e2
        i0, i1, i2 = local(v, e0, e1, e2)
        if out * i2 <= 0.0:
            continue
        o0, o1, o2 = v[BACK], v[BACK + 1], v[BACK + 2]
        evaluate(row, rgb, i0, i1, i2, o0, o1, o2, f)
        if f[0] <= 0.0:
            continue
        others = density * (state[r, DVCM] + pdf(row, rgb, i0, i1, i2, o0, o1, o2) * state[r, DVC])
        joints.pixel[n], joints.kind[n], joints.part[n] = int(state[r, PIXEL]), int(state[r, KIND]), -1
        joints.helped[n] = True
        joints.worth[n] = state[r, POWER] * f[0] * light * abs(i2 / out) / (1.0 + JOINS * others)
        cast(joints, n, v, e0, e1, e2, out, far, centre, offset)
        n += 1
    return n


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
    rgb, row, f = np.empty(3), np.empty(rows.shape[1]), np.empty(1)
    light_rgb, light_row, light_f = np.empty(3), np.empty(rows.shape[1]), np.empty(1)
    promise, chosen = np.empty(MOST_CANDIDATES), np.empty(MOST_CANDIDATES, np.int64)
    light_vertex, light_state = lit.vertex, lit.state
    count = light_vertex.shape[0]
    guided = lit.ordered and depth == 0 and count >= BINS
    n = 0
    if count == 0:
        return 0
    for r in range(vertex.shape[0]):
        v = vertex[r]
        if material_of(v, rows, row, rgb):
            continue
        o0, o1, o2 = v[BACK], v[BACK + 1], v[BACK + 2]
        number = int(state[r, NUMBER])
        shift = uniform(seed, number, depth, stream)
        known = -1
        if guided:
            pixel = int(state[r, PIXEL])
            known = guide.row[pixel // guide.width // TILE, pixel % guide.width // TILE]
        total = 0.0
        for k in range(candidates):
            share = (k + shift) / candidates
            shift += 0.6180339887498949
            shift -= math.floor(shift)
            bin_, first, last, chance = 0, 0, count, 1.0
            if known >= 0:
                low, high = 0, BINS - 1
                while low < high:
                    middle = (low + high) // 2
                    if guide.cumulative[known, middle + 1] <= share:
                        low = middle + 1
                    else:
                        high = middle
                bin_ = low
                chance = guide.cumulative[known, bin_ + 1] - guide.cumulative[known, bin_]
                share = (share - guide.cumulative[known, bin_]) / chance
                first, last = bin_ * count // BINS, (bin_ + 1) * count // BINS
            j = min(first + int(share * (last - first)), last - 1)
            tries = candidates * chance / (last - first)
            w = light_vertex[j]
            chosen[k], promise[k] = j, 0.0
            e0, e1, e2 = w[0] - v[0], w[1] - v[1], w[2] - v[2]
            square = e0 * e0 + e1 * e1 + e2 * e2
            far = math.sqrt(square)
            e0, e1, e2 = e0 / far, e1 / far, e2 / far
            out, in_ = v[3] * e0 + v[4] * e1 + v[5] * e2, -(w[3] * e0 + w[4] * e1 + w[5] * e2)
            i0, i1, i2 = local(v, e0, e1, e2)
            g0, g1, g2 = local(w, -e0, -e1, -e2)
            if out * i2 <= 0.0 or in_ * g2 <= 0.0:
                continue
            # no straight way through a medium
            if (row[0] == SUBSURFACE and i2 < 0.0) or (g2 < 0.0 and rows[int(w[MATERIAL]), 0] == SUBSURFACE):
                continue
            evaluate(row, rgb, i0, i1, i2, o0, o1, o2, f)
            if f[0] <= 0.0:
                continue
            material_of(w, rows, light_row, light_rgb)
            evaluate(light_row, light_rgb, w[BACK], w[BACK + 1], w[BACK + 2], g0, g1, g2, light_f)
            # what the other ways leave of it near a corner, roughly
            left_over = (light_state[j, DVCM] * abs(in_) + state[r, DVCM] * abs(out)) / math.pi
            promise[k] = light_state[j, POWER] * f[0] * light_f[0] * abs(i2 * in_) / (square + left_over) / tries
            total += promise[k]
            if known >= 0:
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
        material_of(w, rows, light_row, light_rgb)
        b0, b1, b2 = w[BACK], w[BACK + 1], w[BACK + 2]
        left_over = (light_state[j, DVCM] * abs(in_) + state[r, DVCM] * abs(out)) / math.pi
        worth = total / lit.paths * (square + left_over) / square * adjoint(w, b2, g2, in_)
        from_camera = pdf(row, rgb, o0, o1, o2, i0, i1, i2) * abs(in_) / square
        from_light = pdf(light_row, light_rgb, b0, b1, b2, g0, g1, g2) * abs(out) / square
        back_light = pdf(light_row, light_rgb, g0, g1, g2, b0, b1, b2)
        back_camera = pdf(row, rgb, i0, i1, i2, o0, o1, o2)
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


@numba.njit(nogil=True, cache=True)
def count_joints(joints: Joints, blocked: NDArray[np.bool_], count: int, scale: float, take: Take) -> None:
    """Add the clear joints to the image, to the sum of their kind of light, and to what their part of the fan found."""
    for j in range(count):
        if not blocked[j]:
            worth = joints.worth[j] * scale
            if not 0.0 <= worth < math.inf:
                take.dropped[0] += 1.0
                continue
            take.image[joints.pixel[j]] += worth
            take.sums[joints.kind[j]] += worth
            if joints.helped[j]:
                take.helped[joints.pixel[j]] += worth
            if joints.part[j] >= 0:
                take.found[joints.part[j]] += worth * worth


@numba.njit(nogil=True, cache=True)
def joinable(vertex: Float, rows: Float) -> NDArray[np.bool_]:
    """(n,) whether vertices scatter into more than single directions."""
    rgb, row = np.empty(3), np.empty(rows.shape[1])
    out = np.empty(vertex.shape[0], np.bool_)
    for r in range(vertex.shape[0]):
        out[r] = not material_of(vertex[r], rows, row, rgb)
    return out
