"""How camera paths begin: rays spread over the area of their pixels and the lens."""

from __future__ import annotations

import math

import numba
import numpy as np

from render.base.arrays import Float
from render.base.borrowed import borrowed
from render.camera.distortion import tilt_matrix
from render.camera.lens import chief_ray, lens_direction, lens_position
from render.camera.view import View
from render.laser_indirect.connections import CameraSampling, path_lens_point
from render.laser_indirect.path_vertex import Records
from render.laser_indirect.sampling import DrawnPaths
from render.sampling.random import uniform

MOST_OF_A_KEY = 1 << 16
"""More than the camera paths that a pixel may have in a pass."""


@numba.njit(nogil=True, cache=True, error_model="numpy")
def pixel_rays(
    sampling: CameraSampling, drawn: DrawnPaths, seed: int, origin: Float, direction: Float, paths: Records
) -> None:
    """Camera paths for some pixels, spread over each pixel's area, with random numbers by their number or key."""
    sampling, drawn, origin, direction = borrowed(sampling), borrowed(drawn), borrowed(origin), borrowed(direction)
    paths = borrowed(paths)
    pixels, keys, starts = drawn
    view = sampling.camera
    tilt = tilt_matrix(view.distortion[12], view.distortion[13])
    distorted = bool(np.any(view.distortion))
    r = 0
    for n in range(pixels.shape[0]):
        pixel = pixels[n]
        column, row = pixel % view.width, pixel // view.width
        alike = keys.shape[0] > 0
        key = keys[n] if alike else pixel
        u0, v0 = uniform(seed, key, 0, 90), uniform(seed, key, 0, 91)
        count, expected = starts[n + 1] - starts[n], sampling.camera_paths[pixel]
        # where every pass has one, their number need not be known beforehand
        throughput = 1.0 / count if expected >= 1.0 else 1.0 / expected
        for sample in range(count):
            u = column - 0.5 + (u0 + sample * 0.7548776662466927) % 1.0
            v = row - 0.5 + (v0 + sample * 0.5698402909980532) % 1.0
            index = key * MOST_OF_A_KEY + sample if alike else starts[n] + sample
            a, b = path_lens_point(view, seed, index)
            set_pixel_ray(view, tilt, distorted, u, v, a, b, r, origin, direction)
            path = paths[r]
            path.throughput, path.index, path.pixel = throughput, index, pixel
            r += 1


@numba.njit(nogil=True, cache=True, error_model="numpy")
def set_pixel_ray(  # noqa: PLR0913
    view: View,
    tilt: Float,
    distorted: bool,
    u: float,
    v: float,
    a: float,
    b: float,
    r: int,
    origin: Float,
    direction: Float,
) -> None:
    """Ray r (n, 3) of the image point (u, v) through lens point (a, b); one of no length: there is none."""
    x, y, ok = chief_ray(view, tilt, distorted, u, v)
    origin[r, 0], origin[r, 1], origin[r, 2] = lens_position(view, a, b)
    d0, d1, d2 = lens_direction(view, x, y, a, b)
    length = math.sqrt(d0 * d0 + d1 * d1 + d2 * d2) if ok else math.inf
    direction[r, 0], direction[r, 1], direction[r, 2] = d0 / length, d1 / length, d2 / length
