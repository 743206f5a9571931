"""One bounce of the path tracer for ambient light: all paths of a wavefront meet their next surface together.

At each surface a lamp is sampled and connected by a shadow ray (NEE), and the path goes on as the BSDF is sampled.
Lamps with an area are found both ways, with MIS weights by the power heuristic (Veach 1997, 9.2.4). The environment,
the same from everywhere, is found by BSDF sampling, which no other pdf could better; point lights by NEE only. A
specular BSDF has no pdf: a light that it leads to has weight 1.

    surfaces that light met      1  lamp - surface - camera, what a plan calls direct      0  the lamp itself
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

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
    DIRECTION,
    EACH_SURFACE,
    FIRST_SURFACE,
    LAMP,
    LOBE,
    ON_LAMP,
    PathState,
    PixelSums,
    ShadowRays,
    accumulate,
    sequence_index,
)
from render.material.bsdf import ROW, SUBSURFACE, evaluate, is_boundary, is_diffuse, is_specular_row, pdf, sample
from render.sampling.low_discrepancy import pair
from render.world.surface_interaction import interaction
from render.world.triangles import Surface, plane_of, scattering, to_world

Float = NDArray[np.float64]
Float32 = NDArray[np.float32]
Int = NDArray[np.int32]

ROULETTE_AFTER = 2
"""Surfaces met before Russian roulette may end a path."""
MOST_SURVIVAL = 0.95
NOWHERE = 1e30
"""m; length of a shadow ray that looks for the environment."""


class PathScene(NamedTuple):
    """What the paths move in, and what decides them."""

    surface: Surface
    lights: Lights
    environment: Float
    """(3,) radiance."""
    table: Float32
    """`pair_table`."""
    seed: int
    pixels: Int
    """(m,) of the chunk."""
    centre: Float
    """(3,) that the ray engine's coordinates are relative to."""
    ray_epsilon: float
    """m, how far off a surface a ray begins."""
    max_depth: int
    """Surfaces that light may meet; after so many only lights are looked for."""
    clamp: float
    """The most radiance that a contribution by way of two and more surfaces may add."""


class Ray(NamedTuple):
    """A path's ray in float64: origin in the world, direction, throughput; and whose it is."""

    o0: float
    o1: float
    o2: float
    d0: float
    d1: float
    d2: float
    w0: float
    w1: float
    w2: float
    bsdf_pdf: float
    pixel_slot: int
    sequence: int
    sample: int
    base: int
    """First random dimension of the surface that it meets."""


class SurfacePoint(NamedTuple):
    """Where a path meets a surface: point and normal, which is turned towards the ray but for boundaries."""

    p0: float
    p1: float
    p2: float
    n0: float
    n1: float
    n2: float
    material: int
    diffuse: bool
    """Lambertian, shaded on its facet's normal: neither `wo` nor `frame` is needed."""


