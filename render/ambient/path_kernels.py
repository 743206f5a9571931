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

from render.ambient.light_sampling import (
    POINT,
    SHINING_OBJECT,
    Lights,
    light_in_view,
    light_probability,
    sample_emitter_point,
    sample_light,
)
from render.ambient.path_state import EACH_SURFACE, FIRST_SURFACE, PathState, ShadowRays, accumulate
from render.base.arrays import Float, Float32, Int
from render.material.bsdf import ROW, SUBSURFACE, evaluate, is_boundary, is_diffuse, is_specular_row, pdf, sample
from render.sampling.low_discrepancy import pair
from render.world.interior_list import bit_of, index_beside, medium_within
from render.world.surface_interaction import interaction
from render.world.triangles import Surface, scattering, to_world

ROULETTE_AFTER = 2
"""Surfaces met before a path may be ended by chance."""
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


@numba.njit(nogil=True, cache=True, error_model="numpy")
def bsdf_mis_weight(
    lights: Lights, k: int, bsdf_density: float, o0: float, o1: float, o2: float, distance: float, cosine: float
) -> float:
    """MIS weight of light k that a ray from o, sampled with `bsdf_density`, met at a distance under a cosine."""
    if bsdf_density <= 0.0:
        return 1.0
    other = light_probability(lights.rows, k, o0, o1, o2) * distance * distance / (cosine * lights.rows[k, 16])
    return bsdf_density * bsdf_density / (bsdf_density * bsdf_density + other * other)


