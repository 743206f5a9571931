"""Camera rays: stratified over the pixel's area, and over the aperture of a thin lens.

`camera_rays` pass through the lens's centre, `lens_rays` through the whole aperture (a pinhole's is a point).
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from render.base.arrays import Float, Float32, Int
from render.camera.distortion import tilt_matrix, undistort
from render.camera.lens import chief_ray, lens_direction, lens_point, lens_position
from render.camera.view import View
from render.sampling.low_discrepancy import ROWS
from render.sampling.random import bits, uniform

LENS_DIMENSION = 1 << 20
"""First random dimension of the aperture, above those of the pixel's area."""


class LensRays(NamedTuple):
    """Rays through an aperture, cells x cells for each pixel."""

    normalised: Float
    """(n, 2) slopes of the chief ray; NaN: no ray."""
    offsets: Float32
    """(n, 2) px from the centre of the cell."""
    lens: Float
    """(n, 2) point (a, b) of the aperture, m."""
    origins: Float32
    """(n, 3) m."""
    directions: Float32
    """(n, 3) world, of length 1 along the axis."""


@numba.njit(nogil=True, cache=True, error_model="numpy")
def camera_rays(
    view: View,
    pixels: Int,
    cells: int,
    seed: int,
    jittered: bool,
    normalised: Float,
    offsets: Float32,
    directions: Float32,
) -> None:
    """One ray through a jittered point of each of cells x cells cells of (n,) pixels.

    Fills normalised (n cells^2, 2) undistorted image coordinates (NaN: no ray), offsets (.., 2) of the sample from its
    cell's centre in px, and directions (.., 3), world.
    """
    intrinsics, k, rotation = view.intrinsics, view.distortion, view.T_world_camera
    tilt = tilt_matrix(k[12], k[13])
    distorted = bool(np.any(k))
    tolerance = 1e-10 / max(intrinsics[0], intrinsics[1])
    size = 1.0 / cells
    for i in range(pixels.shape[0]):
        column, row = pixels[i] % view.width, pixels[i] // view.width
        for cell in range(cells * cells):
            r = i * cells * cells + cell
            du = dv = 0.0
            if jittered:
                du = (uniform(seed, pixels[i], cell, 2 * cells) - 0.5) * size
                dv = (uniform(seed, pixels[i], cell, 2 * cells + 1) - 0.5) * size
            u = column - 0.5 + (cell % cells + 0.5) * size + du
            v = row - 0.5 + (cell // cells + 0.5) * size + dv
            y = (v - intrinsics[3]) / intrinsics[1]
            x = (u - intrinsics[2] - intrinsics[4] * y) / intrinsics[0]
            ok = True
            if distorted:
                x, y, ok = undistort(x, y, k, tilt, view.folds, tolerance)
            if not ok:
                x = y = np.nan
            normalised[r, 0], normalised[r, 1] = x, y
            offsets[r, 0], offsets[r, 1] = du, dv
            for axis in range(3):
                d = rotation[axis, 0] * x + rotation[axis, 1] * y + rotation[axis, 2]
                directions[r, axis] = d if ok else 0.0


@numba.njit(nogil=True, cache=True)
def _morton(i: int, j: int) -> int:
    """Morton code: the bits of i and j, below 2^6, interleaved."""
    code = 0
    for bit in range(6):
        code |= ((i >> bit) & 1) << (2 * bit) | ((j >> bit) & 1) << (2 * bit + 1)
    return code


@numba.njit(nogil=True, cache=True)
def _net_point(table: Float32, draw: np.uint64, number: int) -> tuple[float, float]:
    """Point `number` of a row of `pair_table`; 64 random bits select the row and its digital shift (XOR).

    Unlike a Cranley-Patterson rotation this preserves nets: four neighbouring cells sample a quarter of the aperture
    each.
    """
    row = np.int64(draw & np.uint64(ROWS - 1))
    x = np.int64(table[row, number, 0] * 2.0**24) ^ np.int64(draw >> np.uint64(40))
    y = np.int64(table[row, number, 1] * 2.0**24) ^ np.int64((draw >> np.uint64(16)) & np.uint64(0xFFFFFF))
    return x * 2.0**-24, y * 2.0**-24


@numba.njit(nogil=True, cache=True, error_model="numpy")
def lens_rays(view: View, table: Float32, pixels: Int, cells: int, seed: int, centre: Float, rays: LensRays) -> None:
    """As `camera_rays`, jittered, each ray through its own point of the aperture -> rays.

    The points are a row of `table`, `pair_table`, in the Morton order of the cells (Ahmed and Wonka 2020): any quad of
    neighbouring cells, or of such quads, has a (0, 2)-net of them.

    centre (3,): that the origins are relative to, as those of Embree's scene are. In float64 the ray is
    `lens_position(view, a, b)`, `lens_direction(view, x, y, a, b)`.
    """
    normalised, offsets, lens, origins, directions = rays
    k = view.distortion
    tilt = tilt_matrix(k[12], k[13])
    distorted = bool(np.any(k))
    size, radius = 1.0 / cells, view.lens[0]
    for i in range(pixels.shape[0]):
        column, row = pixels[i] % view.width, pixels[i] // view.width
        draw = bits(seed, pixels[i], cells, LENS_DIMENSION)
        for cell in range(cells * cells):
            r = i * cells * cells + cell
            ci, cj = cell % cells, cell // cells
            du = (uniform(seed, pixels[i], cell, 2 * cells) - 0.5) * size
            dv = (uniform(seed, pixels[i], cell, 2 * cells + 1) - 0.5) * size
            x, y, ok = chief_ray(
                view, tilt, distorted, column - 0.5 + (ci + 0.5) * size + du, row - 0.5 + (cj + 0.5) * size + dv
            )
            a = b = 0.0
            if radius > 0.0:
                r1, r2 = _net_point(table, draw, _morton(ci, cj))
                a, b = lens_point(radius, r1, r2)
            if not ok:
                x = y = np.nan
            normalised[r, 0], normalised[r, 1] = x, y
            offsets[r, 0], offsets[r, 1] = du, dv
            lens[r, 0], lens[r, 1] = a, b
            o0, o1, o2 = lens_position(view, a, b)
            origins[r, 0], origins[r, 1], origins[r, 2] = o0 - centre[0], o1 - centre[1], o2 - centre[2]
            d0, d1, d2 = lens_direction(view, x, y, a, b)
            directions[r, 0], directions[r, 1], directions[r, 2] = (d0, d1, d2) if ok else (0.0, 0.0, 0.0)
