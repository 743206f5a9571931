"""Light that a path of ambient light meets or is connected to (NEE), with MIS weights by the power heuristic."""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from render.ambient.light_sampling import (
    AREA,
    KIND,
    POINT,
    RADIANCE,
    SHINING_OBJECT,
    EmitterPoint,
    distance_to_rectangle,
    light_in_view,
    light_probability,
)
from render.ambient.path_vertex import BsdfValue, Continued, Path, Vertex
from render.base.arrays import Float
from render.base.vectors import Vector, along, dot, length, minus, row_vector, scaled, times

BEYOND_ALL = 1e30
"""Length, m, of a shadow ray to the environment."""


class LightSample(NamedTuple):
    """A point drawn on a light, as a vertex sees it."""

    k: int
    """Row of the light."""
    direction: Vector
    distance: float
    weight: float
    """1 / pdf, sr; of a point light 1 / (distance^2 P), P its probability; 0: none shines here."""
    pdf: float
    """Of the direction, 1/sr; 0: no direction can be drawn in another way, as of a point light."""


class Connection(NamedTuple):
    """What NEE found at a vertex, before its shadow ray is traced."""

    brings: bool
    """There is something to bring."""
    direction: Vector
    distance: float
    radiance: Vector
    """That the pixel gets."""
    side: float
    """Of the vertex's normal that the light is on: 1 or -1."""
    interior: int


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def power_heuristic(used: float, other: float) -> float:
    """MIS weight of a sample by its own pdf and the other technique's (Veach 1997, 9.2.3)."""
    return used * used / (used * used + other * other)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def bsdf_mis_weight(rows: Float, k: int, bsdf_pdf: float, origin: Vector, distance: float, cosine: float) -> float:
    """MIS weight of light k that a ray, drawn with `bsdf_pdf`, met at a distance under a cosine."""
    light_pdf = light_probability(rows, k, origin) * distance * distance / (cosine * rows[k, AREA])
    return power_heuristic(bsdf_pdf, light_pdf)


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def emission(rows: Float, k: int, path: Path, distance: float, cosine: float) -> Vector:
    """What light k, met at a distance under a cosine, brings to the pixel, MIS-weighted."""
    mis_weight = 1.0
    if path.bsdf_pdf > 0.0:
        mis_weight = bsdf_mis_weight(rows, k, path.bsdf_pdf, path.origin, distance, cosine)
    return times(scaled(mis_weight, path.throughput), row_vector(rows, k, RADIANCE))


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def light_sample(
    rows: Float, k: int, probability: float, emitter: EmitterPoint, point: Vector, ray_epsilon: float
) -> LightSample:
    """A point on light k, which was drawn with a probability, as it is seen from a point."""
    # a ray ends before the triangle that shines, though it starts beside the point
    gap = 2.0 * ray_epsilon if rows[k, KIND] == SHINING_OBJECT else 0.0
    to = minus(along(emitter.point, gap, emitter.normal), point)
    distance = length(to)
    scale = 1.0 / distance
    direction = scaled(scale, to)
    weight, light_pdf = scale * scale / probability, 0.0
    if rows[k, KIND] != POINT:
        cosine = -dot(emitter.normal, direction)
        weight *= max(cosine, 0.0) * rows[k, AREA]
        light_pdf = probability * distance * distance / (cosine * rows[k, AREA])
    return LightSample(k, direction, distance, weight, light_pdf)


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def connect_to_light(rows: Float, rectangles: int, light: LightSample, v: Vertex, bsdf: BsdfValue) -> Connection:
    """NEE: what a point on a light brings to the pixel, MIS-weighted, if no object is between."""
    f, factor = bsdf.f, light.weight * bsdf.cosine
    if light.pdf > 0.0:
        factor *= power_heuristic(light.pdf, bsdf.pdf)
    brings = factor * (f[0] + f[1] + f[2]) > 0.0
    if brings and (rectangles > 1 or (rectangles == 1 and rows[light.k, AREA] == 0.0)):
        # a lamp may stand before this one
        brings = light_in_view(rows, v.point, light.direction, light.distance * (1.0 - 1e-6)) < 0
    radiance = times(times(scaled(factor, v.throughput), f), row_vector(rows, light.k, RADIANCE))
    side = 1.0 if dot(v.normal, light.direction) > 0.0 else -1.0
    return Connection(brings, light.direction, light.distance, radiance, side, bsdf.interior)


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def light_beyond(
    rows: Float, rectangles: int, environment: Vector, v: Vertex, on: Continued, bsdf_pdf: float
) -> Connection:
    """What a path brings from a lamp or the environment, MIS-weighted, if it meets no other object."""
    seen, distance = environment, BEYOND_ALL
    if rectangles > 0:
        k = light_in_view(rows, v.point, on.direction, np.inf)
        if k >= 0:
            distance, cosine = distance_to_rectangle(rows, k, v.point, on.direction)
            mis_weight = 1.0
            if bsdf_pdf > 0.0:
                mis_weight = bsdf_mis_weight(rows, k, bsdf_pdf, v.point, distance, cosine)
            seen = scaled(mis_weight, row_vector(rows, k, RADIANCE))
    radiance = times(on.throughput, seen)
    brings = radiance[0] + radiance[1] + radiance[2] != 0.0
    return Connection(brings, on.direction, distance, radiance, on.side, on.interior)
