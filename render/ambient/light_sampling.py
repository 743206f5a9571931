"""Lamps and shining objects as the kernels take them, and how a point on one is drawn.

    column          what it holds
    KIND            POINT, RECTANGLE or SHINING_OBJECT
    RADIANCE        R, G, B of the radiance; of a point light of the intensity
    CENTRE, HALF_X, HALF_Y, NORMAL    centre, half the sides, unit normal
    AREA            m^2
    FLUX            mean over the bands of radiance times area, or of the intensity
    SQUARED_RADIUS  m^2, of about the light's extent
    FIRST, END      of a shining object's triangles in `Lights.shining`

One of them is drawn with a probability that goes with FLUX / (squared distance + SQUARED_RADIUS): about its irradiance.
A rectangle shines, is seen and hides what is behind it on the side of its normal only; from behind it is not there.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numba
import numpy as np

from render.base.arrays import Float, Int
from render.base.vectors import Vector, along, cross, divided, dot, length, minus, row_vector
from render.material import record
from render.material.record import EMITTED, EMITTER
from render.scene.lights import PointLight
from render.scene.scene import Scene
from render.world.triangles import Surface, edges_of

KIND, RADIANCE, CENTRE, HALF_X, HALF_Y, NORMAL = 0, 1, 4, 7, 10, 13
AREA, FLUX, SQUARED_RADIUS, FIRST, END = 16, 17, 18, 19, 20
ROW = 21
POINT, RECTANGLE, SHINING_OBJECT = 0.0, 1.0, 2.0


class EmitterPoint(NamedTuple):
    """A point on a light with an area, or the point light itself."""

    point: Vector
    normal: Vector
    """Unit, on the side that shines; of a point light without meaning."""


class Lights(NamedTuple):
    """Every source of ambient light."""

    environment: Float
    """(3,) radiance in R, G, B."""
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
        row[CENTRE : CENTRE + 3], row[NORMAL : NORMAL + 3] = matrix[:3, 3], matrix[:3, 2]
        if isinstance(light, PointLight):
            row[KIND], row[RADIANCE : RADIANCE + 3], row[FLUX] = POINT, light.intensity, np.mean(light.intensity)
        else:
            row[KIND], row[RADIANCE : RADIANCE + 3] = RECTANGLE, light.radiance
            row[AREA], row[SQUARED_RADIUS] = light.width * light.height, (light.width**2 + light.height**2) / 4
            row[HALF_X : HALF_X + 3] = matrix[:3, 0] * light.width / 2
            row[HALF_Y : HALF_Y + 3] = matrix[:3, 1] * light.height / 2
            row[FLUX] = np.mean(light.radiance) * row[AREA]
        if row[FLUX] > 0.0:
            rows.append(row)
    rectangles = sum(row[KIND] == RECTANGLE for row in rows)
    light_of_material = np.full(len(surface.rows), -1, np.int32)
    shining, area_below = [np.zeros(0, np.int32)], [np.zeros(0)]
    for slot in np.flatnonzero(surface.rows[:, record.KIND] == EMITTER):
        found = np.flatnonzero(surface.object_id == slot).astype(np.int32)
        corners = surface.vertices[surface.triangles[found]]
        areas = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        radiance = surface.rows[slot, EMITTED : EMITTED + 3]
        if areas.sum() <= 0.0 or radiance.sum() <= 0.0:
            continue
        row, start = np.zeros(ROW), sum(len(part) for part in shining)
        low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
        row[KIND], row[RADIANCE : RADIANCE + 3] = SHINING_OBJECT, radiance
        row[CENTRE : CENTRE + 3], row[AREA] = (low + high) / 2, areas.sum()
        row[FLUX], row[SQUARED_RADIUS] = radiance.mean() * areas.sum(), np.sum((high - low) ** 2) / 4
        row[FIRST], row[END] = start, start + len(found)
        light_of_material[slot] = len(rows)
        rows.append(row)
        shining.append(found)
        area_below.append(np.cumsum(areas) / areas.sum())
    packed, environment = np.array(rows).reshape(-1, ROW), np.array(scene.environment.radiance, dtype=np.float64)
    triangles, shares = np.concatenate(shining), np.concatenate(area_below)
    return Lights(environment, packed, int(rectangles), triangles, shares, light_of_material)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def light_in_view(rows: Float, origin: Vector, direction: Vector, far: float) -> int:
    """The rectangle whose shining side a ray meets first, nearer than `far`; -1 for none."""
    seen = -1
    for k in range(rows.shape[0]):
        if rows[k, KIND] != RECTANGLE or dot(row_vector(rows, k, NORMAL), direction) >= 0.0:
            continue
        f, _ = distance_to_rectangle(rows, k, origin, direction)
        if not 0.0 < f < far:
            continue
        q = minus(along(origin, f, direction), row_vector(rows, k, CENTRE))
        half_x, half_y = row_vector(rows, k, HALF_X), row_vector(rows, k, HALF_Y)
        if abs(dot(half_x, q)) <= dot(half_x, half_x) and abs(dot(half_y, q)) <= dot(half_y, half_y):
            seen, far = k, f
    return seen


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def distance_to_rectangle(rows: Float, k: int, origin: Vector, direction: Vector) -> tuple[float, float]:
    """Distance along a ray to the plane of rectangle k, and its cosine there, positive where it meets the front."""
    normal = row_vector(rows, k, NORMAL)
    cosine = -dot(normal, direction)
    return dot(normal, minus(origin, row_vector(rows, k, CENTRE))) / cosine, cosine


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def light_importance(rows: Float, k: int, point: Vector) -> float:
    """About the irradiance that light k gives a point, up to a factor; 0 behind a rectangle."""
    to = minus(row_vector(rows, k, CENTRE), point)
    if rows[k, KIND] == RECTANGLE and dot(row_vector(rows, k, NORMAL), to) >= 0.0:
        return 0.0
    return rows[k, FLUX] / max(dot(to, to) + rows[k, SQUARED_RADIUS], 1e-30)


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def sample_light(rows: Float, point: Vector, r: float) -> tuple[int, float]:
    """A light for a point and its probability; -1: none shines there. r in [0, 1)."""
    if rows.shape[0] == 1:
        return 0, 1.0
    total = 0.0
    for k in range(rows.shape[0]):
        total += light_importance(rows, k, point)
    if total <= 0.0:
        return -1, 0.0
    chosen, remaining, own = -1, r * total, 0.0
    for k in range(rows.shape[0]):
        value = light_importance(rows, k, point)
        if value > 0.0:
            chosen, own = k, value
            remaining -= value
            if remaining < 0.0:
                break
    return chosen, own / total


@numba.njit(nogil=True, cache=True, error_model="numpy")
def light_probability(rows: Float, k: int, point: Vector) -> float:
    """With which `sample_light` draws light k for a point."""
    if rows.shape[0] == 1:
        return 1.0
    total = 0.0
    for j in range(rows.shape[0]):
        total += light_importance(rows, j, point)
    return light_importance(rows, k, point) / total if total > 0.0 else 0.0


@numba.njit(nogil=True, cache=True, error_model="numpy")
def sample_emitter_point(lights: Lights, surface: Surface, k: int, r1: float, r2: float) -> EmitterPoint:
    """A point of the shining object k, uniform by area."""
    light = lights.rows[k]
    low, high = int(light[FIRST]), int(light[END]) - 1
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
    a, ab, ac = edges_of(surface, lights.shining[low])
    normal = cross(ab, ac)
    return EmitterPoint(along(along(a, f, ab), g, ac), divided(normal, length(normal)))


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def sample_rectangle_point(rows: Float, k: int, r1: float, r2: float) -> EmitterPoint:
    """A point of rectangle k, uniform by area; of a point light, whose sides are 0, its place."""
    on_x = along(row_vector(rows, k, CENTRE), 2.0 * r1 - 1.0, row_vector(rows, k, HALF_X))
    return EmitterPoint(along(on_x, 2.0 * r2 - 1.0, row_vector(rows, k, HALF_Y)), row_vector(rows, k, NORMAL))
