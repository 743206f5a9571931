"""One bounce of the path tracer for ambient light: all paths of a wavefront meet their next surface together.

At each surface a lamp is sampled and connected by a shadow ray (NEE), and the path goes on as the BSDF is sampled.
Lamps with an area are found both ways, with MIS weights by the power heuristic (Veach 1997, 9.2.3). The environment,
the same from everywhere, is found by BSDF sampling, which no other pdf could better; point lights by NEE only. A
specular BSDF has no pdf: a light that it leads to has weight 1.

    surfaces that light met      1  lamp - surface - camera, what a plan calls direct      0  the lamp itself
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numba
import numpy as np

from render.ambient.directions import guided_direction, guided_pdf
from render.ambient.light_connection import Connection, connect_to_light, emission, light_beyond, light_sample
from render.ambient.light_sampling import (
    KIND,
    SHINING_OBJECT,
    Lights,
    distance_to_rectangle,
    light_in_view,
    sample_emitter_point,
    sample_light,
    sample_rectangle_point,
)
from render.ambient.path_state import EACH_SURFACE, FIRST_SURFACE, PathState, Samples, ShadowRays, accumulate
from render.ambient.path_vertex import (
    Path,
    beside_guide,
    eval_bsdf,
    eval_diffuse,
    fill_row,
    hit_of,
    local_direction,
    scatter,
    scatter_diffuse,
    scattered_to,
    vertex_of,
    with_guide,
)
from render.base.arrays import Float, Float32, Int
from render.base.borrowed import borrowed
from render.base.vectors import Vector, along, divided, dot, minus, plus, row_vector, store_row, times, vector
from render.material.bsdf import is_boundary, is_diffuse, is_specular_row
from render.material.record import BSDF_COLUMNS, INDEX
from render.sampling.low_discrepancy import pair
from render.world.interior_list import bit_of, index_beside, medium_within
from render.world.surface_interaction import interaction
from render.world.triangles import Surface, scattering

FIRST_ROULETTE_SURFACE = 4
"""Surface, counted from 1, on leaving which a path may first be ended by Russian roulette: as for laser light. From the
second on the weld seam took twice the samples to 1 %, from the first six times."""
MOST_SURVIVAL = 0.95
"""Largest probability of surviving it, so that paths among mirrors end. Chosen, not tuned."""


class Bounce(NamedTuple):
    """What all paths have in common at one of their surfaces."""

    centre: Float
    """(3,) that the ray engine's coordinates are relative to."""
    ray_epsilon: float
    """Distance from a surface at which rays begin, m."""
    depth: int
    """Surfaces met before this one."""
    most_surfaces: int
    """After so many only lights are looked for."""
    clamp: float
    """Most radiance, W/(m^2 sr), of a contribution by way of two or more surfaces."""


class Film(NamedTuple):
    """What the paths of a chunk of pixels add up to."""

    sums: Float
    """(2 m, 4) of both halves of each pixel, side by side: R, G, B, and what the clamp took."""
    counts: Float
    """(2,) invalid and clamped contributions."""


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def store_ray(
    origins: Float32, directions: Float32, radiance: Float32, j: int, origin: Vector, light: Connection
) -> None:
    """Write shadow ray j, all but its length and whose it is."""
    store_row(origins, j, origin)
    store_row(directions, j, light.direction)
    store_row(radiance, j, light.radiance)