class Shading(NamedTuple):
    """Arrays that a kernel fills anew for every path."""

    row: Float
    """(ROW,) the material."""
    rho: Float
    """(3,) reflectance."""
    alpha: Float
    """(2,) roughness."""
    frame: Float
    """(3, 3) axes, one a row."""
    wo: Float
    wi: Float
    f: Float
    """(3,) of a BSDF, or of a sample's f cos / pdf."""
    lamp: Float
    lamp_normal: Float


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def sincos_2pi(r: float) -> tuple[float, float]:
    """Cosine and sine of 2 pi r, r in [0, 1], to 2e-9, by Taylor's series about the nearest quarter: half the time."""
    quarter = int(4.0 * r + 0.5)
    x = (4.0 * r - quarter) * (0.5 * math.pi)
    q = x * x
    c = 1.0 - q / 2 * (1.0 - q / 12 * (1.0 - q / 30 * (1.0 - q / 56 * (1.0 - q / 90))))
    s = x * (1.0 - q / 6 * (1.0 - q / 20 * (1.0 - q / 42 * (1.0 - q / 72))))
    if quarter & 1:
        c, s = -s, c
    return (-c, -s) if quarter & 2 else (c, s)


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def cosine_direction(r1: float, r2: float, n0: float, n1: float, n2: float) -> tuple[float, float, float, float]:
    """A cosine-distributed direction about the unit normal n, by Duff et al. 2017, and its cosine."""
    radius = math.sqrt(r1)
    x, y = sincos_2pi(r2)
    x, y, z = radius * x, radius * y, math.sqrt(1.0 - r1)
    sign = 1.0 if n2 >= 0.0 else -1.0
    c = -1.0 / (sign + n2)
    b = n0 * n1 * c
    t0 = x * (1.0 + sign * n0 * n0 * c) + y * b + z * n0
    t1 = x * sign * b + y * (sign + n1 * n1 * c) + z * n1
    return t0, t1, -x * sign * n0 - y * n1 + z * n2, z


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
def ray_of(scene: PathScene, paths: PathState, r: int, base: int) -> Ray:
    """Path r's ray; base: first random dimension of the surface that it meets."""
    origin, direction, throughput = paths.origin[r], paths.direction[r], paths.throughput[r]
    pixel_slot = paths.pixel_slot[r]
    return Ray(
        origin[0] + scene.centre[0],
        origin[1] + scene.centre[1],
        origin[2] + scene.centre[2],
        float(direction[0]),
        float(direction[1]),
        float(direction[2]),
        float(throughput[0]),
        float(throughput[1]),
        float(throughput[2]),
        float(paths.bsdf_pdf[r]),
        pixel_slot,
        sequence_index(scene.pixels, pixel_slot),
        paths.sample[r],
        base,
    )


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
def sample_bsdf(scene: PathScene, shading: Shading, ray: Ray, x: SurfacePoint, choice: float) -> tuple[Ray, float, int]:
    """The next ray from x with its throughput, the side of the surface that it begins on, and the medium it is in.

    Its `bsdf_pdf` is 0 where the path ends, -1 where no light that it meets was connected to.
    """
    r1, r2 = pair(scene.table, scene.seed, ray.sequence, ray.sample, ray.base + DIRECTION)
    side, medium = scene.ray_epsilon, -1
    if x.diffuse:
        t0, t1, t2, density = cosine_direction(r1, r2, x.n0, x.n1, x.n2)
        density *= 1.0 / math.pi
        w0, w1, w2 = ray.w0 * shading.rho[0], ray.w1 * shading.rho[1], ray.w2 * shading.rho[2]
    else:
        wo, wi, f = shading.wo, shading.wi, shading.f
        density = sample(shading.row, shading.rho, wo[0], wo[1], wo[2], choice, r1, r2, wi, f)
        if density != 0.0:
            leaves = wi[2]
            to_world(shading.frame, wi)
            facing = x.n0 * wi[0] + x.n1 * wi[1] + x.n2 * wi[2]
            side = scene.ray_epsilon if facing > 0.0 else -scene.ray_epsilon
            if facing * leaves <= 0.0:
                density = 0.0
            elif shading.row[0] == SUBSURFACE and leaves < 0.0:
                medium, density = x.material, -1.0
        t0, t1, t2 = wi[0], wi[1], wi[2]
        w0, w1, w2 = ray.w0 * f[0], ray.w1 * f[1], ray.w2 * f[2]
    if not w0 + w1 + w2 > 0.0:
        density = 0.0
    onward = Ray(x.p0, x.p1, x.p2, t0, t1, t2, w0, w1, w2, density, ray.pixel_slot, ray.sequence, ray.sample, ray.base)
    return onward, side, medium


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


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def keep(
    scene: PathScene, paths: PathState, row: int, ray: Ray, x: SurfacePoint, side: float, survival: float, medium: int
) -> None:
    """Write a path that goes on; `survival`: the probability with which it did."""
    paths.origin[row, 0] = x.p0 - scene.centre[0] + side * x.n0
    paths.origin[row, 1] = x.p1 - scene.centre[1] + side * x.n1
    paths.origin[row, 2] = x.p2 - scene.centre[2] + side * x.n2
    paths.direction[row, 0], paths.direction[row, 1], paths.direction[row, 2] = ray.d0, ray.d1, ray.d2
    paths.throughput[row, 0] = ray.w0 / survival
    paths.throughput[row, 1] = ray.w1 / survival
    paths.throughput[row, 2] = ray.w2 / survival
    paths.bsdf_pdf[row], paths.pixel_slot[row], paths.sample[row] = ray.bsdf_pdf, ray.pixel_slot, ray.sample
    paths.medium[row] = medium


