"""Sets of views from which a calibration cannot become good, each with what to photograph instead."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from analysis.calibration.estimate import Estimate
from analysis.calibration.observations import View
from analysis.calibration.start import laser_places
from render.base.arrays import Float

LEAST_TILT = np.radians(10.0)
LEAST_SECOND_TILT = np.radians(4.0)
LEAST_DEPTH = 0.08
"""Of the mean distance: what the boards' distances should spread over."""
LEAST_COVERAGE = 0.35
"""Share of the image, in tenths a side, in which corners were seen."""
MOST_DRAWN_OUT = 50.0
"""Ratio of the first to the second extent of all laser points: above it they are as good as on one line."""
FEWEST_POINTS = 20
FEWEST_LINES = 5


def complaints(views: Sequence[View], estimate: Estimate, size: tuple[int, int], *, camera: bool = True) -> list[str]:
    """A sentence for each fault of the set; empty where there is none.

    size (width, height) px; camera: the camera is estimated, so that what only it needs is asked for as well.
    """
    found = []
    if camera:
        target = np.concatenate([view.target for view in views])
        middle = np.append(0.5 * (target.min(axis=0) + target.max(axis=0)), 0.0)
        found += _of_poses(estimate, estimate.rotation @ middle + estimate.translation) + _of_coverage(views, size)
    for laser in range(len(estimate.planes)):
        found += _of_laser(views, estimate, laser)
    return found


def _of_poses(estimate: Estimate, middle: Float) -> list[str]:
    """middle (views, 3) m, of the boards: their origins, in a corner, move with the tilt as well."""
    normal = estimate.rotation[:, :, 2]
    normal = normal * np.sign(normal[:, 2:])
    angles = np.arcsin(np.clip(normal[:, :2], -1.0, 1.0))
    about_axis = float(np.quantile(np.linalg.norm(angles, axis=1), 0.9))
    spread = np.linalg.svd(angles - angles.mean(axis=0), compute_uv=False) / np.sqrt(len(angles))
    found, facing = [], about_axis < LEAST_TILT
    if facing:
        found.append(
            f"all boards face the camera, within {np.degrees(about_axis):.0f} deg: focal length and distance cannot be "
            "told apart; photograph the board tilted by 20 to 40 deg to several sides"
        )
    # parallel boards do not tell the focal length either, so that their tilt may have come out as none
    if spread[0] < LEAST_SECOND_TILT:
        found.append(
            "all boards are parallel: they tell no more than one of them; "
            "photograph the board tilted to other sides as well"
        )
    elif spread[1] < LEAST_SECOND_TILT and not facing:
        found.append(
            "the board is tilted about one axis only: the principal point across it cannot be told from the tilt; "
            "photograph it tilted about the other axis as well"
        )
    distance = np.linalg.norm(middle, axis=1)
    if np.ptp(distance) < LEAST_DEPTH * distance.mean():
        found.append(
            f"all boards are at one distance, {distance.mean():.3g} m: what holds there need not hold elsewhere; "
            "photograph the board at the nearest and the farthest distance that will be measured"
        )
    return found


def _of_coverage(views: Sequence[View], size: tuple[int, int]) -> list[str]:
    pixel = np.concatenate([view.pixel for view in views])
    cells = np.unique((np.clip(pixel / np.array(size), 0.0, 0.999) * 10).astype(int), axis=0)
    share = len(cells) / 100.0
    if share >= LEAST_COVERAGE:
        return []
    return [
        f"corners cover {share:.0%} of the image: nothing is known of the lens elsewhere; "
        "photograph the board near the image's edges and corners as well"
    ]


def _of_laser(views: Sequence[View], estimate: Estimate, laser: int) -> list[str]:
    points, number = laser_places(views, estimate, laser)
    _, counts = np.unique(number, return_counts=True)
    long_enough = int(np.count_nonzero(counts >= FEWEST_POINTS))
    if long_enough < FEWEST_LINES:
        return [
            f"line and board of laser {laser} hardly meet: {long_enough} views have {FEWEST_POINTS} points of it or "
            "more; hold the board so that the line runs across all of it"
        ]
    extent = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    if extent[0] < MOST_DRAWN_OUT * max(extent[1], 1e-12):
        return []
    used = np.unique(number)
    normal = estimate.rotation[used][:, :, 2]
    turned = np.linalg.svd(normal - normal.mean(axis=0), compute_uv=False)[0] / np.sqrt(len(used))
    if turned > LEAST_TILT / 2.0:
        return [
            f"all boards turn about the line of laser {laser}: its points are on one straight line in space, about "
            "which the plane may turn; move the board nearer and farther between photographs"
        ]
    return [
        f"the lines of laser {laser} on all boards coincide: its plane may turn about them; "
        "move the board nearer and farther between photographs"
    ]
