"""Rays through jittered cells of pixels: how every camera-side stage looks into the scene."""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray

from render.distortion import tilt_matrix, undistort
from render.random import uniform
from render.surface import View

Float = NDArray[np.float64]
Float32 = NDArray[np.float32]
Int = NDArray[np.int32]


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
