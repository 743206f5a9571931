"""Shading of previews: headlight and laser light of a pixel from one ray, without shadows; wax and skin as diffuse.

The line across a pixel is integrated in closed form on the facet's plane, as in `render.laser_direct.integrator`, but
more coarsely.
"""

from __future__ import annotations

import math

import numba
import numpy as np

from render.base.arrays import Float, Float32, Int
from render.base.vectors import Vector, divided, dot, length, rotated, scaled
from render.laser.irradiance import INV_SQRT_2PI, SHEET_SIGMAS, SQRT2, fan_density, sheet_sigma
from render.material.bsdf import evaluate, is_diffuse
from render.material.record import ALPHA_X, ALPHA_Y, KIND, SUBSURFACE
from render.world.surface_interaction import interaction, light_side
from render.world.triangles import Surface, reflectance


@numba.njit(nogil=True, cache=True, error_model="numpy")
def mean_across(q: float, slope_u: float, slope_v: float) -> float:
    """Mean of the unit Gaussian over a pixel in which q changes by the slopes: a box, widened by the lesser slope."""
    wide, narrow = max(abs(slope_u), abs(slope_v)), min(abs(slope_u), abs(slope_v))
    sigma = math.sqrt(1.0 + narrow * narrow / 12.0)
    if abs(q) > SHEET_SIGMAS * sigma + 0.5 * wide:
        return 0.0
    if wide < 1e-3 * sigma:
        return math.exp(-0.5 * (q / sigma) ** 2) * INV_SQRT_2PI / sigma
    low, high = (q - 0.5 * wide) / (sigma * SQRT2), (q + 0.5 * wide) / (sigma * SQRT2)
    return 0.5 * (math.erf(high) - math.erf(low)) / wide


@numba.njit(nogil=True, cache=True, error_model="numpy")
def unit(a: Vector) -> Vector:
    return divided(a, length(a))


@numba.njit(nogil=True, cache=True, error_model="numpy")
def is_plain(surface: Surface, t: int) -> bool:
    """Triangle t is shown as diffuse, of one material and without a shading normal."""
    slot = surface.object_id[t]
    row = surface.rows[slot]
    diffuse = is_diffuse(row) or row[KIND] == SUBSURFACE
    return diffuse and surface.second[slot] < 0 and surface.detail[slot] == 0


@numba.njit(nogil=True, cache=True, error_model="numpy")
def bsdf_bands(
    surface: Surface, t: int, point: Vector, normal: Vector, to_camera: Vector, to_light: Vector, choice: float
) -> Vector:
    """BSDF in R, G, B, 1/sr, of triangle t at a point for unit directions; 0 where light or camera is below it.

    normal: the facet's, on the camera's side. choice: in [0, 1), of a blend's materials.
    """
    rgb, alpha, frame = np.empty(3), np.empty(2), np.empty((3, 3))
    slot = interaction(surface, t, point, normal, choice, rgb, alpha, frame)
    row = surface.rows[slot].copy()
    row[ALPHA_X], row[ALPHA_Y] = alpha[0], alpha[1]
    wo, wi = rotated(frame, to_camera), rotated(frame, to_light)
    if wo[2] <= 0.0 or wi[2] <= 0.0:
        return 0.0, 0.0, 0.0
    return scaled(light_side(wi[2], dot(normal, to_light)), evaluate(row, (rgb[0], rgb[1], rgb[2]), wo, wi))


