"""Whether a calibration still holds: one to three new views of the board against what it said, and how well it knew.

With C the calibration's covariance of its parameters and M what the new views tell of them (their poses unknown), an
adjustment that holds to both moves the parameters by s, whose covariance is C - (M + 1 / C)^-1 if nothing has changed:
s measured by it is a chi-square. Sigmas of the new images are first scaled by a fit that is free to follow a change.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import stats

from analysis.calibration.adjust import Prior, Solution, adjust, rescaled, without, without_views
from analysis.calibration.checks import ALARM, LEAST_TOLD, depth_from_board
from analysis.calibration.circles import centre_bias
from analysis.calibration.estimate import Estimate, free_parameters
from analysis.calibration.observations import Observations, View, gather
from analysis.calibration.residuals import corners
from analysis.calibration.robust import outliers
from analysis.calibration.start import board_poses
from render.base.arrays import Float
from render.base.errors import InputError

LOOSE = 100.0
"""Times its sigmas that a fit may move a calibration at no cost, to learn how noisy the new images are."""


@dataclass(frozen=True)
class KnownLaser:
    """A plane m with m . P = 1, and its covariance with the camera: (k, k), k = 4 + terms + 3."""

    plane: Float
    covariance: Float


@dataclass(frozen=True)
class KnownScanner:
    """What a calibration told; covariance (4 + terms, 4 + terms) of intrinsics and distortion, zero if not told."""

    intrinsics: Float
    distortion: Float
    covariance: Float
    lasers: tuple[KnownLaser, ...]


@dataclass(frozen=True)
class Part:
    """One thing that may have changed: how far the new views are from the calibration, and how rarely by chance."""

    laser: int | None
    """None: the camera."""
    off: float
    """px rms of the corners with the boards where they fit best, or m rms of depth of the laser's points."""
    noise: float
    """The same of a camera and laser that are free to change."""
    p: float

    @property
    def name(self) -> str:
        return "camera" if self.laser is None else f"laser {self.laser}"


@dataclass(frozen=True)
class Recheck:
    """The camera, if its errors are known, then each laser that new views show."""

    parts: tuple[Part, ...]
    left_out: tuple[str, ...]
    """Observations that go with no calibration, in words."""

    @property
    def changed(self) -> tuple[Part, ...]:
        """Those that chance alone does not explain, all of them together in one good calibration of fifty."""
        return tuple(part for part in self.parts if part.p < ALARM / len(self.parts))


def recheck(views: Sequence[View], target: Float, known: KnownScanner, circle: float = 0.0) -> Recheck:
    """views: each with eight corners or more; target (n, 2) m, all corners of the board; circle m, radius of its discs.

    InputError: no views.
    """
    if not views:
        raise InputError("no view of the board", allowed="1 to 3 new photographs of it")
    extent = np.stack([target.min(axis=0), target.max(axis=0)])
    poses = board_poses(views, known.intrinsics, known.distortion)
    alone = [replace(view, stripes=()) for view in views]
    start = Estimate(known.intrinsics, known.distortion, np.zeros(2), np.zeros((0, 3)), *poses)
    told = list[str]()
    parts = []
    if np.any(known.covariance):
        parts.append(_part(_centred(gather(alone, extent), start, circle), start, known.covariance, None, told))
    for number, laser in enumerate(known.lasers):
        shown = [
            replace(view, stripes=tuple(replace(one, laser=0) for one in view.stripes if one.laser == number))
            for view in views
        ]
        if not any(view.stripes for view in shown):
            continue
        there = replace(start, planes=laser.plane[None])
        parts.append(_part(_centred(gather(shown, extent), start, circle), there, laser.covariance, number, told))
    return Recheck(tuple(parts), tuple(dict.fromkeys(told)))


def _centred(seen: Observations, start: Estimate, circle: float) -> Observations:
    """Of discs, the images of their centres in place of their centroids."""
    if circle == 0.0:
        return seen
    return replace(seen, pixel=seen.pixel - centre_bias(start, seen.view, seen.target, circle))