def _bounce_kernel(glossy: bool) -> Any:
    """The kernel of one bounce; compiled apart for scenes without gloss, which would pay for the scattering code."""

    @numba.njit(nogil=True, cache=True, error_model="numpy")
    def bounce(
        scene: PathScene, depth: int, triangle: Int, paths: PathState, rays: ShadowRays, film: PixelSums
    ) -> tuple[int, int]:
        """The triangles (n,) that the paths meet, -1 for none: accumulates what is seen, writes shadow rays.

        depth: surfaces met before this one. Returns the number of paths that go on (the first rows of paths) and of
        shadow rays.
        """
        surface, lights = scene.surface, scene.lights
        # where no object shines, a shadow ray is enough to find out what the last surface sees
        last = depth + 1 == scene.max_depth and lights.shining.shape[0] == 0
        clamp = scene.clamp if depth > 1 else np.inf
        base = FIRST_SURFACE + EACH_SURFACE * depth
        shading = Shading(
            np.empty(ROW),
            np.empty(3),
            np.empty(2),
            np.empty((3, 3)),
            np.empty(3),
            np.empty(3),
            np.empty(3),
            np.empty(3),
            np.empty(3),
        )
        row, rho, alpha, frame, wo = shading.row, shading.rho, shading.alpha, shading.frame, shading.wo
        going = count = 0
        for r in range(triangle.shape[0]):
            t, ray = triangle[r], ray_of(scene, paths, r, base)
            distance, cosine = np.inf, 0.0
            n0 = n1 = n2 = p0 = p1 = p2 = 0.0
            if t >= 0:
                a0, a1, a2, n0, n1, n2 = plane_of(surface, t)
                cosine = n0 * ray.d0 + n1 * ray.d1 + n2 * ray.d2
                if cosine == 0.0:
                    continue
                distance = (n0 * (a0 - ray.o0) + n1 * (a1 - ray.o1) + n2 * (a2 - ray.o2)) / cosine
                p0, p1, p2 = ray.o0 + distance * ray.d0, ray.o1 + distance * ray.d1, ray.o2 + distance * ray.d2
            k, mis_weight = lamp_on_ray(lights, ray, distance)
            if k >= 0:
                accumulate_emission(film, ray, clamp, mis_weight, lights.rows[k].rgb)
                continue
            if t < 0:
                accumulate_emission(film, ray, clamp, 1.0, scene.environment)
                continue
            lobe_choice = blend_choice = 0.0
            if glossy or surface.second[surface.object_id[t]] >= 0:
                lobe_choice, blend_choice = pair(scene.table, scene.seed, ray.sequence, ray.sample, base + LOBE)
            if glossy:
                material = interaction(surface, t, p0, p1, p2, n0, n1, n2, blend_choice, rho, alpha, frame)
                for column in range(ROW):
                    row[column] = surface.rows[material, column]
                row[1], row[2] = alpha[0], alpha[1]
            else:
                material = scattering(surface, t, p0, p1, p2, blend_choice, rho)
            k = lights.light_of_material[material]
            if k >= 0 and cosine < 0.0:
                mis_weight = bsdf_mis_weight(lights, k, ray.bsdf_pdf, ray.o0, ray.o1, ray.o2, distance, -cosine)
                accumulate_emission(film, ray, clamp, mis_weight, lights.rows[k].rgb)
            if depth >= scene.max_depth:
                continue
            diffuse = not glossy or (is_diffuse(row) and surface.detail[material] == 0)
            if cosine > 0.0 and (diffuse or not is_boundary(row)):
                # all but boundaries are turned towards the ray; a boundary's own normal tells inside from outside
                n0, n1, n2 = -n0, -n1, -n2
                if not diffuse:
                    for axis in range(3):
                        frame[0, axis], frame[2, axis] = -frame[0, axis], -frame[2, axis]
            if not diffuse:
                for axis in range(3):
                    wo[axis] = -(frame[axis, 0] * ray.d0 + frame[axis, 1] * ray.d1 + frame[axis, 2] * ray.d2)
                # seen from one side of the facet and of the shading normal, or light from behind leaks through
                if wo[2] * (n0 * ray.d0 + n1 * ray.d1 + n2 * ray.d2) >= 0.0:
                    continue
            x = SurfacePoint(p0, p1, p2, n0, n1, n2, material, diffuse)
            lamp_choice = survival_choice = 0.0
            if lights.rows.shape[0] > 1 or depth + 1 >= ROULETTE_AFTER:
                lamp_choice, survival_choice = pair(scene.table, scene.seed, ray.sequence, ray.sample, base + LAMP)
            if lights.rows.shape[0] > 0 and (diffuse or not is_specular_row(row)):
                count = connect_to_light(scene, shading, ray, x, lamp_choice, rays, count)
            onward, side, medium = sample_bsdf(scene, shading, ray, x, lobe_choice)
            if onward.bsdf_pdf == 0.0:
                continue
            if last:
                count = look_for_light(scene, onward, x, side, rays, count)
                continue
            survival = 1.0
            if depth + 1 >= ROULETTE_AFTER:
                survival = min(MOST_SURVIVAL, max(onward.w0, onward.w1, onward.w2))
                if survival_choice >= survival:
                    continue
            keep(scene, paths, going, onward, x, side, survival, medium)
            going += 1
        return going, count

    return bounce


bounce_diffuse, bounce_glossy = _bounce_kernel(False), _bounce_kernel(True)
