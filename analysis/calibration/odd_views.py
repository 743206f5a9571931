"""Photographs that are not of the calibrated camera as it was: mirrored ones, and those of another focus.

Corners alone hardly tell: a board's pose takes up most of either. A mirrored photograph is known by its laser line,
which is where the plane has it once the photograph is turned back; another focus by the factor of the focal length that
each view asks for, which the laser's line tells beside the board's perspective.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy import stats

from analysis.calibration.adjust import adjust
from analysis.calibration.estimate import Estimate
from analysis.calibration.observations import Observations, View, gather
from analysis.calibration.residuals import corners, laser_points
from analysis.calibration.robust import BAD, Adjusted
from analysis.calibration.start import board_poses
from render.base.arrays import Bool, Float

CLEARLY_BETTER = 0.2
"""Of a line's residuals as the photograph is: what they must fall to once it is turned back."""
CHANCE = 1e-4
"""Of a good set: that it is said to have a moved focus."""
LEAST_CHANGE = 1e-3
"""Of the focal length: a smaller change does no harm that the errors told do not hold."""
FEWEST = 5
"""Views of one focus from which those of another can be told."""


def mirrored(views: Sequence[View], adjusted: Adjusted, extent: Float, width: int) -> dict[str, str]:
    """Name of each mirrored view, and the sentence; width of the image, px."""
    told = {}
    for view in views:
        if view.name in adjusted.seen.names and not _has_line(adjusted, view.name) and view.stripes:
            as_is = _line_off(view, adjusted, extent)
            back = _line_off(_turned_back(view, extent, width), adjusted, extent)
            if back < min(CLEARLY_BETTER * as_is, 2.0 * BAD):
                told[view.name] = (
                    f"{view.name}: a mirrored photograph: its line is where it should be once left and right are "
                    "changed; the view is left out; turn off the mirroring of camera or converter"
                )
    return told


def refocused(adjusted: Adjusted) -> dict[str, str]:
    """Name of each view of another focal length than most, and the sentence; none where a motion holds the boards."""
    estimate, seen = adjusted.solution.estimate, adjusted.seen
    if estimate.motion is not None or len(seen.names) < FEWEST + 1:
        return {}
    change, information = focal_changes(seen, estimate)
    others = _other_focus(change, information)
    if others is None:
        return {}
    off = _mean(change, information, others) - _mean(change, information, ~others)
    return {
        name: f"{name}: its focal length is {'longer' if off > 0.0 else 'shorter'} than the others', as after the "
        "focus or zoom was moved; the view is left out; fix both and photograph it again"
        for name, other in zip(seen.names, others, strict=True)
        if other
    }


def focal_changes(seen: Observations, estimate: Estimate) -> tuple[Float, Float]:
    """(views,) share by which the focal length of each view is longer than the estimate's, and the inverse variance.

    One step of least squares with the view's own pose; all else is held, as many views know it better than one.
    """
    at_corners, (at_lasers, _) = corners(seen, estimate), laser_points(seen, estimate)
    of_residual = np.concatenate([np.repeat(seen.view, 2), seen.laser_view])
    residual = np.concatenate([at_corners.residual, at_lasers.residual])
    by_pose = np.concatenate([at_corners.by_pose, at_lasers.by_pose])
    by_focal = np.concatenate([at_corners.by_shared[:, :2], at_lasers.by_shared[:, :2]]) @ estimate.intrinsics[:2]
    change, information = np.zeros(seen.count), np.zeros(seen.count)
    for number in range(seen.count):
        own = of_residual == number
        basis, _ = np.linalg.qr(by_pose[own])
        along = by_focal[own] - basis @ (basis.T @ by_focal[own])
        information[number] = along @ along
        change[number] = -(along @ residual[own]) / max(information[number], 1e-300)
    return change, information


def _other_focus(change: Float, information: Float) -> Bool | None:
    """(views,) the fewer, of views of two focal lengths: all from one on, as names have them in turn, or a single one.

    None: chance makes differences as large.
    """
    count = len(change)
    after = np.arange(count) >= np.arange(1, count)[:, None]
    splits = np.concatenate([after, np.eye(count, dtype=bool)])
    off = np.array([_mean(change, information, one) - _mean(change, information, ~one) for one in splits])
    weight = np.array([1.0 / (1.0 / information[one].sum() + 1.0 / information[~one].sum()) for one in splits])
    score = np.where(np.abs(off) > LEAST_CHANGE, off**2 * weight, 0.0)
    best = int(np.argmax(score))
    if len(splits) * stats.chi2.sf(score[best], 1) > CHANCE:
        return None
    there = splits[best]
    fewer = there if np.count_nonzero(there) <= count // 2 else ~there
    return np.asarray(fewer) if count - np.count_nonzero(fewer) >= FEWEST else None


def _mean(change: Float, information: Float, which: Bool) -> float:
    return float(np.average(change[which], weights=information[which] + 1e-300))


def _has_line(adjusted: Adjusted, name: str) -> bool:
    number = adjusted.seen.names.index(name)
    return bool(np.any(adjusted.seen.laser_weight[adjusted.seen.laser_view == number] > 0.0))


def _turned_back(view: View, extent: Float, width: int) -> View:
    """Left and right changed, in the image and on the board."""
    flip = np.array([-1.0, 1.0])
    target = np.column_stack([extent[:, 0].sum() - view.target[:, 0], view.target[:, 1]])
    stripes = tuple(replace(one, pixel=one.pixel * flip + [width - 1.0, 0.0]) for one in view.stripes)
    covariance = view.covariance * np.outer(flip, flip)
    return replace(
        view, pixel=view.pixel * flip + [width - 1.0, 0.0], covariance=covariance, target=target, stripes=stripes
    )


def _line_off(view: View, adjusted: Adjusted, extent: Float) -> float:
    """Typical residual of a view's laser points where its corners pose the board, in those of all."""
    estimate = adjusted.solution.estimate
    posed = estimate.with_poses(*board_poses([view], estimate.intrinsics, estimate.distortion))
    seen = gather([view], extent)
    alone = replace(seen, laser_weight=np.zeros(len(seen.laser_weight)))
    held = np.zeros(len(estimate.shared), dtype=bool)
    there = adjust(alone, posed, held).estimate
    off = np.abs(laser_points(seen, there)[0].residual)
    return float(np.median(off)) / 0.6745 / max(adjusted.laser_scale, 1.0)
