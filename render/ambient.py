"""Ambient light that met one surface: environment, point and rectangular lights, with shadows.

Each pixel sample is a camera ray, one ray to the environment as the material scatters and one ray to each lamp. The
random numbers of a pixel form an additive-recurrence (Kronecker) sequence with a random start, which converges faster
than independent ones.
"""

from __future__ import annotations

import math
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from render.bsdf import LAMBERTIAN, evaluate, sample
from render.camera import Camera
from render.camera_rays import camera_rays
from render.embree import CHUNK
from render.lights import PointLight
from render.random import uniform
from render.scene import Scene
from render.surface import Surface, has_gloss, scattering, to_local, to_world
from render.threads import Cancel, Progress, map_chunks
from render.world import World

Float = NDArray[np.float64]
Float32 = NDArray[np.float32]
Int = NDArray[np.int32]

POINT, RECTANGLE = 0.0, 1.0
# 1/g and 1/g^2 of the plastic number g: the R2 sequence (Roberts 2018)
R2_X, R2_Y = 0.7548776662466927, 0.5698402909980532


def pack_lights(scene: Scene) -> Float:
    """(l, 20) kind, RGB, centre, half x axis, half y axis, normal, area."""
    rows = np.zeros((len(scene.lights), 20))
    for row, light in zip(rows, scene.lights, strict=True):
        matrix = light.T_world_light.matrix
        row[4:7], row[13:16] = matrix[:3, 3], matrix[:3, 2]
        if isinstance(light, PointLight):
            row[0], row[1:4] = POINT, light.intensity
        else:
            row[0], row[1:4], row[16] = RECTANGLE, light.radiance, light.width * light.height
            row[7:10], row[10:13] = matrix[:3, 0] * light.width / 2, matrix[:3, 1] * light.height / 2
    return rows


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _fraction(x: float) -> float:
    return x - math.floor(x)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def cosine_direction(r1: float, r2: float, n0: float, n1: float, n2: float, out: Float) -> None:
    """A cosine-distributed direction (3,) about the unit normal n; the basis is that of Duff et al. 2017."""
    radius, angle = math.sqrt(r1), 2.0 * math.pi * r2
    x, y, z = radius * math.cos(angle), radius * math.sin(angle), math.sqrt(1.0 - r1)
    sign = 1.0 if n2 >= 0.0 else -1.0
    c = -1.0 / (sign + n2)
    b = n0 * n1 * c
    out[0] = x * (1.0 + sign * n0 * n0 * c) + y * b + z * n0
    out[1] = x * sign * b + y * (sign + n1 * n1 * c) + z * n1
    out[2] = -x * sign * n0 - y * n1 + z * n2


@numba.njit(nogil=True, cache=True, error_model="numpy")
def light_in_view(lights: Float, o0: float, o1: float, o2: float, d0: float, d1: float, d2: float, far: float) -> int:
    """The rectangle whose shining side the ray o + f d meets first, before f = far; -1 for none."""
    seen = -1
    for k in range(lights.shape[0]):
        light = lights[k]
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


