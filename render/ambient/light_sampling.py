"""Lamps and shining objects as the kernels take them, and how a point on one is drawn.

A light is drawn with a probability that follows about its irradiance at the point: importance / (d^2 + reach^2). A
rectangle shines, is seen and hides what is behind it on the side of its normal only; from behind it is not there.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from render.material.bsdf import EMITTED, EMITTER
from render.scene.lights import PointLight
from render.scene.scene import Scene
from render.world.triangles import Surface

Float = NDArray[np.float64]
Int = NDArray[np.int32]
Records = NDArray[np.void]
Record = Any
"""One of `Records`: numba reads its fields in place."""

POINT, RECTANGLE, SHINING_OBJECT = 0, 1, 2
LIGHT = np.dtype(
    [
        ("rgb", "f8", 3),  # radiance W/(m^2 sr), of a point light intensity W/sr
        ("centre", "f8", 3),
        ("half_x", "f8", 3),  # half axes of a rectangle
        ("half_y", "f8", 3),
        ("normal", "f8", 3),
        ("area", "f8"),  # m^2; 0: a point
        ("importance", "f8"),  # irradiance at 1 m, about
        ("square_reach", "f8"),  # m^2, of the half diagonal
        ("kind", "i4"),
        ("first", "i4"),  # triangles of a shining object, of `Lights.shining`
        ("end", "i4"),
    ],
    align=True,
)


class Lights(NamedTuple):
    """Every source but the environment."""

    rows: Records
    """(l,) LIGHT."""
    rectangles: int
    """The number of rectangles: no ray need look for them where there are none."""
    shining: Int
    """(e,) the triangles that shine, object by object."""
    area_below: Float
    """(e,) the area of a shining object's triangles up to and with this one, over its whole."""
    light_of_material: Int
    """(s,) the light that is the object with this material; -1: it does not shine."""


def pack_lights(scene: Scene, surface: Surface) -> Lights:
    """The scene's lamps, then its shining objects."""
    rows = []
    for light in scene.lights:
        row = np.zeros((), LIGHT)
        matrix = light.T_world_light.matrix
        row["centre"], row["normal"] = matrix[:3, 3], matrix[:3, 2]
        if isinstance(light, PointLight):
            row["kind"], row["rgb"], row["importance"] = POINT, light.intensity, np.mean(light.intensity)
        else:
            row["kind"], row["rgb"], row["area"] = RECTANGLE, light.radiance, light.width * light.height
            row["half_x"], row["half_y"] = matrix[:3, 0] * light.width / 2, matrix[:3, 1] * light.height / 2
            row["importance"] = np.mean(light.radiance) * row["area"]
            row["square_reach"] = (light.width**2 + light.height**2) / 4
        if row["importance"] > 0.0:
            rows.append(row)
    rectangles = sum(int(row["kind"]) == RECTANGLE for row in rows)
    light_of_material = np.full(len(surface.rows), -1, np.int32)
    shining, below = [np.zeros(0, np.int32)], [np.zeros(0)]
    for slot in np.flatnonzero(surface.rows[:, 0] == EMITTER):
        found = np.flatnonzero(surface.object_id == slot).astype(np.int32)
        corners = surface.vertices[surface.triangles[found]]
        areas = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        radiance = surface.rows[slot, EMITTED : EMITTED + 3]
        if areas.sum() <= 0.0 or radiance.sum() <= 0.0:
            continue
        row, start = np.zeros((), LIGHT), sum(len(part) for part in shining)
        low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
        row["kind"], row["rgb"], row["centre"], row["area"] = SHINING_OBJECT, radiance, (low + high) / 2, areas.sum()
        row["importance"], row["square_reach"] = radiance.mean() * areas.sum(), np.sum((high - low) ** 2) / 4
        row["first"], row["end"] = start, start + len(found)
        light_of_material[slot] = len(rows)
        rows.append(row)
        shining.append(found)
        below.append(np.cumsum(areas) / areas.sum())
    packed = np.array(rows, LIGHT)
    return Lights(packed, rectangles, np.concatenate(shining), np.concatenate(below), light_of_material)


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def rectangle_distance(
    light: Record, o0: float, o1: float, o2: float, d0: float, d1: float, d2: float
) -> tuple[float, float]:
    """Where the ray o + f d meets a rectangle's plane, f, and the cosine under which it comes to its shining side."""
    facing = light.normal[0] * d0 + light.normal[1] * d1 + light.normal[2] * d2
    f = light.normal[0] * (light.centre[0] - o0) + light.normal[1] * (light.centre[1] - o1)
    f = (f + light.normal[2] * (light.centre[2] - o2)) / facing
    return f, -facing


@numba.njit(nogil=True, cache=True, error_model="numpy")
def light_in_view(rows: Records, o0: float, o1: float, o2: float, d0: float, d1: float, d2: float, far: float) -> int:
    """The rectangle whose shining side the ray o + f d meets first, before f = far; -1 for none."""
    seen = -1
    for k in range(rows.shape[0]):
        light = rows[k]
        if light.kind != RECTANGLE:
            continue
        f, cosine = rectangle_distance(light, o0, o1, o2, d0, d1, d2)
        if cosine <= 0.0 or not 0.0 < f < far:
            continue
        x, y, q0 = light.half_x, light.half_y, o0 + f * d0 - light.centre[0]
        q1, q2 = o1 + f * d1 - light.centre[1], o2 + f * d2 - light.centre[2]
        within_x = abs(x[0] * q0 + x[1] * q1 + x[2] * q2) <= x[0] ** 2 + x[1] ** 2 + x[2] ** 2
        within_y = abs(y[0] * q0 + y[1] * q1 + y[2] * q2) <= y[0] ** 2 + y[1] ** 2 + y[2] ** 2
        if within_x and within_y:
            seen, far = k, f
    return seen


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def light_importance(light: Record, p0: float, p1: float, p2: float) -> float:
    """About the irradiance that one light gives the point p, up to a factor; 0 behind a rectangle."""
    t0, t1, t2 = light.centre[0] - p0, light.centre[1] - p1, light.centre[2] - p2
    if light.kind == RECTANGLE and light.normal[0] * t0 + light.normal[1] * t1 + light.normal[2] * t2 >= 0.0:
        return 0.0
    return light.importance / max(t0 * t0 + t1 * t1 + t2 * t2 + light.square_reach, 1e-30)


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def sample_light(rows: Records, p0: float, p1: float, p2: float, r: float) -> tuple[int, float]:
    """A light for the point p and its probability; -1: none shines there. r in [0, 1)."""
    if rows.shape[0] == 1:
        return 0, 1.0
    total = 0.0
    for k in range(rows.shape[0]):
        total += light_importance(rows[k], p0, p1, p2)
    if total <= 0.0:
        return -1, 0.0
    chosen, remaining, own = -1, r * total, 0.0
    for k in range(rows.shape[0]):
        value = light_importance(rows[k], p0, p1, p2)
        if value > 0.0:
            chosen, own = k, value
            remaining -= value
            if remaining < 0.0:
                break
    return chosen, own / total


@numba.njit(nogil=True, cache=True, error_model="numpy")
def light_probability(rows: Records, k: int, p0: float, p1: float, p2: float) -> float:
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
    low, high = light.first, light.end - 1
    while low < high:
        middle = (low + high) // 2
        if lights.area_below[middle] <= r1:
            low = middle + 1
        else:
            high = middle
    before = lights.area_below[low - 1] if low > light.first else 0.0
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
