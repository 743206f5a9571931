"""Joining paths: a light path's vertex to the camera, a camera path's vertex to the laser or to light vertices.

A path over k surfaces can be made in k + 1 ways, by where the joint lies. Each way's contribution is weighted by its
density, times how often it is tried, over the sum of all ways' (balance heuristic, Veach 1997, eq. 9.8; in the
recursive form of Georgiev et al. 2012). The ways are tried

    light_paths               times for the joint at the camera,
    samples[pixel] JOINS      times for a joint between two surfaces,
    samples[pixel]            times for the joint at the laser,

samples being the camera paths to be expected, a fraction where not every pass has one; a pixel without is left to light
tracing, with weight 1. Light that met one surface only is left
to `render.laser_direct.integrator`. All joints go into `Joints`; a shadow ray each decides whether they count.
"""

from __future__ import annotations

import math

import numba
import numpy as np
from numpy.typing import NDArray

from render.camera.distortion import tilt_matrix
from render.camera.lens import lens_point, lens_position, lens_project
from render.camera.view import View
from render.laser.irradiance import irradiance
from render.laser_indirect.connection_buffer import BLOCK, JOINS, Joints, Take, cast
from render.laser_indirect.path_vertex import (
    BACK,
    DVC,
    DVCM,
    KIND,
    NUMBER,
    PART,
    PIXEL,
    POWER,
    REFLECTANCE,
    adjoint,
    chance,
    local,
    mirror_at,
    scattered,
)
from render.laser_indirect.photon_emission import Fan, emitted_density
from render.sampling.random import uniform

Float = NDArray[np.float64]
Float32 = NDArray[np.float32]
Int = NDArray[np.int32]


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
    a = b = 0.0
    n = 0
    for r in range(vertex.shape[0]):
        v = vertex[r]
        if mirror_at(v, rows):
            continue
        if view.lens[0] > 0.0:
            number = int(state[r, NUMBER])
            a, b = lens_point(view.lens[0], uniform(seed, number, depth, 8), uniform(seed, number, depth, 9))
        pixel, area = pixel_of(view, tilt, distorted, height, v, a, b)
        if pixel < 0:
            continue
        c0, c1, c2 = lens_position(view, a, b)
        e0, e1, e2 = c0 - v[0], c1 - v[1], c2 - v[2]
        far = math.sqrt(e0 * e0 + e1 * e1 + e2 * e2)
        e0, e1, e2 = e0 / far, e1 / far, e2 / far
        out = v[3] * e0 + v[4] * e1 + v[5] * e2
        i0, i1, i2 = local(v, e0, e1, e2)
        if out * i2 <= 0.0:
            continue
        o0, o1, o2 = v[BACK], v[BACK + 1], v[BACK + 2]
        f = scattered(v, rows, o0, o1, o2, i0, i1, i2)
        if f <= 0.0:
            continue
        density = area * abs(out)
        weight = 1.0
        joints.helped[n] = state[r, DVCM] > 0.0 or state[r, DVC] > 0.0
        if samples[pixel] > 0.0 and joints.helped[n]:
            reverse = chance(v, rows, i0, i1, i2, o0, o1, o2)
            others = density * (state[r, DVCM] + reverse * state[r, DVC])
            weight = 1.0 / (1.0 + JOINS * samples[pixel] / light_paths * others)
        joints.pixel[n], joints.kind[n], joints.part[n] = pixel, int(state[r, KIND]), int(state[r, PART])
        joints.worth[n] = state[r, POWER] * f * density * weight * adjoint(v)
        cast(joints, n, v, e0, e1, e2, out, far, centre, offset)
        n += 1
    return n


@numba.njit(nogil=True, cache=True, error_model="numpy")
def hint_at(
    vertex: Float, state: Float, view: View, height: int, clear: NDArray[np.bool_], light_paths: int, take: Take
) -> None:
    """Add to `take.helped` what light vertices would look like behind clear glass, were it not to bend light.

    clear (pixels,): where the camera looks at glass or a mirror. Only says where camera paths are worth while.
    """
    tilt = tilt_matrix(view.distortion[12], view.distortion[13])
    distorted = bool(np.any(view.distortion))
    for r in range(vertex.shape[0]):
        v = vertex[r]
        pixel, area = pixel_of(view, tilt, distorted, height, v, 0.0, 0.0)
        if pixel < 0:
            continue
        if clear[pixel]:
            take.touched[pixel // BLOCK] = True
            take.helped[pixel] += state[r, POWER] * v[REFLECTANCE] * area / (math.pi * light_paths)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def pixel_of(view: View, tilt: Float, distorted: bool, height: int, v: Float, a: float, b: float) -> tuple[int, float]:
    """The pixel that sees a vertex through lens point (a, b), -1 if none, and `lens_project`'s area."""
    x, y, area = lens_project(view, tilt, distorted, v[0], v[1], v[2], a, b)
    if not (area > 0.0 and -0.5 <= x < view.width - 0.5 and -0.5 <= y < height - 0.5):
        return -1, 0.0
    return int(math.floor(y + 0.5)) * view.width + int(math.floor(x + 0.5)), area


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
    n = 0
    for r in range(vertex.shape[0]):
        v = vertex[r]
        light, density = laser_light(v, m, beam, fan)
        if light <= 0.0:
            continue
        if mirror_at(v, rows):
            continue
        e0, e1, e2 = l0 - v[0], l1 - v[1], l2 - v[2]
        far = math.sqrt(e0 * e0 + e1 * e1 + e2 * e2)
        e0, e1, e2 = e0 / far, e1 / far, e2 / far
        out = v[3] * e0 + v[4] * e1 + v[5] * e2
        i0, i1, i2 = local(v, e0, e1, e2)
        if out * i2 <= 0.0:
            continue
        o0, o1, o2 = v[BACK], v[BACK + 1], v[BACK + 2]
        f = scattered(v, rows, i0, i1, i2, o0, o1, o2)
        if f <= 0.0:
            continue
        others = density * (state[r, DVCM] + chance(v, rows, i0, i1, i2, o0, o1, o2) * state[r, DVC])
        joints.pixel[n], joints.kind[n], joints.part[n] = int(state[r, PIXEL]), int(state[r, KIND]), -1
        joints.helped[n] = True
        joints.worth[n] = state[r, POWER] * f * light * abs(i2 / out) / (1.0 + JOINS * others)
        cast(joints, n, v, e0, e1, e2, out, far, centre, offset)
        n += 1
    return n


@numba.njit(nogil=True, cache=True, error_model="numpy")
def joinable(vertex: Float, state: Float, rows: Float) -> tuple[Float, Float]:
    """Copies of the vertices (n, .) and states of which joints can be made: all but mirrors and clear glass."""
    kept, kept_state = np.empty(vertex.shape), np.empty(state.shape)
    n = 0
    for r in range(vertex.shape[0]):
        if not mirror_at(vertex[r], rows):
            for c in range(vertex.shape[1]):
                kept[n, c] = vertex[r, c]
            for c in range(state.shape[1]):
                kept_state[n, c] = state[r, c]
            n += 1
    return kept[:n], kept_state[:n]
