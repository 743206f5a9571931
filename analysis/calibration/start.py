"""Where the joint adjustment begins: OpenCV's calibration of the camera, and a plane through each laser's points."""

from __future__ import annotations

import math
from collections.abc import Sequence

import cv2
import numpy as np

from analysis.calibration.estimate import Estimate
from analysis.calibration.lens import normalise
from analysis.calibration.observations import View
from render.base.arrays import Float
from render.base.errors import InputError

FEWEST_VIEWS = 3
"""Of a camera that is not known."""


def start(
    views: Sequence[View], size: tuple[int, int], terms: int, lasers: int, known: tuple[Float, Float] | None = None
) -> Estimate:
    """Camera, poses and planes from corners and laser points; size (width, height) px.

    known: intrinsics (4,) and distortion of a camera that is calibrated already.
    InputError: too few views; the views do not determine the camera; a laser is on fewer than two boards, or its
    lines are too short for a plane.
    """
    if known is None:
        known = _camera(views, size, terms)
    intrinsics, distortion = known
    rotation, translation = board_poses(views, intrinsics, distortion)
    estimate = Estimate(intrinsics, distortion, np.zeros(2), np.zeros((0, 3)), rotation, translation)
    planes = [_plane(views, estimate, laser) for laser in range(lasers)]
    return Estimate(intrinsics, distortion, np.zeros(2), np.array(planes).reshape(-1, 3), rotation, translation)


def _camera(views: Sequence[View], size: tuple[int, int], terms: int) -> tuple[Float, Float]:
    if len(views) < FEWEST_VIEWS:
        raise InputError(
            "too few views of the board",
            found=len(views),
            allowed=f"{FEWEST_VIEWS} or more, better 15",
            cure="photograph the board at other tilts and distances",
        )
    objects = [np.column_stack([view.target, np.zeros(len(view.target))]).astype(np.float32) for view in views]
    pixels = [view.pixel.astype(np.float32).reshape(-1, 1, 2) for view in views]
    # the first terms alone: what more there are would wander off before the poses are known
    fixed = cv2.CALIB_FIX_K3 | cv2.CALIB_FIX_K2 | cv2.CALIB_ZERO_TANGENT_DIST
    if terms == 0:
        fixed |= cv2.CALIB_FIX_K1
    try:
        _, matrix, k, _, _ = cv2.calibrateCamera(objects, pixels, size, None, None, flags=fixed)
    except cv2.error:
        matrix = np.full((3, 3), np.nan)
    intrinsics = np.array([matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2]])
    if not np.all(np.isfinite(intrinsics)) or not 0.1 < intrinsics[0] / max(size) < 100.0:
        raise InputError(
            "the views do not determine the camera",
            found=f"a focal length of {intrinsics[0]:.4g} px",
            cure="photograph the board tilted by 20 to 40 degrees to several sides",
        )
    distortion = np.zeros(terms)
    distortion[: min(terms, 1)] = np.ravel(k)[: min(terms, 1)]
    return intrinsics, distortion


def board_poses(views: Sequence[View], intrinsics: Float, distortion: Float) -> tuple[Float, Float]:
    """(views, 3, 3) and (views, 3) m, from board to camera, of a camera that is known."""
    rotation, translation = np.empty((len(views), 3, 3)), np.empty((len(views), 3))
    for i, view in enumerate(views):
        flat = np.column_stack([view.target, np.zeros(len(view.target))])
        q = normalise(view.pixel, intrinsics, distortion)
        _, turn, shift = cv2.solvePnP(flat, q.reshape(-1, 1, 2), np.eye(3), None, flags=cv2.SOLVEPNP_IPPE)
        rotation[i], translation[i] = cv2.Rodrigues(turn)[0], shift.ravel()
    return rotation, translation


def laser_places(views: Sequence[View], estimate: Estimate, laser: int) -> tuple[Float, np.ndarray]:
    """(m, 3) m, where the laser's points are on the boards, in the camera frame, and (m,) the view of each."""
    points, numbers = [np.empty((0, 3))], [np.empty(0, dtype=np.intp)]
    for i, view in enumerate(views):
        for stripe in view.stripes:
            if stripe.laser != laser:
                continue
            q = normalise(stripe.pixel, estimate.intrinsics, estimate.distortion)
            rays = np.column_stack([q, np.ones(len(q))])
            normal = estimate.rotation[i][:, 2]
            points.append(rays * (normal @ estimate.translation[i] / (rays @ normal))[:, None])
            numbers.append(np.full(len(rays), i))
    return np.concatenate(points), np.concatenate(numbers)


def _plane(views: Sequence[View], estimate: Estimate, laser: int) -> Float:
    """The plane m about which half of the points are nearest, of the planes through two boards' lines."""
    points, number = laser_places(views, estimate, laser)
    if len(np.unique(number)) < 2:
        raise InputError(
            f"laser {laser} is on the board in {len(np.unique(number))} views",
            allowed="2 or more at different distances",
            cure="hold the board where the laser's line crosses it",
        )
    rng, best = np.random.default_rng(0), (np.inf, np.zeros(3))
    for _ in range(100):
        pair = np.isin(number, rng.choice(np.unique(number), 2, replace=False))
        some = points[pair]
        if len(some) < 3:  # a single point of either line: no plane
            continue
        middle = some.mean(axis=0)
        normal = np.linalg.svd(some - middle, full_matrices=False)[2][2]
        away = float(np.median(np.abs((points - middle) @ normal)))
        offset = float(normal @ middle)
        if away < best[0] and abs(offset) > 1e-6:
            best = (away, normal / offset)
    if not math.isfinite(best[0]):
        raise InputError(
            f"the lines of laser {laser} on the board are in no plane",
            found=f"{len(points)} points in {len(np.unique(number))} views",
            allowed="3 points or more on two of the lines, in a plane that does not pass the camera's centre",
            cure="hold the board where the laser's line crosses more of it",
        )
    return best[1]
