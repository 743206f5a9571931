"""Connecting a path to the light: next event estimation, and the MIS weights of light that is met by BSDF sampling."""

from __future__ import annotations

import math

import numba
import numpy as np
from numpy.typing import NDArray

from render.ambient.bounce_state import PathScene, Ray, Shading, SurfacePoint
from render.ambient.light_sampling import (
    POINT,
    SHINING_OBJECT,
    Lights,
    light_in_view,
    light_probability,
    rectangle_distance,
    sample_emitter_point,
    sample_light,
)
from render.ambient.path_state import (
    ON_LAMP,
    PixelSums,
    ShadowRays,
    accumulate,
)
from render.material.bsdf import SUBSURFACE, evaluate, pdf
from render.sampling.low_discrepancy import pair

Float = NDArray[np.float64]
Float32 = NDArray[np.float32]
Int = NDArray[np.int32]

NOWHERE = 1e30
"""m; length of a shadow ray that looks for the environment."""


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def power_heuristic(own: float, other: float) -> float:
    """MIS weight of a sample by its own pdf and that of the other technique (Veach 1997, eq. 9.13, beta = 2)."""
    return own * own / (own * own + other * other)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def bsdf_mis_weight(
    lights: Lights, k: int, bsdf_pdf: float, o0: float, o1: float, o2: float, distance: float, cosine: float
) -> float:
    """MIS weight of light k that a ray from o, sampled with `bsdf_pdf`, met at a distance under a cosine."""
    if bsdf_pdf <= 0.0:
        return 1.0
    light_pdf = light_probability(lights.rows, k, o0, o1, o2) * distance * distance / (cosine * lights.rows[k].area)
    return power_heuristic(bsdf_pdf, light_pdf)


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def lamp_on_ray(lights: Lights, ray: Ray, far: float) -> tuple[int, float]:
    """The rectangle that a ray meets before `far`, and its MIS weight; -1: none."""
    if lights.rectangles == 0:
        return -1, 0.0
    k = light_in_view(lights.rows, ray.o0, ray.o1, ray.o2, ray.d0, ray.d1, ray.d2, far)
    if k < 0:
        return -1, 0.0
    if not ray.bsdf_pdf > 0.0:
        return k, 1.0
    at, cosine = rectangle_distance(lights.rows[k], ray.o0, ray.o1, ray.o2, ray.d0, ray.d1, ray.d2)
    return k, bsdf_mis_weight(lights, k, ray.bsdf_pdf, ray.o0, ray.o1, ray.o2, at, cosine)


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def accumulate_emission(film: PixelSums, ray: Ray, clamp: float, mis_weight: float, radiance: Float) -> None:
    """Add the radiance (3,) that a path has met."""
    w = mis_weight
    accumulate(
        film, ray.pixel_slot, clamp, w * ray.w0 * radiance[0], w * ray.w1 * radiance[1], w * ray.w2 * radiance[2]
    )


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def lamp_point(
    scene: PathScene, shading: Shading, k: int, ray: Ray, x: SurfacePoint
) -> tuple[float, float, float, float, float]:
    """A point of light k as seen from x: unit direction, distance, and cosine at the light (of a point light 1)."""
    light = scene.lights.rows[k]
    r1, r2 = pair(scene.table, scene.seed, ray.sequence, ray.sample, ray.base + ON_LAMP)
    if light.kind == SHINING_OBJECT:
        sample_emitter_point(scene.lights, scene.surface, k, r1, r2, shading.lamp, shading.lamp_normal)
        # the ray ends before the shining triangle, though it starts beside x
        away = 2.0 * scene.ray_epsilon
        e0, e1, e2 = shading.lamp_normal[0], shading.lamp_normal[1], shading.lamp_normal[2]
        t0 = shading.lamp[0] + away * e0 - x.p0
        t1 = shading.lamp[1] + away * e1 - x.p1
        t2 = shading.lamp[2] + away * e2 - x.p2
    else:
        r1, r2 = 2.0 * r1 - 1.0, 2.0 * r2 - 1.0
        t0 = light.centre[0] + r1 * light.half_x[0] + r2 * light.half_y[0] - x.p0
        t1 = light.centre[1] + r1 * light.half_x[1] + r2 * light.half_y[1] - x.p1
        t2 = light.centre[2] + r1 * light.half_x[2] + r2 * light.half_y[2] - x.p2
        e0, e1, e2 = light.normal[0], light.normal[1], light.normal[2]
    distance = math.sqrt(t0 * t0 + t1 * t1 + t2 * t2)
    scale = 1.0 / distance
    t0, t1, t2 = scale * t0, scale * t1, scale * t2
    return t0, t1, t2, distance, -(e0 * t0 + e1 * t1 + e2 * t2)


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def connect_to_light(
    scene: PathScene, shading: Shading, ray: Ray, x: SurfacePoint, choice: float, rays: ShadowRays, count: int
) -> int:
    """NEE: sample a lamp for x by `choice`, and a point on it -> shadow ray `count`. Returns the number of rays."""
    rows, f = scene.lights.rows, shading.f
    k, probability = sample_light(rows, x.p0, x.p1, x.p2, choice)
    if k < 0:
        return count
    light = rows[k]
    t0, t1, t2, distance, lamp_cosine = lamp_point(scene, shading, k, ray, x)
    facing = x.n0 * t0 + x.n1 * t1 + x.n2 * t2
    # 1 / pdf, in area, times the geometry term
    weight = 1.0 / distance * (1.0 / distance) / probability
    light_pdf = bsdf_pdf = 0.0
    if light.kind != POINT:
        weight *= max(lamp_cosine, 0.0) * light.area
        light_pdf = probability * distance * distance / (lamp_cosine * light.area)
    if x.diffuse:
        weight *= max(facing, 0.0)
        for band in range(3):
            f[band] = shading.rho[band] / math.pi
        bsdf_pdf = facing / math.pi
    elif weight > 0.0:
        wo, wi, frame = shading.wo, shading.wi, shading.frame
        for axis in range(3):
            wi[axis] = frame[axis, 0] * t0 + frame[axis, 1] * t1 + frame[axis, 2] * t2
        # on one side of the facet and of the shading normal, and not through a medium
        open_side = wi[2] * facing > 0.0 and (shading.row[0] != SUBSURFACE or wi[2] > 0.0)
        weight *= abs(wi[2]) if open_side else 0.0
        evaluate(shading.row, shading.rho, wo[0], wo[1], wo[2], wi[0], wi[1], wi[2], f)
        bsdf_pdf = pdf(shading.row, shading.rho, wo[0], wo[1], wo[2], wi[0], wi[1], wi[2])
    if weight > 0.0 and light.kind != POINT:
        weight *= power_heuristic(light_pdf, bsdf_pdf)
    if not weight * (f[0] + f[1] + f[2]) > 0.0:
        return count
    rectangles = scene.lights.rectangles
    # lamps hide each other
    others = rectangles > 1 or (rectangles == 1 and light.area == 0.0)
    if others and light_in_view(rows, x.p0, x.p1, x.p2, t0, t1, t2, distance * (1.0 - 1e-6)) >= 0:
        return count
    side = scene.ray_epsilon if facing > 0.0 else -scene.ray_epsilon
    set_shadow_ray(rays, count, x, side, scene.centre, t0, t1, t2)
    rays.far[count], rays.pixel_slot[count] = distance, ray.pixel_slot
    rays.radiance[count, 0] = weight * ray.w0 * f[0] * light.rgb[0]
    rays.radiance[count, 1] = weight * ray.w1 * f[1] * light.rgb[1]
    rays.radiance[count, 2] = weight * ray.w2 * f[2] * light.rgb[2]
    return count + 1


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def set_shadow_ray(
    rays: ShadowRays, count: int, x: SurfacePoint, side: float, centre: Float, t0: float, t1: float, t2: float
) -> None:
    """Shadow ray `count` from x, moved by `side` along the normal, in direction t."""
    rays.origin[count, 0] = x.p0 - centre[0] + side * x.n0
    rays.origin[count, 1] = x.p1 - centre[1] + side * x.n1
    rays.origin[count, 2] = x.p2 - centre[2] + side * x.n2
    rays.direction[count, 0], rays.direction[count, 1], rays.direction[count, 2] = t0, t1, t2


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def look_for_light(scene: PathScene, ray: Ray, x: SurfacePoint, side: float, rays: ShadowRays, count: int) -> int:
    """What a last ray meets needs no more than a shadow ray: a lamp, or the environment. Returns their number."""
    far, k, mis_weight = NOWHERE, -1, 1.0
    l0, l1, l2 = scene.environment[0], scene.environment[1], scene.environment[2]
    if scene.lights.rectangles > 0:
        k = light_in_view(scene.lights.rows, ray.o0, ray.o1, ray.o2, ray.d0, ray.d1, ray.d2, np.inf)
        if k >= 0:
            light = scene.lights.rows[k]
            far, cosine = rectangle_distance(light, ray.o0, ray.o1, ray.o2, ray.d0, ray.d1, ray.d2)
            mis_weight = bsdf_mis_weight(scene.lights, k, ray.bsdf_pdf, ray.o0, ray.o1, ray.o2, far, cosine)
            l0, l1, l2 = mis_weight * light.rgb[0], mis_weight * light.rgb[1], mis_weight * light.rgb[2]
    l0, l1, l2 = ray.w0 * l0, ray.w1 * l1, ray.w2 * l2
    if l0 + l1 + l2 == 0.0:
        return count
    set_shadow_ray(rays, count, x, side, scene.centre, ray.d0, ray.d1, ray.d2)
    rays.radiance[count, 0], rays.radiance[count, 1], rays.radiance[count, 2] = l0, l1, l2
    rays.far[count], rays.pixel_slot[count] = far, ray.pixel_slot
    return count + 1