def _part(seen: Observations, start: Estimate, covariance: Float, laser: int | None, told: list[str]) -> Part:
    """covariance (k, k) of the camera, then of the plane; told takes on what was left out."""
    free = free_parameters(start, warp=True)
    used = np.delete(np.arange(len(free)), [start.camera_count, start.camera_count + 1])
    certain = used[np.diag(covariance) <= 0.0]
    free[certain] = False  # a camera of another program comes without its errors, and is held
    rows = np.diag(covariance) > 0.0
    root, inverse = _roots(covariance[np.ix_(rows, rows)])
    used = used[rows]
    prior = _prior(start, used, inverse)
    loose = adjust(seen, start, free, replace(prior, information=prior.information / LOOSE**2)).estimate
    corner_bad, laser_bad, view_bad, words = outliers(seen, loose)
    told += words
    kept = without_views(without(seen, corner_bad, laser_bad), view_bad)
    start, loose = start.of_views(~view_bad), loose.of_views(~view_bad)
    fitted = adjust(kept, loose, free, replace(prior, information=prior.information / LOOSE**2))
    kept = kept.scaled(*rescaled(fitted, kept))
    solution = adjust(kept, start, free, prior)
    # boards where their corners are: the line would pull them towards a plane that it is no longer in
    boards = without(kept, np.zeros(len(kept.view), dtype=bool), np.ones(len(kept.laser), dtype=bool))
    held = adjust(boards, start, np.zeros(len(free), dtype=bool)).estimate
    off, noise = (_distance(kept, one, laser) for one in (held, fitted.estimate))
    return Part(laser, off, noise, _chance(solution, prior, used, root, inverse))


def _chance(solution: Solution, prior: Prior, used: np.ndarray, root: Float, inverse: Float) -> float:
    """p of the parameters' shift in units of the calibration's covariance, along what the new views tell of them."""
    if len(used) == 0:
        return 1.0
    views = solution.information - prior.information
    rest = np.setdiff1d(np.nonzero(solution.free)[0], used)
    told = views[np.ix_(used, used)]
    if len(rest):  # the board's own bend, of which nothing was known
        cross = views[np.ix_(used, rest)]
        told = told - cross @ np.linalg.pinv(views[np.ix_(rest, rest)], hermitian=True) @ cross.T
    shift = inverse @ (solution.estimate.shared - prior.value)[used]
    gain, axes = np.linalg.eigh(root.T @ told @ root)
    informed = gain > LEAST_TOLD
    chi2 = np.sum((axes.T @ shift)[informed] ** 2 * (1.0 + gain[informed]) / gain[informed])
    return float(stats.chi2.sf(chi2, max(np.count_nonzero(informed), 1)))


def _roots(covariance: Float) -> tuple[Float, Float]:
    """W with W W^T = covariance (k, k), and its inverse; combinations that rounding made certain are nearly so."""
    spread = np.sqrt(np.diag(covariance))
    values, vectors = np.linalg.eigh(covariance / np.outer(spread, spread))
    size = np.sqrt(np.maximum(values, 1e-14))
    return spread[:, None] * vectors * size, (vectors / size).T / spread


def _prior(start: Estimate, used: np.ndarray, inverse: Float) -> Prior:
    information = np.zeros((len(start.shared), len(start.shared)))
    information[np.ix_(used, used)] = inverse.T @ inverse
    return Prior(start.shared.copy(), information)


def _distance(seen: Observations, estimate: Estimate, laser: int | None) -> float:
    """px rms of corners, or m rms of depth of the laser's points that were not left out."""
    if laser is not None:
        away = depth_from_board(seen, estimate)[seen.laser_weight > 0.0]
        return float(np.sqrt(np.mean(away**2))) if len(away) else 0.0
    used = seen.whitening[:, 0, 0] > 0.0
    residual = corners(seen, estimate).residual.reshape(-1, 2)
    pixel = np.linalg.solve(seen.whitening[used], residual[used][:, :, None])[:, :, 0]
    return float(np.sqrt(np.mean(np.sum(pixel**2, axis=1))))
