"""Direct laser light along each camera ray: the shading kernels of `render.laser_direct.integrator`.

The plane of the facet that a ray hits gives the gradient of the sheet's coordinate q = x / sigma(z) over the ray's cell
of its pixel. The Gaussian across the sheet is therefore integrated over the cell in closed form; visibility and albedo
are sampled.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from render.base.arrays import Float, Float32, Int
from render.base.vectors import (
    Vector,
    divided,
    dot,
    length,
    minus,
    plus,
    rotated,
    scaled,
    store_row,
    transformed,
    vector,
)
from render.camera.distortion import distort, tilt_matrix
from render.camera.lens import lens_direction, lens_position
from render.camera.view import View
from render.laser.irradiance import fan_density, sheet_sigma
from render.laser.sheet_integral import SheetHit, about_over, about_over_aperture, mean_over, sheet_slope
from render.laser_direct.centre_ray import BEYOND
from render.material.bsdf import evaluate, is_diffuse
from render.world.surface_interaction import detailed, light_side
from render.world.triangles import Surface, facet_of, lookup, slot_reflectance, to_local


class CellRays(NamedTuple):
    """Camera rays, one through each of the cells x cells of each pixel, and the triangles that they hit."""

    triangle: Int
    """(n,) triangle that the ray hits; -1: none."""
    normalised: Float
    """(n, 2) normalised image coordinates without distortion; NaN: no ray."""
    offsets: Float32
    """(n, 2) px from the centre of the cell to the ray."""
    lens: Float
    """(n, 2) points of the aperture, m; (0, 2) for a pinhole."""
    cells: int
    """Number of cells along a side of the pixel."""


class Sheet(NamedTuple):
    """The sheet of one laser in the world."""

    T_laser_world: Float
    centre: Float
    """(3,) position of the laser, world frame, m."""
    beam: Float
    """Parameters of the laser, as `render.laser.laser.LineLaser.packed` gives them."""
    weights: Float
    """(3,) weights of R, G and B in a reflectance at the laser's wavelength."""


class ShadowRays(NamedTuple):
    """Buffers that the shadow rays are written to, and the origin of their coordinates."""

    centre: Float
    """(3,) origin of Embree's coordinates, world frame, m."""
    surface_offset: float
    """Distance from a shadow ray's origin to its surface, m."""
    origins: Float32
    """(n, 3) origins relative to `centre`, m."""
    directions: Float32
    """(n, 3) unit directions to the laser."""
    far: Float32
    """(n,) length of the shadow ray, m."""
    sample: Int
    """(n,) index of the camera ray each belongs to."""


