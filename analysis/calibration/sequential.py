"""The two usual ways, step by step: what they lose is what estimating everything at once is worth.

By homographies, as the founding paper does: OpenCV's camera, a board's pose out of its homography, the laser plane as
the singular vector of all (x, y, z, 1). By total least squares: camera and poses adjusted to all corners, and the plane
through the points' middle that leaves the least squares of distances. Neither tells its errors.
Source: Zhang, A flexible new technique for camera calibration, 2000, sections 3.1 and 3.2.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import cv2
import numpy as np

from analysis.calibration.adjust import adjust
from analysis.calibration.estimate import Estimate, free_parameters
from analysis.calibration.lens import normalise
from analysis.calibration.observations import View, gather
from analysis.calibration.start import laser_places, start
from render.base.arrays import Float
from render.base.errors import InputError

FREE = {
    0: cv2.CALIB_ZERO_TANGENT_DIST | cv2.CALIB_FIX_K1 | cv2.CALIB_FIX_K2 | cv2.CALIB_FIX_K3,
    4: cv2.CALIB_FIX_K3,
    5: 0,
    8: cv2.CALIB_RATIONAL_MODEL,
    12: cv2.CALIB_RATIONAL_MODEL | cv2.CALIB_THIN_PRISM_MODEL,
    14: cv2.CALIB_RATIONAL_MODEL | cv2.CALIB_THIN_PRISM_MODEL | cv2.CALIB_TILTED_MODEL,
}
"""OpenCV's flags, by the number of distortion terms."""


def by_homographies(views: Sequence[View], target: Float, size: tuple[int, int], terms: int, lasers: int) -> Estimate:
    """Arguments and errors as of `by_total_least_squares`."""
    start(views, size, terms, lasers)  # what it refuses has no answer by this way either
    flat = [np.column_stack([view.target, np.zeros(len(view.target))]).astype(np.float32) for view in views]
    pixels = [view.pixel.astype(np.float32).reshape(-1, 1, 2) for view in views]
    try:
        _, matrix, k, _, _ = cv2.calibrateCamera(flat, pixels, size, None, None, flags=FREE[terms])
    except cv2.error as error:
        raise InputError("the views do not determine the camera", found=error.err) from None
    intrinsics = np.array([matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2]])
    distortion = np.ravel(k)[:terms].astype(np.float64)
    poses = [_pose(view.target, normalise(view.pixel, intrinsics, distortion)) for view in views]
    rotation, translation = (np.array(part) for part in zip(*poses, strict=True))
    found = Estimate(intrinsics, distortion, np.zeros(2), np.zeros((0, 3)), rotation, translation)
    return _with_planes(found, views, lasers, _homogeneous_plane)


def by_total_least_squares(
    views: Sequence[View], target: Float, size: tuple[int, int], terms: int, lasers: int
) -> Estimate:
    """target (n, 2) m, all corners of the board; size (width, height) px; terms of distortion as of `LENGTHS`.

    InputError: as of `start` and `adjust`.
    """
    guess = start(views, size, terms, lasers)
    extent = np.stack([target.min(axis=0), target.max(axis=0)])
    corners = gather([replace(view, stripes=()) for view in views], extent)
    alone = replace(guess, planes=np.zeros((0, 3)))
    found = adjust(corners, alone, free_parameters(alone, warp=False)).estimate
    return _with_planes(found, views, lasers, _nearest_plane)


def _pose(target: Float, q: Float) -> tuple[Float, Float]:
    """(n, 2) m and (n, 2) normalised -> (3, 3) and (3,) m, from board to camera."""
    homography = np.asarray(cv2.findHomography(target, q)[0])
    homography = homography * np.sign(homography[2, 2]) / np.linalg.norm(homography[:, :2], axis=0).mean()
    first, second, shift = homography.T
    left, _, right = np.linalg.svd(np.column_stack([first, second, np.cross(first, second)]))
    return left @ right, shift


def _with_planes(
    estimate: Estimate, views: Sequence[View], lasers: int, plane: Callable[[Float, Float], Float]
) -> Estimate:
    planes = []
    for laser in range(lasers):
        points, _ = laser_places(views, estimate, laser)
        sigma = [stripe.sigma for view in views for stripe in view.stripes if stripe.laser == laser]
        # what a pixel is in space grows with distance
        planes.append(plane(points, 1.0 / (np.concatenate(sigma) * points[:, 2])))
    return replace(estimate, planes=np.array(planes).reshape(-1, 3))


def _homogeneous_plane(points: Float, weight: Float) -> Float:
    """(m, 3) m -> (3,) m, all points alike; it depends on the unit of length."""
    vector = np.linalg.svd(np.column_stack([points, np.ones(len(points))]), full_matrices=False)[2][3]
    return np.asarray(-vector[:3] / vector[3])


def _nearest_plane(points: Float, weight: Float) -> Float:
    """(m, 3) m and weights (m,), 1 / sigma -> (3,) m."""
    middle = np.average(points, axis=0, weights=weight**2)
    normal = np.linalg.svd((points - middle) * weight[:, None], full_matrices=False)[2][2]
    return np.asarray(normal / (normal @ middle))


WAYS = {"by homographies": by_homographies, "by total least squares": by_total_least_squares}
