"""The state of a wavefront of paths from the camera, how paths begin, and how what they see is added up."""

from __future__ import annotations

import math
from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from render.ambient.directions import Guide
from render.base.arrays import Float, Float32, Int, Long
from render.base.borrowed import borrowed
from render.base.vectors import Vector, row_vector, store_row
from render.camera.distortion import tilt_matrix
from render.camera.lens import chief_ray, lens_direction, lens_point, lens_position
from render.camera.view import View
from render.sampling.low_discrepancy import LENGTH, pair, pair_at, pair_draw

ON_IMAGE, ON_LENS, FIRST_SURFACE, EACH_SURFACE = 0, 1, 2, 4
"""Dimensions of the sequence: two pairs for the camera, then four for each surface."""
INVALID, CLAMPED = 0, 1
"""Counts (2,): contributions that were NaN, infinite or negative, which are dropped; those that were clamped."""
CLAMPED_RADIANCE = 3
"""Sums (.., 4): R, G, B, and the mean of what the clamp took of them."""


class PathState(NamedTuple):
    """The paths under way, one a row."""

    origin: Float32
    """(n, 3) m, from the centre of the scene."""
    direction: Float32
    """(n, 3) unit."""
    throughput: Float32
    """(n, 3) what a radiance seen by the ray adds to its pixel."""
    bsdf_pdf: Float32
    """(n,) with which the direction was drawn, 1/sr; -1: no light could have been sampled in its place, as for a
    single direction, the camera's, or one within a medium."""
    pixel_slot: Int
    """(n,) twice the pixel's place in the chunk, and the half of its samples (0 or 1)."""
    sample: Int
    """(n,) number of the sample in its half."""
    medium: Int
    """(n,) one more than the material that the ray is within; 0: in the open."""
    interior: Long
    """(n,) the overlapping bodies that the ray is within (`render.world.interior_list`)."""


class ShadowRays(NamedTuple):
    """Rays that add `light` (.., 3) to their path's pixel if nothing is met before `far`."""

    origin: Float32
    direction: Float32
    far: Float32
    light: Float32
    pixel_slot: Int
    interior: Long


class Samples(NamedTuple):
    """Where the paths' random numbers come from."""

    table: Float32
    """`render.sampling.low_discrepancy.pair_table`."""
    seed: int
    keys: Int
    """(m,) for each pixel of the chunk the number that its random numbers follow from."""
    guide: Guide
    """Of the directions in which they leave their first surface."""


@numba.njit(nogil=True, cache=True, error_model="numpy")
def camera_rays(
    view: View, samples: Samples, pixels: Int, first: Int, count: Int, centre: Float, paths: PathState
) -> int:
    """Rays of samples first .. first + count of both halves, (m, 2), of pixels (m,) -> paths. Returns how many."""
    view, samples, paths = borrowed(view), borrowed(samples), borrowed(paths)
    table, seed, k = samples.table, samples.seed, view.distortion
    tilt, distorted = tilt_matrix(k[12], k[13]), bool(np.any(k))
    fx, fy, cx, cy, skew = view.intrinsics
    n, draw = 0, np.uint64(0)
    for i in range(pixels.shape[0]):
        column, row = pixels[i] % view.width, pixels[i] // view.width
        for half in range(2):
            index, start = 2 * samples.keys[i] + half, first[i, half]
            for s in range(start, start + count[i, half]):
                if s == start or s % LENGTH == 0:
                    draw = pair_draw(seed, index, s, ON_IMAGE)
                u, v = pair_at(table, draw, s)
                u, v = column - 0.5 + u, row - 0.5 + v
                y = (v - cy) / fy
                x = (u - cx - skew * y) / fx
                if distorted:
                    x, y, ok = chief_ray(view, tilt, distorted, u, v)
                    if not ok:
                        continue
                a = b = 0.0
                if view.lens[0] > 0.0:
                    u, v = pair(table, seed, index, s, ON_LENS)
                    a, b = lens_point(view.lens[0], u, v)
                o0, o1, o2 = lens_position(view, a, b)
                d0, d1, d2 = lens_direction(view, x, y, a, b)
                scale = 1.0 / math.sqrt(d0 * d0 + d1 * d1 + d2 * d2)
                store_row(paths.origin, n, (o0 - centre[0], o1 - centre[1], o2 - centre[2]))
                store_row(paths.direction, n, (scale * d0, scale * d1, scale * d2))
                store_row(paths.throughput, n, (1.0, 1.0, 1.0))
                paths.bsdf_pdf[n], paths.pixel_slot[n], paths.sample[n], paths.medium[n] = -1.0, 2 * i + half, s, 0
                n += 1
    return n


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def accumulate(sums: Float, counts: Float, pixel_slot: int, clamp: float, light: Vector) -> None:
    """Add a contribution in R, G, B to its pixel; what is NaN, infinite or negative is dropped and counted."""
    r, g, b = light
    if not (r >= 0.0 and g >= 0.0 and b >= 0.0 and r + g + b < np.inf):
        counts[INVALID] += 1.0
        return
    largest = max(r, g, b)
    if largest > clamp:
        scale = clamp / largest
        counts[CLAMPED] += 1.0
        sums[pixel_slot, CLAMPED_RADIANCE] += (1.0 - scale) * (r + g + b) / 3.0
        r, g, b = scale * r, scale * g, scale * b
    sums[pixel_slot, 0] += r
    sums[pixel_slot, 1] += g
    sums[pixel_slot, 2] += b


@numba.njit(nogil=True, cache=True, error_model="numpy")
def accumulate_unoccluded(
    shadow_rays: ShadowRays, occluded: NDArray[np.bool_], clamp: float, sums: Float, counts: Float
) -> None:
    """Add what every unoccluded shadow ray sees to its pixel: sums (.., 4), counts (2,)."""
    shadow_rays, sums, counts = borrowed(shadow_rays), borrowed(sums), borrowed(counts)
    for j in range(occluded.shape[0]):
        if not occluded[j]:
            accumulate(sums, counts, shadow_rays.pixel_slot[j], clamp, row_vector(shadow_rays.light, j))
