"""The camera's view, as kernels are given it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]


class View(NamedTuple):
    """A camera in the world."""

    width: int
    intrinsics: Float
    """fx, fy, cx, cy, skew."""
    distortion: Float
    """(14,)."""
    folds: Float
    """(720,) `render.camera.distortion.fold_radii`."""
    T_world_camera: Float
    lens: Float
    """(4,) aperture's radius m (0: a pinhole), 1 / focus distance, slopes of the plane of focus (`render.camera.lens`).
    """
