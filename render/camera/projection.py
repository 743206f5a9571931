"""Projection of a point of the camera's frame to the image, for kernels; `Camera.project` does so for arrays."""

from __future__ import annotations

import numba
import numpy as np

from render.base.arrays import Float
from render.camera.distortion import distort, fold_radius_at
from render.camera.view import View

NEAR = 1e-9
"""Depth, m, below which a point has no image."""


@numba.njit(nogil=True, cache=True, error_model="numpy")
def project_point(p: Float, view: View, tilt: Float, distorted: bool) -> tuple[float, float]:
    """Camera-frame point -> (u, v), NaN where it has no image; `tilt` is that of the view's distortion."""
    if p[2] <= NEAR:
        return np.nan, np.nan
    x, y = p[0] / p[2], p[1] / p[2]
    if distorted:
        if np.hypot(x, y) >= fold_radius_at(x, y, view.folds):
            return np.nan, np.nan
        x, y, _, _, _, _ = distort(x, y, view.distortion, tilt)
    intrinsics = view.intrinsics
    return intrinsics[0] * x + intrinsics[4] * y + intrinsics[2], intrinsics[1] * y + intrinsics[3]