def _shade_kernel(glossy: bool) -> Any:
    """The shading kernel; compiled apart for scenes without gloss, where the scattering code would cost two thirds."""

    @numba.njit(nogil=True, cache=True, error_model="numpy")
    def shade(
        surface: Surface,
        T_world_camera: Float,
        pixels: Int,
        cells: int,
        seed: int,
        triangle: Int,
        normalised: Float,
        environment: Float,
        lights: Float,
        centre: Float,
        surface_offset: float,
        image: Float32,
        origins: Float32,
        directions: Float32,
        far: Float32,
        light_out: Float32,
        owner: Int,
    ) -> int:
        """Add what the camera rays see of the lights to image (p, 3); write the shadow rays with their worth.

        Returns the number of shadow rays; light_out (.., 3) is what a clear one adds to its pixel `owner`.
        """
        m, vertices, triangles = T_world_camera, surface.vertices, surface.triangles
        n = cells * cells
        share = 1.0 / n
        o, towards, f, frame = np.empty(3), np.empty(3), np.empty(3), np.empty((3, 3))
        choice = 0.0
        rho, starts = np.empty(3), np.empty((lights.shape[0] + 1, 2))
        has_environment = environment[0] + environment[1] + environment[2] > 0.0
        o0, o1, o2 = m[0, 3], m[1, 3], m[2, 3]
        count = 0
        for r in range(triangle.shape[0]):
            i, cell, t = r // n, r % n, triangle[r]
            if cell == 0:
                for k in range(len(starts)):
                    starts[k, 0], starts[k, 1] = uniform(seed, pixels[i], k, 0), uniform(seed, pixels[i], k, 1)
                choice = uniform(seed, pixels[i], 0, 2)
            x, y = normalised[r, 0], normalised[r, 1]
            if x != x:
                continue
            d0 = m[0, 0] * x + m[0, 1] * y + m[0, 2]
            d1 = m[1, 0] * x + m[1, 1] * y + m[1, 2]
            d2 = m[2, 0] * x + m[2, 1] * y + m[2, 2]
            s = np.inf
            n0 = n1 = n2 = p0 = p1 = p2 = 0.0
            if t >= 0:
                ia, ib, ic = triangles[t, 0], triangles[t, 1], triangles[t, 2]
                a0, a1, a2 = vertices[ia, 0], vertices[ia, 1], vertices[ia, 2]
                ab0, ab1, ab2 = vertices[ib, 0] - a0, vertices[ib, 1] - a1, vertices[ib, 2] - a2
                ac0, ac1, ac2 = vertices[ic, 0] - a0, vertices[ic, 1] - a1, vertices[ic, 2] - a2
                n0, n1, n2 = ab1 * ac2 - ab2 * ac1, ab2 * ac0 - ab0 * ac2, ab0 * ac1 - ab1 * ac0
                length = math.sqrt(n0 * n0 + n1 * n1 + n2 * n2)
                height = n0 * (o0 - a0) + n1 * (o1 - a1) + n2 * (o2 - a2)
                length = length if height >= 0.0 else -length
                cosine = n0 * d0 + n1 * d1 + n2 * d2
                if cosine == 0.0:
                    continue
                s = -height / cosine
                n0, n1, n2 = n0 / length, n1 / length, n2 / length
                p0, p1, p2 = o0 + s * d0, o1 + s * d1, o2 + s * d2
            seen = light_in_view(lights, o0, o1, o2, d0, d1, d2, s)
            if seen >= 0:
                for band in range(3):
                    image[i, band] += share * lights[seen, 1 + band]
                continue
            if t < 0:
                for band in range(3):
                    image[i, band] += share * environment[band]
                continue
            slot = scattering(surface, t, p0, p1, p2, _fraction(choice + cell * R2_X), rho)
            diffuse = not glossy or surface.rows[slot, 0] == LAMBERTIAN
            if not diffuse:
                to_local(surface, t, surface.rows[slot], n0, n1, n2, frame)
                length = math.sqrt(d0 * d0 + d1 * d1 + d2 * d2)
                for axis in range(3):
                    o[axis] = -(frame[axis, 0] * d0 + frame[axis, 1] * d1 + frame[axis, 2] * d2) / length
            s0 = p0 - centre[0] + n0 * surface_offset
            s1 = p1 - centre[1] + n1 * surface_offset
            s2 = p2 - centre[2] + n2 * surface_offset
            if has_environment:
                # a direction as the material scatters: the radiance is then its weight times what the ray sees
                r1, r2 = _fraction(starts[0, 0] + cell * R2_X), _fraction(starts[0, 1] + cell * R2_Y)
                if diffuse:
                    cosine_direction(r1, r2, n0, n1, n2, towards)
                    f[0], f[1], f[2] = rho[0], rho[1], rho[2]
                else:
                    chosen = _fraction(choice + cell * R2_Y)
                    sample(surface.rows[slot], rho, o[0], o[1], o[2], chosen, r1, r2, towards, f)
                    to_world(frame, towards)
                if f[0] + f[1] + f[2] > 0.0:
                    origins[count, 0], origins[count, 1], origins[count, 2] = s0, s1, s2
                    far[count], owner[count] = 1e30, i
                    for axis in range(3):
                        directions[count, axis] = towards[axis]
                        light_out[count, axis] = share * f[axis] * environment[axis]
                    count += 1
            for k in range(lights.shape[0]):
                t0, t1, t2 = lights[k, 4] - p0, lights[k, 5] - p1, lights[k, 6] - p2
                area = 1.0
                if lights[k, 0] == RECTANGLE:
                    g = 2.0 * _fraction(starts[k + 1, 0] + cell * R2_X) - 1.0
                    h = 2.0 * _fraction(starts[k + 1, 1] + cell * R2_Y) - 1.0
                    t0 += g * lights[k, 7] + h * lights[k, 10]
                    t1 += g * lights[k, 8] + h * lights[k, 11]
                    t2 += g * lights[k, 9] + h * lights[k, 12]
                distance = math.sqrt(t0 * t0 + t1 * t1 + t2 * t2)
                cosine = (n0 * t0 + n1 * t1 + n2 * t2) / distance
                if lights[k, 0] == RECTANGLE:
                    area = -(lights[k, 13] * t0 + lights[k, 14] * t1 + lights[k, 15] * t2) / distance * lights[k, 16]
                if cosine <= 0.0 or area <= 0.0:
                    continue
                t0, t1, t2 = t0 / distance, t1 / distance, t2 / distance
                if diffuse:
                    for band in range(3):
                        f[band] = rho[band] / math.pi
                else:
                    for axis in range(3):
                        towards[axis] = frame[axis, 0] * t0 + frame[axis, 1] * t1 + frame[axis, 2] * t2
                    evaluate(surface.rows[slot], rho, o[0], o[1], o[2], towards[0], towards[1], towards[2], f)
                worth = share * cosine * area / (distance * distance)
                directions[count, 0], directions[count, 1], directions[count, 2] = t0, t1, t2
                origins[count, 0], origins[count, 1], origins[count, 2] = s0, s1, s2
                far[count], owner[count] = distance, i
                for band in range(3):
                    light_out[count, band] = worth * f[band] * lights[k, 1 + band]
                count += 1
        return count

    return shade