@numba.njit(nogil=True, cache=True, error_model="numpy")
def eval_bsdf(
    surface: Surface, t: int, point: Vector, normal: Vector, to_camera: Vector, to_light: Vector, weights: Float
) -> float:
    """BSDF f, 1/sr, of triangle t at a point for world directions, at one wavelength.

    normal: the facet's, on the side of camera and light. weights (3,): of R, G and B. A blend is the mean of its
    materials, weighted by its mask. With a shading normal, f holds the factor of `render.world.surface_interaction`.
    """
    rgb, frame = np.empty(3), np.empty((3, 3))
    slot, fraction, total = surface.object_id[t], 1.0, 0.0
    over = surface.second[slot]
    if over >= 0:
        mask = surface.mask_shape
        lookup(surface, (mask[slot, 0], mask[slot, 1], mask[slot, 2]), t, point, rgb)
        fraction = 1.0 - rgb[0]
    facing = dot(normal, to_light)
    for part in range(2 if over >= 0 else 1):
        if part == 1:
            slot, fraction = over, 1.0 - fraction
        if fraction <= 0.0:
            continue
        slot_reflectance(surface, slot, t, point[0], point[1], point[2], rgb)
        rho = weights[0] * rgb[0] + weights[1] * rgb[1] + weights[2] * rgb[2]
        row = surface.rows[slot]
        detail = surface.detail[slot] != 0
        if is_diffuse(row) and not detail:
            total += fraction * rho / math.pi
            continue
        if detail:
            row = row.copy()
            detailed(surface, t, slot, point, normal, row[1:3], frame)
        else:
            to_local(surface, t, row, normal[0], normal[1], normal[2], frame)
        wo, wi = rotated(frame, to_camera), rotated(frame, to_light)
        # both directions are above the facet; f is 0 where one is below the shading normal
        if wo[2] <= 0.0 or wi[2] <= 0.0:
            continue
        total += fraction * evaluate(row, (rho, rho, rho), wo, wi)[0] * light_side(wi[2], facing)
    return total


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def facet_plane(surface: Surface, t: int) -> tuple[Vector, Vector, float]:
    """A corner of triangle t, its unit normal by the winding (NaN where it has no area), and twice its area."""
    a0, a1, a2, n0, n1, n2 = facet_of(surface, t)
    area = math.sqrt(n0 * n0 + n1 * n1 + n2 * n2)
    return (a0, a1, a2), (n0 / area, n1 / area, n2 / area), area


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def ray_slopes(view: View, tilt: Any, distorted: bool, x: float, y: float) -> tuple[float, float, float, float]:
    """dx/du, dx/dv, dy/du, dy/dv, 1/px: derivatives of a ray's normalised coordinates by its pixel coordinates."""
    intrinsics = view.intrinsics
    xu, xv = 1.0 / intrinsics[0], -intrinsics[4] / (intrinsics[0] * intrinsics[1])
    yu, yv = 0.0, 1.0 / intrinsics[1]
    if distorted:
        _, _, jxx, jxy, jyx, jyy = distort(x, y, view.distortion, tilt)
        det = jxx * jyy - jxy * jyx
        xu, xv, yu, yv = jyy * xu / det, (jyy * xv - jxy * yv) / det, -jyx * xu / det, (-jyx * xv + jxx * yv) / det
    return xu, xv, yu, yv


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def middle_offset(du: float, dv: float, cell: int, cells: int) -> tuple[float, float]:
    """Offset, px, from the centre of a pixel of cells x cells to a ray that is (du, dv) from the centre of its cell."""
    return (cell % cells + 0.5) / cells - 0.5 + du, (cell // cells + 0.5) / cells - 0.5 + dv


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def meet_sheet(
    T_laser_world: Float, beam: Float, normal: Vector, height: float, origin: Vector, d: Vector
) -> tuple[float, Vector, Vector, SheetHit]:
    """Where a ray from `height` m above a facet meets its plane: the fan's density there, 0 where no light goes, the
    point, the same in laser coordinates, and the hit.
    """
    cosine = dot(normal, d)
    s = -height / cosine if cosine != 0.0 else 0.0
    point = origin[0] + s * d[0], origin[1] + s * d[1], origin[2] + s * d[2]
    laser = transformed(T_laser_world, point)
    lit = cosine != 0.0 and laser[2] > 1e-9
    density = fan_density(laser[1] / laser[2], beam) if lit else 0.0
    sigma, slope = sheet_sigma(laser[2], beam)
    return density, point, laser, SheetHit(normal, d, s, cosine, laser[0] / sigma, sigma, slope)


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def irradiance_without_gaussian(
    T_laser_world: Float, beam: Float, laser: Vector, density: float, normal: Vector, hit: SheetHit
) -> float:
    """P h / (z sigma) |n . (x sigma'/sigma, y/z, 1)| at a point in laser coordinates, W/m^2."""
    n = rotated(T_laser_world, normal)
    tilted = n[0] * hit.q * hit.slope + n[1] * laser[1] / laser[2] + n[2]
    return beam[0] * density / (laser[2] * hit.sigma) * abs(tilted)


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def towards_emitter(T_laser_world: Float, centre: Vector, shift: float, point: Vector) -> tuple[Vector, float]:
    """Unit direction and distance, m, from a point to the point of the emitting segment `shift` m from its middle."""
    w = T_laser_world
    light = minus((centre[0] + w[0, 0] * shift, centre[1] + w[0, 1] * shift, centre[2] + w[0, 2] * shift), point)
    distance = length(light)
    return divided(light, distance), distance


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def lens_ray_slopes(
    view: View, slopes: tuple[float, float, float, float], a: float, b: float
) -> tuple[float, float, float, float]:
    """`ray_slopes` of a ray through the point (a, b) of the aperture, m: with a tilted sensor the focus varies."""
    xu, xv, yu, yv = slopes
    gu, gv = view.lens[2] * xu + view.lens[3] * yu, view.lens[2] * xv + view.lens[3] * yv
    return xu + gu * a, xv + gv * a, yu + gu * b, yv + gv * b


def _shade_kernel(glossy: bool, aperture: bool) -> Any:  # noqa: PLR0915
    """The shading kernel, compiled separately for purely diffuse scenes and for pinholes, where it is much faster."""

    @numba.njit(nogil=True, cache=True, error_model="numpy")
    def shade(  # noqa: PLR0915
        surface: Surface, view: View, rays: CellRays, sheet: Sheet, shadows: ShadowRays, values: Float, planes: Float
    ) -> tuple[int, int]:
        """Unoccluded radiance of each ray's cell and predicted for its whole pixel -> values (n, 2); their shadow rays.

        Returns the number of shadow rays, and of invalid rays: those whose radiance is NaN, infinite or negative, which
        get 0. With an aperture, planes (n, 5) take q at the pixel's centre and its derivatives by u, v, a and b;
        without one planes (n, 4), unless empty, are filled as `render.laser_direct.centre_ray` describes.
        """
        # taking an array out of a named tuple costs a reference count, so it is done once and not for every ray
        m, w, beam, weights = view.T_world_camera, sheet.T_laser_world, sheet.beam, sheet.weights
        triangle, normalised, offsets, lens, cells = rays
        centre, surface_offset, origins, directions, far, sample = shadows
        tilt, distorted = tilt_matrix(view.distortion[12], view.distortion[13]), bool(np.any(view.distortion))
        straight = ray_slopes(view, tilt, False, 0.0, 0.0)
        emitter, _ = sheet_sigma(0.0, beam)
        laser_centre = vector(sheet.centre)
        origin = m[0, 3], m[1, 3], m[2, 3]
        rgb = np.empty(3)
        count = invalid = 0
        facet = -1
        corner = normal = origin
        area = height_laser = 0.0
        half = 0.5 / cells
        centre_rays = not aperture and planes.shape[0] > 0
        for r in range(triangle.shape[0]):
            values[r, 0] = values[r, 1] = 0.0
            if centre_rays:
                planes[r, 3] = 0.0
            t = triangle[r]
            x, y = normalised[r, 0], normalised[r, 1]
            if t < 0 or x != x:
                continue
            if t != facet:
                # most rays of a pixel hit the same triangle
                facet = t
                corner, normal, area = facet_plane(surface, t)
                height_laser = dot(normal, minus(laser_centre, corner))
            if area == 0.0:
                continue
            if aperture:
                origin = lens_position(view, lens[r, 0], lens[r, 1])
            height_camera = dot(normal, minus(origin, corner))
            if not height_camera * height_laser > 0.0:
                continue
            side = 1.0 if height_camera > 0.0 else -1.0
            d = lens_direction(view, x, y, lens[r, 0], lens[r, 1]) if aperture else rotated(m, (x, y, 1.0))
            h, point, laser, hit = meet_sheet(w, beam, normal, height_camera, origin, d)
            if h == 0.0:
                continue
            q, s = hit.q, hit.s
            xu, xv, yu, yv = ray_slopes(view, tilt, True, x, y) if distorted else straight
            if aperture:
                a, b = lens[r, 0], lens[r, 1]
                xu, xv, yu, yv = lens_ray_slopes(view, (xu, xv, yu, yv), a, b)
            qu, qv = sheet_slope(xu, yu, m, w, hit), sheet_slope(xv, yv, m, w, hit)
            du, dv = offsets[r, 0], offsets[r, 1]
            pixel_u, pixel_v = middle_offset(du, dv, r % (cells * cells), cells)
            in_cell = mean_over(q - qu * du - qv * dv, qu * half, qv * half)
            if aperture:
                off_focus = 1.0 / s - (view.lens[1] - view.lens[2] * x - view.lens[3] * y)
                qa = off_focus * sheet_slope(1.0, 0.0, m, w, hit)
                qb = off_focus * sheet_slope(0.0, 1.0, m, w, hit)
                middle = q - qu * pixel_u - qv * pixel_v - qa * a - qb * b
                in_pixel = about_over_aperture(middle, qu * 0.5, qv * 0.5, view.lens[0] * math.hypot(qa, qb))
                planes[r, 0], planes[r, 1], planes[r, 2], planes[r, 3], planes[r, 4] = middle, qu, qv, qa, qb
            elif centre_rays:
                in_pixel = in_cell
                planes[r, 0], planes[r, 1], planes[r, 2] = q, qu, qv
                planes[r, 3] = BEYOND if in_cell == 0.0 else 0.0
            else:
                in_pixel = about_over(q - qu * pixel_u - qv * pixel_v, qu * 0.5, qv * 0.5)
            if in_cell == 0.0 and in_pixel == 0.0:
                continue
            power = irradiance_without_gaussian(w, beam, laser, h, normal, hit)
            to_light, distance = towards_emitter(w, laser_centre, q * emitter, point)
            slot = surface.object_id[t]
            plain = is_diffuse(surface.rows[slot]) and surface.second[slot] < 0 and surface.detail[slot] == 0
            if not glossy or plain:
                slot_reflectance(surface, slot, t, point[0], point[1], point[2], rgb)
                radiance = power / math.pi * (weights[0] * rgb[0] + weights[1] * rgb[1] + weights[2] * rgb[2])
            else:
                up, to_camera = scaled(side, normal), divided(d, -length(d))
                radiance = power * eval_bsdf(surface, t, point, up, to_camera, to_light, weights)
            both = radiance * (in_cell + in_pixel)
            if not 0.0 < both < np.inf:
                invalid += both != 0.0
                continue
            values[r, 0], values[r, 1] = radiance * in_cell, radiance * in_pixel
            if centre_rays:
                planes[r, 3] = radiance
            off = scaled(surface_offset, scaled(side, normal))
            store_row(origins, count, plus(minus(point, vector(centre)), off))
            store_row(directions, count, to_light)
            far[count], sample[count] = distance, r
            count += 1
        return count, invalid

    return shade


shade_diffuse, shade_glossy = _shade_kernel(False, False), _shade_kernel(True, False)
shade_diffuse_lens, shade_glossy_lens = _shade_kernel(False, True), _shade_kernel(True, True)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def gather(
    values: Float,
    occluded: NDArray[np.bool_],
    sample: Int,
    count: int,
    cells: int,
    mean: Float,
    error: Float,
    jump: Float,
) -> None:
    """Average the visible cells of each pixel -> mean (n,), its standard error by the spread of the predictions, and
    jump (n,), the range of these predictions.
    """
    for j in range(count):
        if occluded[j]:
            values[sample[j], 0] = values[sample[j], 1] = 0.0
    n = cells * cells
    for i in range(mean.shape[0]):
        total = first = second = 0.0
        low, high = np.inf, 0.0
        for r in range(i * n, i * n + n):
            total += values[r, 0]
            first += values[r, 1]
            second += values[r, 1] ** 2
            low, high = min(low, values[r, 1]), max(high, values[r, 1])
        mean[i], jump[i] = total / n, high - low
        spread = max(second / n - (first / n) ** 2, 0.0) * n / (n - 1)
        # an edge that cuts off a corner of area p crosses cells along 2 sqrt(p) of pixel, each of variance 1/6
        spread = max(spread, jump[i] * math.sqrt(spread) / 3.0)
        # jittered sampling of an edge or a slope: the variance falls with the 3/2 power of the number of cells
        error[i] = math.sqrt(spread) / n**0.75


@numba.njit(nogil=True, cache=True)
def write_pixels(pixels: Int, mean: Float, image: Float32) -> int:
    """Write each pixel's radiance (n,) into the flat image, 0 where it is invalid; returns how many are invalid."""
    invalid = 0
    for i in range(pixels.shape[0]):
        if 0.0 <= mean[i] < np.inf:
            image[pixels[i]] = mean[i]
        else:
            invalid += 1
    return invalid
