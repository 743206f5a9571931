"""Lamps and shining objects as the kernels take them, and how a point on one is drawn.

    row   0 kind   1.. radiance or intensity RGB   4.. centre   7.. half x axis   10.. half y axis   13.. normal
          16 area   17 worth   18 squared reach   19 first and 20 end of the triangles of a shining object

One of them is drawn with a chance that follows worth / (squared distance + squared reach): the order of its irradiance.
A rectangle shines, is seen and hides what is behind it on the side of its normal only; from behind it is not there.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numba
import numpy as np

from render.base.arrays import Float, Int
from render.material.bsdf import EMITTED, EMITTER
from render.scene.lights import PointLight
from render.scene.scene import Scene
from render.world.triangles import Surface

POINT, RECTANGLE, SHINING_OBJECT = 0.0, 1.0, 2.0
ROW = 21


class Lights(NamedTuple):
    """Every source but the environment."""

    rows: Float
    """(l, ROW)."""
    rectangles: int
    """The number of rectangles: no ray need look for them where there are none."""
    shining: Int
    """(e,) the triangles that shine, object by object."""
    area_below: Float
    """(e,) the area of a shining object's triangles up to and with this one, over its whole."""
    light_of_material: Int
    """(s,) the row of the object with this material, -1: it does not shine."""


def pack_lights(scene: Scene, surface: Surface) -> Lights:
    """The scene's lamps, then its shining objects."""
    rows = []
    for light in scene.lights:
        row = np.zeros(ROW)
        matrix = light.T_world_light.matrix
        row[4:7], row[13:16] = matrix[:3, 3], matrix[:3, 2]
        if isinstance(light, PointLight):
            row[0], row[1:4], row[17] = POINT, light.intensity, np.mean(light.intensity)
        else:
            row[0], row[1:4], row[16] = RECTANGLE, light.radiance, light.width * light.height
            row[7:10], row[10:13] = matrix[:3, 0] * light.width / 2, matrix[:3, 1] * light.height / 2
            row[17], row[18] = np.mean(light.radiance) * row[16], (light.width**2 + light.height**2) / 4
        if row[17] > 0.0:
            rows.append(row)
    rectangles = sum(row[0] == RECTANGLE for row in rows)
    light_of_material = np.full(len(surface.rows), -1, np.int32)
    shining, shares = [np.zeros(0, np.int32)], [np.zeros(0)]
    for slot in np.flatnonzero(surface.rows[:, 0] == EMITTER):
        found = np.flatnonzero(surface.object_id == slot).astype(np.int32)
        corners = surface.vertices[surface.triangles[found]]
        areas = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        radiance = surface.rows[slot, EMITTED : EMITTED + 3]
        if areas.sum() <= 0.0 or radiance.sum() <= 0.0:
            continue
        row, start = np.zeros(ROW), sum(len(part) for part in shining)
        low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
        row[0], row[1:4], row[4:7], row[16] = SHINING_OBJECT, radiance, (low + high) / 2, areas.sum()
        row[17], row[18] = radiance.mean() * areas.sum(), np.sum((high - low) ** 2) / 4
        row[19], row[20] = start, start + len(found)
        light_of_material[slot] = len(rows)
        rows.append(row)
        shining.append(found)
        shares.append(np.cumsum(areas) / areas.sum())
    packed = np.array(rows).reshape(-1, ROW)
    return Lights(packed, int(rectangles), np.concatenate(shining), np.concatenate(shares), light_of_material)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def light_in_view(rows: Float, o0: float, o1: float, o2: float, d0: float, d1: float, d2: float, far: float) -> int:
    """The rectangle whose shining side the ray o + f d meets first, before f = far; -1 for none."""
    seen = -1
    for k in range(rows.shape[0]):
        light = rows[k]
        if light[0] != RECTANGLE:
            continue
        facing = light[13] * d0 + light[14] * d1 + light[15] * d2
        if facing >= 0.0:
            continue
        f = (light[13] * (light[4] - o0) + light[14] * (light[5] - o1) + light[15] * (light[6] - o2)) / facing
        if not 0.0 < f < far:
            continue
        q0, q1, q2 = o0 + f * d0 - light[4], o1 + f * d1 - light[5], o2 + f * d2 - light[6]
        along_x = light[7] * q0 + light[8] * q1 + light[9] * q2
        along_y = light[10] * q0 + light[11] * q1 + light[12] * q2
        within_x = abs(along_x) <= light[7] ** 2 + light[8] ** 2 + light[9] ** 2
        within_y = abs(along_y) <= light[10] ** 2 + light[11] ** 2 + light[12] ** 2
        if within_x and within_y:
            seen, far = k, f
    return seen


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def light_importance(light: Float, p0: float, p1: float, p2: float) -> float:
    """About the irradiance that one light gives the point p, up to a factor; 0 behind a rectangle."""
    t0, t1, t2 = light[4] - p0, light[5] - p1, light[6] - p2
    if light[0] == RECTANGLE and light[13] * t0 + light[14] * t1 + light[15] * t2 >= 0.0:
        return 0.0
    return light[17] / max(t0 * t0 + t1 * t1 + t2 * t2 + light[18], 1e-30)


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def sample_light(rows: Float, p0: float, p1: float, p2: float, r: float) -> tuple[int, float]:
    """A light for the point p and its chance; -1: none shines there. r in [0, 1)."""
    if rows.shape[0] == 1:
        return 0, 1.0
    total = 0.0
    for k in range(rows.shape[0]):
        total += light_importance(rows[k], p0, p1, p2)
    if total <= 0.0:
        return -1, 0.0
    chosen, left, own = -1, r * total, 0.0
    for k in range(rows.shape[0]):
        value = light_importance(rows[k], p0, p1, p2)
        if value > 0.0:
            chosen, own = k, value
            left -= value
            if left < 0.0:
                break
    return chosen, own / total


