"""A camera at its pose, as kernels read it."""

from __future__ import annotations

from typing import NamedTuple

from render.base.arrays import Float


class View(NamedTuple):
    """A camera in the world."""

    width: int
    """Width of the image, px."""
    intrinsics: Float
    """(5,) fx, fy, cx, cy, skew, px."""
    distortion: Float
    """(14,) coefficients in OpenCV's order."""
    folds: Float
    """(720,) fold radius by angle, as `render.camera.distortion.fold_radii` gives it."""
    T_world_camera: Float
    """(4, 4) pose of the camera."""
    lens: Float
    """(4,) aperture's radius, m (0: a pinhole), 1 / focus distance and the slopes g1, g2 of the plane of focus, 1/m
    (`render.camera.lens`).
    """