@numba.njit(nogil=True, cache=True, error_model="numpy")
def shade_pixels(  # noqa: PLR0913
    surface: Surface,
    T_object_camera: Float,
    pixel: Float,
    directions: Float32,
    triangle: Int,
    far: Float32,
    T_laser_object: Float,
    beams: Float,
    weights: Float,
    shade: Float32,
    light: Float32,
) -> None:
    """Rays (n, 3) that hit (n,) triangles, -1 for none -> far (n,), shade (n, 3), unshadowed laser radiance (l, n).

    pixel (2,): 1 / fx and 1 / fy. Of each laser: pose (l, 4, 4), `LineLaser.packed` (l, 8), weights of R, G, B (l, 3).
    """
    v, triangles, m = surface.vertices, surface.triangles, T_object_camera
    rgb, steps = np.empty(3), np.empty(2)
    for i in range(triangle.shape[0]):
        t = triangle[i]
        if t < 0:
            continue
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        ab0, ab1, ab2 = v[b, 0] - v[a, 0], v[b, 1] - v[a, 1], v[b, 2] - v[a, 2]
        ac0, ac1, ac2 = v[c, 0] - v[a, 0], v[c, 1] - v[a, 1], v[c, 2] - v[a, 2]
        n0, n1, n2 = ab1 * ac2 - ab2 * ac1, ab2 * ac0 - ab0 * ac2, ab0 * ac1 - ab1 * ac0
        n0, n1, n2 = divided((n0, n1, n2), math.sqrt(n0 * n0 + n1 * n1 + n2 * n2))
        d0, d1, d2 = float(directions[i, 0]), float(directions[i, 1]), float(directions[i, 2])
        facing = n0 * d0 + n1 * d1 + n2 * d2
        s = (n0 * (v[a, 0] - m[0, 3]) + n1 * (v[a, 1] - m[1, 3]) + n2 * (v[a, 2] - m[2, 3])) / facing
        far[i] = s
        p0, p1, p2 = m[0, 3] + s * d0, m[1, 3] + s * d1, m[2, 3] + s * d2
        reflectance(surface, t, p0, p1, p2, rgb)
        cosine = abs(facing) / math.sqrt(d0 * d0 + d1 * d1 + d2 * d2)
        for band in range(3):
            shade[i, band] = cosine * rgb[band]
        # upper bound of a pixel's extent on the facet
        reach = s * max(pixel[0], pixel[1]) * (1.0 + 1.0 / max(cosine, 1e-6))
        for k in range(beams.shape[0]):
            w, beam = T_laser_object[k], beams[k]
            z = w[2, 0] * p0 + w[2, 1] * p1 + w[2, 2] * p2 + w[2, 3]
            if z <= 1e-9:
                continue
            x = w[0, 0] * p0 + w[0, 1] * p1 + w[0, 2] * p2 + w[0, 3]
            sigma, slope = sheet_sigma(z, beam)
            if abs(x) > SHEET_SIGMAS * sigma + 2.2 * reach:
                continue
            y = w[1, 0] * p0 + w[1, 1] * p1 + w[1, 2] * p2 + w[1, 3]
            h = fan_density(y / z, beam)
            if h == 0.0:
                continue
            q = x / sigma
            # from one pixel to the next the point moves on the facet by s (e - (n e) / (n d) d)
            for axis in range(2):
                e0, e1, e2 = m[0, axis] * pixel[axis], m[1, axis] * pixel[axis], m[2, axis] * pixel[axis]
                f = (n0 * e0 + n1 * e1 + n2 * e2) / facing
                g0, g1, g2 = s * (e0 - f * d0), s * (e1 - f * d1), s * (e2 - f * d2)
                dx, dz = w[0, 0] * g0 + w[0, 1] * g1 + w[0, 2] * g2, w[2, 0] * g0 + w[2, 1] * g1 + w[2, 2] * g2
                steps[axis] = (dx - q * slope * dz) / sigma
            mean = mean_across(q, steps[0], steps[1])
            if mean == 0.0:
                continue
            # the facet's normal in the laser's frame; laser and camera must be on the same side of it
            l0 = w[0, 0] * n0 + w[0, 1] * n1 + w[0, 2] * n2
            l1 = w[1, 0] * n0 + w[1, 1] * n1 + w[1, 2] * n2
            l2 = w[2, 0] * n0 + w[2, 1] * n1 + w[2, 2] * n2
            if not facing * (l0 * x + l1 * y + l2 * z) > 0.0:
                continue
            flux = beam[0] * h / (z * sigma) * abs(l0 * q * slope + l1 * y / z + l2)
            f = rgb[0] / math.pi, rgb[1] / math.pi, rgb[2] / math.pi
            if not is_plain(surface, t):
                up = (-n0, -n1, -n2) if facing > 0.0 else (n0, n1, n2)
                to_light = rotated(w[:3, :3].T, (-x, -y, -z))
                f = bsdf_bands(surface, t, (p0, p1, p2), up, unit((-d0, -d1, -d2)), unit(to_light), 0.5)
            light[k, i] = flux * mean * (weights[k, 0] * f[0] + weights[k, 1] * f[1] + weights[k, 2] * f[2])