@numba.njit(nogil=True, cache=True, error_model="numpy")
def light_probability(rows: Float, k: int, p0: float, p1: float, p2: float) -> float:
    """With which `sample_light` draws light k for the point p."""
    if rows.shape[0] == 1:
        return 1.0
    total = 0.0
    for j in range(rows.shape[0]):
        total += light_importance(rows[j], p0, p1, p2)
    return light_importance(rows[k], p0, p1, p2) / total if total > 0.0 else 0.0


@numba.njit(nogil=True, cache=True, error_model="numpy")
def sample_emitter_point(
    lights: Lights, surface: Surface, k: int, r1: float, r2: float, point: Float, normal: Float
) -> None:
    """A point of the shining object k, uniform by area, and its unit normal -> point, normal (3,)."""
    light = lights.rows[k]
    low, high = int(light[19]), int(light[20]) - 1
    first = low
    while low < high:
        middle = (low + high) // 2
        if lights.area_below[middle] <= r1:
            low = middle + 1
        else:
            high = middle
    before = lights.area_below[low - 1] if low > first else 0.0
    r1 = min(max((r1 - before) / (lights.area_below[low] - before), 0.0), 1.0)
    # Osada et al. 2002
    root = math.sqrt(r1)
    f, g = root * (1.0 - r2), root * r2
    a, b, c = surface.triangles[lights.shining[low]]
    v = surface.vertices
    e0, e1, e2 = v[b, 0] - v[a, 0], v[b, 1] - v[a, 1], v[b, 2] - v[a, 2]
    h0, h1, h2 = v[c, 0] - v[a, 0], v[c, 1] - v[a, 1], v[c, 2] - v[a, 2]
    n0, n1, n2 = e1 * h2 - e2 * h1, e2 * h0 - e0 * h2, e0 * h1 - e1 * h0
    length = math.sqrt(n0 * n0 + n1 * n1 + n2 * n2)
    point[0], point[1], point[2] = v[a, 0] + f * e0 + g * h0, v[a, 1] + f * e1 + g * h1, v[a, 2] + f * e2 + g * h2
    normal[0], normal[1], normal[2] = n0 / length, n1 / length, n2 / length
