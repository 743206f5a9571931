"""One bounce of the path tracer for ambient light: all paths of a wavefront meet their next surface together.

At each surface a lamp is sampled and connected by a shadow ray (NEE), and the path goes on as the BSDF is sampled.
Lamps with an area are found both ways, with MIS weights by the power heuristic (Veach 1997, 9.2.4). The environment,
the same from everywhere, is found by BSDF sampling, which no other pdf could better; point lights by NEE only. A
specular BSDF has no pdf: a light that it leads to has weight 1.

    surfaces that light met      1  lamp - surface - camera, what a plan calls direct      0  the lamp itself
"""

from __future__ import annotations

import math
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from render.ambient.bounce_state import PathScene, Ray, Shading, SurfacePoint, ray_of
from render.ambient.next_event import (
    accumulate_emission,
    bsdf_mis_weight,
    connect_to_light,
    lamp_on_ray,
    look_for_light,
)
from render.ambient.path_state import (
    DIRECTION,
    EACH_SURFACE,
    FIRST_SURFACE,
    LAMP,
    LOBE,
    PathState,
    PixelSums,
    ShadowRays,
)
from render.material.bsdf import ROW, SUBSURFACE, is_boundary, is_diffuse, is_specular_row, sample
from render.sampling.low_discrepancy import pair
from render.world.surface_interaction import interaction
from render.world.triangles import plane_of, scattering, to_world

Float = NDArray[np.float64]
Float32 = NDArray[np.float32]
Int = NDArray[np.int32]

ROULETTE_AFTER = 2
"""Surfaces met before Russian roulette may end a path."""
MOST_SURVIVAL = 0.95


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


def _bounce_kernel(glossy: bool) -> Any:  # noqa: PLR0915
    """The kernel of one bounce; compiled apart for scenes without gloss, which would pay for the scattering code."""

    @numba.njit(nogil=True, cache=True, error_model="numpy")
    def bounce(  # noqa: PLR0915
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