def _shade_kernel(glossy: bool) -> Any:  # noqa: PLR0915
    """The kernel of one surface; compiled apart for scenes without gloss, which would pay for the scattering code."""

    @numba.njit(nogil=True, cache=True, error_model="numpy")
    def shade(  # noqa: PLR0913, PLR0915
        surface: Surface,
        lights: Lights,
        environment: Float,
        table: Float32,
        seed: int,
        pixels: Int,
        centre: Float,
        surface_offset: float,
        depth: int,
        surfaces: int,
        clamp: float,
        triangle: Int,
        paths: PathState,
        shadow_rays: ShadowRays,
        sums: Float,
        invalid_counts: Float,
    ) -> tuple[int, int]:
        """The triangles (n,) that the paths meet, -1 for none: adds what is seen, writes shadow rays, moves paths on.

        depth: surfaces met before this one; after `surfaces` of them only lights are looked for. Returns the number of
        paths that go on (the first rows of wave) and of shadow rays.
        """
        # where no object shines, a shadow ray is enough to find out what the last surface sees
        last = depth + 1 == surfaces and lights.shining.shape[0] == 0
        vertices, triangles, rows = surface.vertices, surface.triangles, lights.rows
        o, i, f, rho = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
        towards, lamp, lamp_normal, frame = np.empty(3), np.empty(3), np.empty(3), np.empty((3, 3))
        alpha, row = np.empty(2), np.empty(ROW)
        going = count = 0
        base = FIRST_SURFACE + EACH_SURFACE * depth
        for r in range(triangle.shape[0]):
            t, pixel_slot, s = triangle[r], paths.pixel_slot[r], paths.sample[r]
            o0, o1, o2 = paths.origin[r, 0] + centre[0], paths.origin[r, 1] + centre[1], paths.origin[r, 2] + centre[2]
            d0, d1, d2 = float(paths.direction[r, 0]), float(paths.direction[r, 1]), float(paths.direction[r, 2])
            w0, w1, w2 = float(paths.weight[r, 0]), float(paths.weight[r, 1]), float(paths.weight[r, 2])
            bsdf_density, outside, bit = float(paths.bsdf_density[r]), paths.interior[r], 0
            distance, cosine = np.inf, 0.0
            n0 = n1 = n2 = p0 = p1 = p2 = 0.0
            if t >= 0:
                ia, ib, ic = triangles[t, 0], triangles[t, 1], triangles[t, 2]
                a0, a1, a2 = vertices[ia, 0], vertices[ia, 1], vertices[ia, 2]
                ab0, ab1, ab2 = vertices[ib, 0] - a0, vertices[ib, 1] - a1, vertices[ib, 2] - a2
                ac0, ac1, ac2 = vertices[ic, 0] - a0, vertices[ic, 1] - a1, vertices[ic, 2] - a2
                n0, n1, n2 = ab1 * ac2 - ab2 * ac1, ab2 * ac0 - ab0 * ac2, ab0 * ac1 - ab1 * ac0
                length = 1.0 / math.sqrt(n0 * n0 + n1 * n1 + n2 * n2)
                n0, n1, n2 = n0 * length, n1 * length, n2 * length
                cosine = n0 * d0 + n1 * d1 + n2 * d2
                if cosine == 0.0:
                    continue
                distance = (n0 * (a0 - o0) + n1 * (a1 - o1) + n2 * (a2 - o2)) / cosine
                p0, p1, p2 = o0 + distance * d0, o1 + distance * d1, o2 + distance * d2
            bound = clamp if depth > 1 else np.inf
            if lights.rectangles > 0:
                k = light_in_view(rows, o0, o1, o2, d0, d1, d2, distance)
                if k >= 0:
                    mis_weight = 1.0
                    if bsdf_density > 0.0:
                        facing = -(rows[k, 13] * d0 + rows[k, 14] * d1 + rows[k, 15] * d2)
                        far = rows[k, 13] * (o0 - rows[k, 4]) + rows[k, 14] * (o1 - rows[k, 5])
                        far = (far + rows[k, 15] * (o2 - rows[k, 6])) / facing
                        mis_weight = bsdf_mis_weight(lights, k, bsdf_density, o0, o1, o2, far, facing)
                    l0, l1, l2 = (
                        mis_weight * w0 * rows[k, 1],
                        mis_weight * w1 * rows[k, 2],
                        mis_weight * w2 * rows[k, 3],
                    )
                    accumulate(sums, invalid_counts, pixel_slot, bound, l0, l1, l2)
                    continue
            if t < 0:
                l0, l1, l2 = w0 * environment[0], w1 * environment[1], w2 * environment[2]
                accumulate(sums, invalid_counts, pixel_slot, bound, l0, l1, l2)
                continue
            index = 2 * pixels[pixel_slot >> 1] + (pixel_slot & 1)
            choice = mask_choice = 0.0
            if glossy or surface.second[surface.object_id[t]] >= 0:
                choice, mask_choice = pair(table, seed, index, s, base + 2)
            # the winding's normal tells inside from outside
            if glossy:
                slot = interaction(surface, t, p0, p1, p2, n0, n1, n2, mask_choice, rho, alpha, frame)
                for column in range(ROW):
                    row[column] = surface.rows[slot, column]
                row[1], row[2] = alpha[0], alpha[1]
                bit = bit_of(surface.rows, slot)
                if bit > 0:
                    outside &= ~bit
                    row[3] /= index_beside(surface.rows, outside)
            else:
                slot = scattering(surface, t, p0, p1, p2, mask_choice, rho)
            k = lights.light_of_material[slot]
            if k >= 0 and cosine < 0.0:
                mis_weight = 1.0
                if bsdf_density > 0.0:
                    mis_weight = bsdf_mis_weight(lights, k, bsdf_density, o0, o1, o2, distance, -cosine)
                l0, l1, l2 = mis_weight * w0 * rows[k, 1], mis_weight * w1 * rows[k, 2], mis_weight * w2 * rows[k, 3]
                accumulate(sums, invalid_counts, pixel_slot, bound, l0, l1, l2)
            if depth >= surfaces:
                continue
            diffuse = not glossy or (is_diffuse(row) and surface.detail[slot] == 0)
            if cosine > 0.0 and (diffuse or not is_boundary(row)):
                # all but boundaries are turned towards the ray
                n0, n1, n2 = -n0, -n1, -n2
                if not diffuse:
                    for axis in range(3):
                        frame[0, axis], frame[2, axis] = -frame[0, axis], -frame[2, axis]
            if not diffuse:
                for axis in range(3):
                    o[axis] = -(frame[axis, 0] * d0 + frame[axis, 1] * d1 + frame[axis, 2] * d2)
                # seen from one side of the facet and of the normal that is shaded, or light from behind leaks through
                if o[2] * (n0 * d0 + n1 * d1 + n2 * d2) >= 0.0:
                    continue
            pick_number, survival_number = 0.0, 0.0
            if rows.shape[0] > 1 or depth + 1 >= ROULETTE_AFTER:
                pick_number, survival_number = pair(table, seed, index, s, base + 3)
            if rows.shape[0] > 0 and (diffuse or not is_specular_row(row)):
                k, chosen = sample_light(rows, p0, p1, p2, pick_number)
                if k >= 0:
                    r1, r2 = pair(table, seed, index, s, base + 1)
                    if rows[k, 0] == SHINING_OBJECT:
                        sample_emitter_point(lights, surface, k, r1, r2, lamp, lamp_normal)
                        e0, e1, e2 = lamp_normal[0], lamp_normal[1], lamp_normal[2]
                        # the ray ends before the shining triangle, though it starts beside p
                        away = 2.0 * surface_offset
                        t0, t1, t2 = lamp[0] + away * e0 - p0, lamp[1] + away * e1 - p1, lamp[2] + away * e2 - p2
                    else:
                        r1, r2 = 2.0 * r1 - 1.0, 2.0 * r2 - 1.0
                        t0 = rows[k, 4] + r1 * rows[k, 7] + r2 * rows[k, 10] - p0
                        t1 = rows[k, 5] + r1 * rows[k, 8] + r2 * rows[k, 11] - p1
                        t2 = rows[k, 6] + r1 * rows[k, 9] + r2 * rows[k, 12] - p2
                        e0, e1, e2 = rows[k, 13], rows[k, 14], rows[k, 15]
                    far = math.sqrt(t0 * t0 + t1 * t1 + t2 * t2)
                    scale = 1.0 / far
                    t0, t1, t2 = scale * t0, scale * t1, scale * t2
                    facing = n0 * t0 + n1 * t1 + n2 * t2
                    weight = scale * scale / chosen
                    lamp_density = other = 0.0
                    if rows[k, 0] != POINT:
                        lamp_cosine = -(e0 * t0 + e1 * t1 + e2 * t2)
                        weight *= max(lamp_cosine, 0.0) * rows[k, 16]
                        lamp_density = chosen * far * far / (lamp_cosine * rows[k, 16])
                    if diffuse:
                        weight *= max(facing, 0.0)
                        f[0], f[1], f[2] = rho[0] / math.pi, rho[1] / math.pi, rho[2] / math.pi
                        other = facing / math.pi
                    elif weight > 0.0:
                        for axis in range(3):
                            i[axis] = frame[axis, 0] * t0 + frame[axis, 1] * t1 + frame[axis, 2] * t2
                        # on one side of the facet and of the normal that is shaded, and not through a medium
                        open_side = i[2] * facing > 0.0 and (row[0] != SUBSURFACE or i[2] > 0.0)
                        weight *= abs(i[2]) if open_side else 0.0
                        evaluate(row, rho, o[0], o[1], o[2], i[0], i[1], i[2], f)
                        other = pdf(row, rho, o[0], o[1], o[2], i[0], i[1], i[2])
                    if weight > 0.0 and rows[k, 0] != POINT:
                        weight *= lamp_density * lamp_density / (lamp_density * lamp_density + other * other)
                    if weight * (f[0] + f[1] + f[2]) > 0.0:
                        clear = True
                        if lights.rectangles > 1 or (lights.rectangles == 1 and rows[k, 16] == 0.0):
                            clear = light_in_view(rows, p0, p1, p2, t0, t1, t2, far * (1.0 - 1e-6)) < 0
                        if clear:
                            side = surface_offset if facing > 0.0 else -surface_offset
                            shadow_rays.origin[count, 0] = p0 - centre[0] + side * n0
                            shadow_rays.origin[count, 1] = p1 - centre[1] + side * n1
                            shadow_rays.origin[count, 2] = p2 - centre[2] + side * n2
                            shadow_rays.direction[count, 0], shadow_rays.direction[count, 1] = t0, t1
                            shadow_rays.direction[count, 2] = t2
                            shadow_rays.far[count], shadow_rays.pixel_slot[count] = far, pixel_slot
                            shadow_rays.interior[count] = outside if diffuse or i[2] > 0.0 else outside | bit
                            shadow_rays.light[count, 0] = weight * w0 * f[0] * rows[k, 1]
                            shadow_rays.light[count, 1] = weight * w1 * f[1] * rows[k, 2]
                            shadow_rays.light[count, 2] = weight * w2 * f[2] * rows[k, 3]
                            count += 1
            r1, r2 = pair(table, seed, index, s, base)
            side, medium, interior = surface_offset, 0, outside
            if diffuse:
                t0, t1, t2, bsdf_density = cosine_direction(r1, r2, n0, n1, n2)
                bsdf_density *= 1.0 / math.pi
                w0, w1, w2 = w0 * rho[0], w1 * rho[1], w2 * rho[2]
            else:
                bsdf_density = sample(row, rho, o[0], o[1], o[2], choice, r1, r2, towards, f)
                if bsdf_density == 0.0:
                    continue
                leaves = towards[2]
                to_world(frame, towards)
                t0, t1, t2 = towards[0], towards[1], towards[2]
                facing = n0 * t0 + n1 * t1 + n2 * t2
                if facing * leaves <= 0.0:
                    continue
                side = surface_offset if facing > 0.0 else -surface_offset
                interior = outside | bit if leaves < 0.0 else outside
                if row[0] == SUBSURFACE and leaves < 0.0:
                    medium = slot + 1
                w0, w1, w2 = w0 * f[0], w1 * f[1], w2 * f[2]
            if interior > 0:
                medium = medium_within(surface.rows, interior) + 1
            if medium > 0:
                # what is met within was connected to nothing
                bsdf_density = -1.0
            if not w0 + w1 + w2 > 0.0:
                continue
            if last:
                far = 1e30
                l0, l1, l2 = environment[0], environment[1], environment[2]
                if lights.rectangles > 0:
                    k = light_in_view(rows, p0, p1, p2, t0, t1, t2, np.inf)
                    if k >= 0:
                        facing = -(rows[k, 13] * t0 + rows[k, 14] * t1 + rows[k, 15] * t2)
                        far = rows[k, 13] * (p0 - rows[k, 4]) + rows[k, 14] * (p1 - rows[k, 5])
                        far = (far + rows[k, 15] * (p2 - rows[k, 6])) / facing
                        mis_weight = bsdf_mis_weight(lights, k, bsdf_density, p0, p1, p2, far, facing)
                        l0, l1, l2 = mis_weight * rows[k, 1], mis_weight * rows[k, 2], mis_weight * rows[k, 3]
                l0, l1, l2 = w0 * l0, w1 * l1, w2 * l2
                if l0 + l1 + l2 == 0.0:
                    continue
                shadow_rays.origin[count, 0] = p0 - centre[0] + side * n0
                shadow_rays.origin[count, 1] = p1 - centre[1] + side * n1
                shadow_rays.origin[count, 2] = p2 - centre[2] + side * n2
                shadow_rays.direction[count, 0], shadow_rays.direction[count, 1] = t0, t1
                shadow_rays.direction[count, 2], shadow_rays.interior[count] = t2, interior
                shadow_rays.light[count, 0], shadow_rays.light[count, 1], shadow_rays.light[count, 2] = l0, l1, l2
                shadow_rays.far[count], shadow_rays.pixel_slot[count] = far, pixel_slot
                count += 1
                continue
            if depth + 1 >= ROULETTE_AFTER:
                survival = min(MOST_SURVIVAL, max(w0, w1, w2))
                if survival_number >= survival:
                    continue
                w0, w1, w2 = w0 / survival, w1 / survival, w2 / survival
            paths.origin[going, 0] = p0 - centre[0] + side * n0
            paths.origin[going, 1] = p1 - centre[1] + side * n1
            paths.origin[going, 2] = p2 - centre[2] + side * n2
            paths.direction[going, 0], paths.direction[going, 1], paths.direction[going, 2] = t0, t1, t2
            paths.weight[going, 0], paths.weight[going, 1], paths.weight[going, 2] = w0, w1, w2
            paths.bsdf_density[going], paths.pixel_slot[going], paths.sample[going] = bsdf_density, pixel_slot, s
            paths.medium[going], paths.interior[going] = medium, interior
            going += 1
        return going, count

    return shade


shade_diffuse, shade_glossy = _shade_kernel(False), _shade_kernel(True)
