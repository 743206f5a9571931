"""What each camera ray tells of the direct light of a laser: the kernels of `render.laser_direct.integrator`.

Where a ray hits, the facet's plane tells how the sheet's coordinate q = x / sigma(z) changes over the ray's cell of its
pixel, so the Gaussian across it is integrated in closed form instead of being sampled; visibility and albedo are
sampled.
"""

from __future__ import annotations

import math
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from render.camera.distortion import distort, tilt_matrix
from render.camera.lens import lens_direction, lens_position
from render.camera.view import View
from render.laser.irradiance import fan_density, sheet_sigma
from render.laser.sheet_integral import about_over, about_over_aperture, mean_over, sheet_slope
from render.laser_direct.centre_ray import BEYOND
from render.material.bsdf import evaluate, is_diffuse
from render.world.surface_interaction import detailed, light_side
from render.world.triangles import Surface, lookup, slot_reflectance, to_local

Float = NDArray[np.float64]
Float32 = NDArray[np.float32]
Int = NDArray[np.int32]


@numba.njit(nogil=True, cache=True, error_model="numpy")
def eval_bsdf(
    surface: Surface, t: int, point: Float, normal: Float, to_camera: Float, to_light: Float, weights: Float
) -> float:
    """f of the material at a point for world directions, at one wavelength; a blend by its mask's value. All (3,).

    normal: the facet's, on the side of camera and light. f is that of `render.world.surface_interaction` where shading
    differs.
    """
    rgb, f, o, i, frame = np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty((3, 3))
    slot, share, total = surface.object_id[t], 1.0, 0.0
    over = surface.second[slot]
    if over >= 0:
        mask = surface.mask_shape
        lookup(surface, mask[slot, 0], mask[slot, 1], mask[slot, 2], t, point[0], point[1], point[2], rgb)
        share = 1.0 - rgb[0]
    facing = normal[0] * to_light[0] + normal[1] * to_light[1] + normal[2] * to_light[2]
    for part in range(2 if over >= 0 else 1):
        if part == 1:
            slot, share = over, 1.0 - share
        if share <= 0.0:
            continue
        slot_reflectance(surface, slot, t, point[0], point[1], point[2], rgb)
        rho = weights[0] * rgb[0] + weights[1] * rgb[1] + weights[2] * rgb[2]
        row = surface.rows[slot]
        detail = surface.detail[slot] != 0
        if is_diffuse(row) and not detail:
            total += share * rho / math.pi
            continue
        if detail:
            p0, p1, p2 = point[0], point[1], point[2]
            row = row.copy()
            detailed(surface, t, slot, p0, p1, p2, normal[0], normal[1], normal[2], row[1:3], frame)
        else:
            to_local(surface, t, row, normal[0], normal[1], normal[2], frame)
        for axis in range(3):
            o[axis] = frame[axis, 0] * to_camera[0] + frame[axis, 1] * to_camera[1] + frame[axis, 2] * to_camera[2]
            i[axis] = frame[axis, 0] * to_light[0] + frame[axis, 1] * to_light[1] + frame[axis, 2] * to_light[2]
        # both are above the facet; what is below the shading normal gets nothing
        if o[2] <= 0.0 or i[2] <= 0.0:
            continue
        rgb[0] = rgb[1] = rgb[2] = rho
        evaluate(row, rgb, o[0], o[1], o[2], i[0], i[1], i[2], f)
        total += share * f[0] * light_side(i[2], facing)
    return total