def _shade_kernel(glossy: bool) -> Any:  # noqa: PLR0915
    """The kernel of one surface; compiled apart for scenes without gloss, which would pay for the scattering code."""

    @numba.njit(nogil=True, cache=True, error_model="numpy")
    def shade(  # noqa: PLR0915
        surface: Surface,
        lights: Lights,
        bounce: Bounce,
        samples: Samples,
        triangle: Int,
        paths: PathState,
        shadow_rays: ShadowRays,
        film: Film,
    ) -> tuple[int, int]:
        """The triangles (n,) that the paths meet, -1 for none: adds what is seen, writes shadow rays, moves paths on.

        Returns the number of paths that go on (the first rows of `paths`) and of shadow rays.
        """
        surface, lights, samples, paths = borrowed(surface), borrowed(lights), borrowed(samples), borrowed(paths)
        triangle, shadow_rays, film = borrowed(triangle), borrowed(shadow_rays), borrowed(film)
        vertices, triangles, materials = surface.vertices, surface.triangles, surface.rows
        rows, rectangles, environment = lights.rows, lights.rectangles, vector(lights.environment)
        (table, seed, keys, guide), (sums, counts), lamps = samples, film, lights.rows.shape[0]
        cumulative, guide_row, share = guide
        origins, directions, throughputs, pdfs, pixel_slots, numbers, media, interiors = paths
        shadow_origins, shadow_directions, lengths, radiance, shadow_slots, shadow_interiors = shadow_rays
        depth, centre, epsilon = bounce.depth, vector(bounce.centre), bounce.ray_epsilon
        clamp = bounce.clamp if depth > 1 else np.inf
        # where no object shines, a shadow ray is enough to find out what the last surface sees
        last = depth + 1 == bounce.most_surfaces and lights.shining.shape[0] == 0
        room = np.empty(3), np.empty(2), np.empty((3, 3)), np.empty(BSDF_COLUMNS), np.empty(3)
        rho, alpha, frame, row, weight = borrowed(room)
        going = connected = 0
        base = FIRST_SURFACE + EACH_SURFACE * depth
        for r in range(triangle.shape[0]):
            t, pixel_slot, s = triangle[r], pixel_slots[r], numbers[r]
            outside, bit = interiors[r], 0
            origin = plus(row_vector(origins, r), centre)
            path = Path(origin, row_vector(directions, r), row_vector(throughputs, r), float(pdfs[r]))
            hit = hit_of(vertices, triangles, t, path)
            if t >= 0 and hit.cosine == 0.0:
                continue

            # lamps and the environment
            if rectangles > 0:
                k = light_in_view(rows, path.origin, path.direction, hit.distance)
                if k >= 0:
                    distance, cosine = distance_to_rectangle(rows, k, path.origin, path.direction)
                    accumulate(sums, counts, pixel_slot, clamp, emission(rows, k, path, distance, cosine))
                    continue
            if t < 0:
                accumulate(sums, counts, pixel_slot, clamp, times(path.throughput, environment))
                continue

            # surface interaction
            index = 2 * keys[pixel_slot >> 1] + (pixel_slot & 1)
            choice = mask_choice = 0.0
            if glossy or surface.second[surface.object_id[t]] >= 0:
                choice, mask_choice = pair(table, seed, index, s, base + 2)
            if glossy:
                # the winding's normal tells inside from outside
                slot = interaction(surface, t, hit.point, hit.normal, mask_choice, rho, alpha, frame)
                fill_row(materials, slot, alpha, row)
                bit = bit_of(materials, slot)
                if bit > 0:
                    outside &= ~bit
                    row[INDEX] /= index_beside(materials, outside)
            else:
                slot = scattering(surface, t, hit.point[0], hit.point[1], hit.point[2], mask_choice, rho)

            k = lights.light_of_material[slot]
            if k >= 0 and hit.cosine < 0.0:
                seen = emission(rows, k, path, hit.distance, -hit.cosine)
                accumulate(sums, counts, pixel_slot, clamp, seen)
            if depth >= bounce.most_surfaces:
                continue
            diffuse = not glossy or (is_diffuse(row) and surface.detail[slot] == 0)
            wo = (0.0, 0.0, 1.0)
            turned = hit.cosine > 0.0 and (diffuse or not is_boundary(row))
            if not diffuse:
                wo = local_direction(path, frame, turned)
            v = vertex_of(path, hit, wo, turned, outside, bit)
            # seen from one side of the facet and of the normal that is shaded, or light from behind leaks through
            if not diffuse and wo[2] * dot(v.normal, path.direction) >= 0.0:
                continue
            albedo = vector(rho)
            place = minus(v.point, centre)

            # the guide, of which nothing is to be had where light goes through
            guided, from_guide = -1, False
            if depth == 0 and guide_row.shape[0] > 0 and (diffuse or not (is_specular_row(row) or is_boundary(row))):
                guided = guide_row[pixel_slot >> 1]

            # NEE
            light_choice, survival_number = 0.0, 0.0
            if lamps > 1 or depth + 1 >= FIRST_ROULETTE_SURFACE or guided >= 0:
                light_choice, survival_number = pair(table, seed, index, s, base + 3)
            if lamps > 0 and (diffuse or not is_specular_row(row)):
                k, probability = sample_light(rows, v.point, light_choice)
                if k >= 0:
                    r1, r2 = pair(table, seed, index, s, base + 1)
                    if rows[k, KIND] == SHINING_OBJECT:
                        emitter = sample_emitter_point(lights, surface, k, r1, r2)
                    else:
                        emitter = sample_rectangle_point(rows, k, r1, r2)
                    drawn = light_sample(rows, k, probability, emitter, v.point, epsilon)
                    if drawn.weight > 0.0:
                        if diffuse:
                            bsdf = eval_diffuse(v, albedo, drawn.direction)
                        else:
                            bsdf = eval_bsdf(v, row, albedo, frame, drawn.direction)
                        if guided >= 0:
                            bsdf = with_guide(bsdf, share, guided_pdf(cumulative, guided, drawn.direction))
                        light = connect_to_light(rows, rectangles, drawn, v, bsdf)
                        if light.brings:
                            origin = along(place, epsilon * light.side, v.normal)
                            store_ray(shadow_origins, shadow_directions, radiance, connected, origin, light)
                            lengths[connected], shadow_slots[connected] = light.distance, pixel_slot
                            shadow_interiors[connected] = light.interior
                            connected += 1

            # the path goes on as the BSDF or the guide is sampled
            r1, r2 = pair(table, seed, index, s, base)
            if guided >= 0:
                from_guide = survival_number < share  # no path may end so soon, which leaves this number over
            if from_guide:
                direction = guided_direction(cumulative, guided, r1, r2)
                bsdf = eval_diffuse(v, albedo, direction) if diffuse else eval_bsdf(v, row, albedo, frame, direction)
                on = scattered_to(v, direction, with_guide(bsdf, share, guided_pdf(cumulative, guided, direction)))
            elif diffuse:
                on = scatter_diffuse(v, albedo, r1, r2)
            else:
                on = scatter(v, slot, row, albedo, frame, (choice, r1, r2), weight)
            if guided >= 0 and not from_guide:
                on = beside_guide(on, share, guided_pdf(cumulative, guided, on.direction))
            throughput, bsdf_pdf, medium = on.throughput, on.bsdf_pdf, on.medium
            if on.interior > 0:
                medium = medium_within(materials, on.interior) + 1
            if medium > 0:
                # what is met within was connected to nothing
                bsdf_pdf = -1.0
            if on.bsdf_pdf == 0.0 or not throughput[0] + throughput[1] + throughput[2] > 0.0:
                continue
            origin = along(place, epsilon * on.side, v.normal)
            if last:
                light = light_beyond(rows, rectangles, environment, v, on, bsdf_pdf)
                if light.brings:
                    store_ray(shadow_origins, shadow_directions, radiance, connected, origin, light)
                    lengths[connected], shadow_slots[connected] = light.distance, pixel_slot
                    shadow_interiors[connected] = light.interior
                    connected += 1
                continue
            if depth + 1 >= FIRST_ROULETTE_SURFACE:
                survival = min(MOST_SURVIVAL, max(throughput[0], throughput[1], throughput[2]))
                if survival_number >= survival:
                    continue
                throughput = divided(throughput, survival)
            store_row(origins, going, origin)
            store_row(directions, going, on.direction)
            store_row(throughputs, going, throughput)
            pdfs[going], pixel_slots[going], numbers[going] = bsdf_pdf, pixel_slot, s
            media[going], interiors[going] = medium, on.interior
            going += 1
        # held to here
        room[0][0] = 0.0
        return going, connected

    return shade


shade_diffuse, shade_glossy = _shade_kernel(False), _shade_kernel(True)