shade_diffuse, shade_glossy = _shade_kernel(False), _shade_kernel(True)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def add_clear(light_out: Float32, occluded: NDArray[np.bool_], owner: Int, count: int, image: Float32) -> None:
    """Add the worth of every clear shadow ray to its pixel."""
    for j in range(count):
        if not occluded[j]:
            for band in range(3):
                image[owner[j], band] += light_out[j, band]


def ambient_image(
    world: World,
    scene: Scene,
    camera: Camera,
    T_world_camera: Float,
    *,
    samples: int = 16,
    seed: int = 0,
    threads: int | None = None,
    cancelled: Cancel | None = None,
    progress: Progress | None = None,
) -> Float32:
    """(h, w, 3) float32 radiance, W/(m^2 sr) in R, G, B; samples a pixel, rounded up to a square. Raises Cancelled."""
    cells = math.ceil(math.sqrt(samples))
    n = camera.width * camera.height
    image = np.zeros((n, 3), np.float32)
    lights, environment = pack_lights(scene), np.array(scene.environment.radiance)
    shadow_rays = len(lights) + int(environment.sum() > 0.0)
    view, surface, rays = camera.view(T_world_camera), world.surface, world.rays
    shade = shade_glossy if has_gloss(surface) else shade_diffuse

    def work(start: int, stop: int) -> None:
        pixels = np.arange(start, stop, dtype=np.int32)
        count = (stop - start) * cells**2
        normalised, offsets = np.empty((count, 2)), np.empty((count, 2), np.float32)
        directions = np.empty((count, 3), np.float32)
        camera_rays(view, pixels, cells, seed, True, normalised, offsets, directions)
        triangle = rays.from_point(T_world_camera[:3, 3], directions)
        most = count * shadow_rays
        origins, towards = np.empty((most, 3), np.float32), np.empty((most, 3), np.float32)
        far, worth, owner = np.empty(most, np.float32), np.empty((most, 3), np.float32), np.empty(most, np.int32)
        shadows = shade(
            surface,
            T_world_camera,
            pixels,
            cells,
            seed,
            triangle,
            normalised,
            environment,
            lights,
            rays.centre,
            rays.surface_offset,
            image[start:stop],
            origins,
            towards,
            far,
            worth,
            owner,
        )
        blocked = rays.occluded(origins[:shadows], towards[:shadows], far[:shadows])
        add_clear(worth, blocked, owner, shadows, image[start:stop])

    map_chunks(work, n, max(1, CHUNK // cells**2), threads, cancelled, progress)
    return image.reshape(camera.height, camera.width, 3)