def _shade_kernel(glossy: bool, aperture: bool) -> Any:  # noqa: PLR0915
    """The shading kernel; compiled apart for diffuse materials alone and for a pinhole, where it is much quicker."""

    @numba.njit(nogil=True, cache=True, error_model="numpy")
    def shade(  # noqa: PLR0913, PLR0915
        surface: Surface,
        view: View,
        triangle: Int,
        normalised: Float,
        offsets: Float32,
        lens: Float,
        cells: int,
        T_laser_world: Float,
        laser_centre: Float,
        beam: Float,
        weights: Float,
        centre: Float,
        surface_offset: float,
        values: Float,
        planes: Float,
        origins: Float32,
        directions: Float32,
        far: Float32,
        sample: Int,
    ) -> tuple[int, int]:
        """Unoccluded radiance of each ray's cell and whole pixel -> values (n, 2), and the shadow rays that decide.

        Returns how many shadow rays were written; `sample` says whose each is; and how many rays were left out since
        their radiance is no number, infinite or negative. With an aperture, lens (n, 2) are the
        rays' points of it, and planes (n, 5) take q in the middle of the pixel and its change with u, v, a and b;
        without one planes (n, 4), unless empty, take what `render.laser_direct.centre_ray` needs.
        """
        intrinsics, k, m, w = view.intrinsics, view.distortion, view.T_world_camera, T_laser_world
        vertices, triangles = surface.vertices, surface.triangles
        tilt = tilt_matrix(k[12], k[13])
        distorted = bool(np.any(k))
        o0, o1, o2 = m[0, 3], m[1, 3], m[2, 3]
        emitter, _ = sheet_sigma(0.0, beam)
        to_light, to_camera, point, normal, rgb = np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3)
        count = dropped = 0
        facet = -1
        a0 = a1 = a2 = n0 = n1 = n2 = area = height_laser = 0.0
        half = 0.5 / cells
        looking = not aperture and planes.shape[0] > 0
        for r in range(triangle.shape[0]):
            values[r, 0] = values[r, 1] = 0.0
            if looking:
                planes[r, 3] = 0.0
            t = triangle[r]
            x, y = normalised[r, 0], normalised[r, 1]
            if t < 0 or x != x:
                continue
            if t != facet:
                # rays of a pixel mostly meet one triangle
                facet = t
                ia, ib, ic = triangles[t, 0], triangles[t, 1], triangles[t, 2]
                a0, a1, a2 = vertices[ia, 0], vertices[ia, 1], vertices[ia, 2]
                ab0, ab1, ab2 = vertices[ib, 0] - a0, vertices[ib, 1] - a1, vertices[ib, 2] - a2
                ac0, ac1, ac2 = vertices[ic, 0] - a0, vertices[ic, 1] - a1, vertices[ic, 2] - a2
                n0, n1, n2 = ab1 * ac2 - ab2 * ac1, ab2 * ac0 - ab0 * ac2, ab0 * ac1 - ab1 * ac0
                area = math.sqrt(n0 * n0 + n1 * n1 + n2 * n2)
                n0, n1, n2 = n0 / area, n1 / area, n2 / area
                height_laser = n0 * (laser_centre[0] - a0) + n1 * (laser_centre[1] - a1) + n2 * (laser_centre[2] - a2)
            if area == 0.0:
                continue
            if aperture:
                o0, o1, o2 = lens_position(view, lens[r, 0], lens[r, 1])
            height_camera = n0 * (o0 - a0) + n1 * (o1 - a1) + n2 * (o2 - a2)
            if not height_camera * height_laser > 0.0:
                continue
            side = 1.0 if height_camera > 0.0 else -1.0
            # the ray d = R (x, y, 1) meets the facet's plane at P = o + s d
            d0, d1, d2 = (
                m[0, 0] * x + m[0, 1] * y + m[0, 2],
                m[1, 0] * x + m[1, 1] * y + m[1, 2],
                m[2, 0] * x + m[2, 1] * y + m[2, 2],
            )
            if aperture:
                d0, d1, d2 = lens_direction(view, x, y, lens[r, 0], lens[r, 1])
            cosine = n0 * d0 + n1 * d1 + n2 * d2
            if cosine == 0.0:
                continue
            s = -height_camera / cosine
            p0, p1, p2 = o0 + s * d0, o1 + s * d1, o2 + s * d2
            # laser coordinates of P
            lx = w[0, 0] * p0 + w[0, 1] * p1 + w[0, 2] * p2 + w[0, 3]
            ly = w[1, 0] * p0 + w[1, 1] * p1 + w[1, 2] * p2 + w[1, 3]
            lz = w[2, 0] * p0 + w[2, 1] * p1 + w[2, 2] * p2 + w[2, 3]
            if lz <= 1e-9:
                continue
            h = fan_density(ly / lz, beam)
            if h == 0.0:
                continue
            sigma, slope = sheet_sigma(lz, beam)
            # dP/du and dP/dv on the facet
            xu, xv = 1.0 / intrinsics[0], -intrinsics[4] / (intrinsics[0] * intrinsics[1])
            yu, yv = 0.0, 1.0 / intrinsics[1]
            if distorted:
                _, _, jxx, jxy, jyx, jyy = distort(x, y, k, tilt)
                det = jxx * jyy - jxy * jyx
                xu, xv, yu, yv = (
                    jyy * xu / det,
                    (jyy * xv - jxy * yv) / det,
                    -jyx * xu / det,
                    (-jyx * xv + jxx * yv) / det,
                )
            if aperture:
                # the focus differs along a tilted sensor, which turns a ray through the rim
                gu, gv = view.lens[2] * xu + view.lens[3] * yu, view.lens[2] * xv + view.lens[3] * yv
                xu, xv = xu + gu * lens[r, 0], xv + gv * lens[r, 0]
                yu, yv = yu + gu * lens[r, 1], yv + gv * lens[r, 1]
            q = lx / sigma
            qu = sheet_slope(xu, yu, m, w, n0, n1, n2, d0, d1, d2, s, cosine, q, sigma, slope)
            qv = sheet_slope(xv, yv, m, w, n0, n1, n2, d0, d1, d2, s, cosine, q, sigma, slope)
            du, dv = offsets[r, 0], offsets[r, 1]
            cell = r % (cells * cells)
            pixel_u, pixel_v = (cell % cells + 0.5) / cells - 0.5 + du, (cell // cells + 0.5) / cells - 0.5 + dv
            in_cell = mean_over(q - qu * du - qv * dv, qu * half, qv * half)
            if aperture:
                off_focus = 1.0 / s - (view.lens[1] - view.lens[2] * x - view.lens[3] * y)
                qa = off_focus * sheet_slope(1.0, 0.0, m, w, n0, n1, n2, d0, d1, d2, s, cosine, q, sigma, slope)
                qb = off_focus * sheet_slope(0.0, 1.0, m, w, n0, n1, n2, d0, d1, d2, s, cosine, q, sigma, slope)
                middle = q - qu * pixel_u - qv * pixel_v - qa * lens[r, 0] - qb * lens[r, 1]
                in_pixel = about_over_aperture(middle, qu * 0.5, qv * 0.5, view.lens[0] * math.hypot(qa, qb))
                planes[r, 0], planes[r, 1], planes[r, 2], planes[r, 3], planes[r, 4] = middle, qu, qv, qa, qb
            else:
                if not looking:
                    in_pixel = about_over(q - qu * pixel_u - qv * pixel_v, qu * 0.5, qv * 0.5)
                else:
                    in_pixel = in_cell
                    planes[r, 0], planes[r, 1], planes[r, 2] = q, qu, qv
                    planes[r, 3] = BEYOND if in_cell == 0.0 else 0.0
            if in_cell == 0.0 and in_pixel == 0.0:
                continue
            # irradiance without the Gaussian: P h / (z sigma) |n . (x sigma'/sigma, y/z, 1)|
            ln0 = w[0, 0] * n0 + w[0, 1] * n1 + w[0, 2] * n2
            ln1 = w[1, 0] * n0 + w[1, 1] * n1 + w[1, 2] * n2
            ln2 = w[2, 0] * n0 + w[2, 1] * n1 + w[2, 2] * n2
            power = beam[0] * h / (lz * sigma) * abs(ln0 * q * slope + ln1 * ly / lz + ln2)
            # the light comes from the emitting segment at z = 0, of half-width `emitter` for a focused sheet
            shift = q * emitter
            t0 = laser_centre[0] + w[0, 0] * shift - p0
            t1 = laser_centre[1] + w[0, 1] * shift - p1
            t2 = laser_centre[2] + w[0, 2] * shift - p2
            distance = math.sqrt(t0 * t0 + t1 * t1 + t2 * t2)
            slot = surface.object_id[t]
            plain = is_diffuse(surface.rows[slot]) and surface.second[slot] < 0 and surface.detail[slot] == 0
            if not glossy or plain:
                slot_reflectance(surface, slot, t, p0, p1, p2, rgb)
                radiance = power / math.pi * (weights[0] * rgb[0] + weights[1] * rgb[1] + weights[2] * rgb[2])
            else:
                length = math.sqrt(d0 * d0 + d1 * d1 + d2 * d2)
                to_camera[0], to_camera[1], to_camera[2] = -d0 / length, -d1 / length, -d2 / length
                to_light[0], to_light[1], to_light[2] = t0 / distance, t1 / distance, t2 / distance
                point[0], point[1], point[2] = p0, p1, p2
                normal[0], normal[1], normal[2] = side * n0, side * n1, side * n2
                radiance = power * eval_bsdf(surface, t, point, normal, to_camera, to_light, weights)
            light = radiance * (in_cell + in_pixel)
            if not 0.0 < light < np.inf:
                dropped += light != 0.0
                continue
            values[r, 0], values[r, 1] = radiance * in_cell, radiance * in_pixel
            if looking:
                planes[r, 3] = radiance
            origins[count, 0] = p0 - centre[0] + side * n0 * surface_offset
            origins[count, 1] = p1 - centre[1] + side * n1 * surface_offset
            origins[count, 2] = p2 - centre[2] + side * n2 * surface_offset
            directions[count, 0] = t0 / distance
            directions[count, 1], directions[count, 2] = t1 / distance, t2 / distance
            far[count] = distance
            sample[count] = r
            count += 1
        return count, dropped

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
    """Sum the visible cells of each pixel -> mean (n,), the standard error that the predictions' spread implies, and
    the range of these predictions.
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
        # an edge that cuts off a corner of area p crosses the cells of a length of 2 sqrt(p), of a variance of 1/6 each
        spread = max(spread, jump[i] * math.sqrt(spread) / 3.0)
        # jittered sampling of an edge or a slope: the variance falls with the 3/2 power of the number of cells
        error[i] = math.sqrt(spread) / n**0.75


@numba.njit(nogil=True, cache=True)
def place(pixels: Int, mean: Float, image: Float32) -> int:
    """Write each pixel's radiance (n,) into the flat image, 0 where it is none; returns in how many it is none."""
    dropped = 0
    for i in range(pixels.shape[0]):
        if 0.0 <= mean[i] < np.inf:
            image[pixels[i]] = mean[i]
        else:
            dropped += 1
    return dropped
