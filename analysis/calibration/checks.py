"""Whether a calibration may be believed: its halves against each other, its residuals, its lens against others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import stats
from scipy.spatial import cKDTree

from analysis.calibration.adjust import Prior, Solution, adjust, leverage, without_views
from analysis.calibration.depth import Volume, depth_jacobian
from analysis.calibration.estimate import Estimate, free_parameters
from analysis.calibration.lens import LENGTHS, normalise
from analysis.calibration.observations import Index, Observations
from analysis.calibration.residuals import corners
from analysis.calibration.robust import STRAY, Adjusted
from render.base.arrays import Float
from render.base.errors import InputError

ALARM = 0.02
"""p-value at which a check speaks: the two of a good calibration do so together less than once in twenty times."""
LINE_POINTS = 100
"""A view, of all lasers, by which lenses are compared."""
LEAST_TOLD = 1e-6
"""Share of a variance below which rounding decides what the views tell beside a prior."""


@dataclass(frozen=True)
class Halves:
    """Two halves of the views solved apart: how much depth differs (rms, m), what was to be expected, and p."""

    difference: float
    expected: float
    p: float

    @property
    def sentence(self) -> str:
        if self.expected == 0.0:  # no laser, by which alone there is depth
            return f"two halves of the views {'agree' if self.p >= ALARM else 'differ'} (p = {self.p:.2g})"
        if self.p >= ALARM:
            return (
                f"two halves of the views agree: in depth they are {1e6 * self.difference:.0f} um apart, where their "
                f"noise explains {1e6 * self.expected:.0f} um; by chance all their parameters together differ at least "
                f"as much in {self.p:.0%} of such calibrations"
            )
        return (
            "two halves of the views differ in their parameters, all together, by more than noise explains but in "
            f"{100.0 * self.p:.1g} % of such calibrations; in depth they are {1e6 * self.difference:.0f} um apart, "
            f"where noise explains {1e6 * self.expected:.0f} um: unless it is that chance, something that is not "
            "modelled, such as a lens with more terms, a bent board, or focus that moved, is in the views"
        )


def halves(adjusted: Adjusted, volumes: Sequence[Volume], prior: Prior | None = None) -> Halves | None:
    """Every other view against the rest; None where a half does not determine the parameters.

    Both halves hold to the same prior, so that its error is not in their difference: with information I of the views
    and L of the prior each has the covariance C I C, C = (I + L)^-1. Combinations that the prior alone determines are
    left out. Without a laser, differences in depth are zero.
    """
    solution, seen = adjusted.solution, adjusted.seen
    parts = []
    for parity in (0, 1):
        bad = np.arange(seen.count) % 2 != parity
        try:
            parts.append(adjust(without_views(seen, bad), solution.estimate.of_views(~bad), solution.free, prior))
        except (InputError, np.linalg.LinAlgError):
            return None
    used = np.nonzero(solution.free)[0]
    off = (parts[0].estimate.shared - parts[1].estimate.shared)[used]
    covariance = (_by_views(parts[0], prior) + _by_views(parts[1], prior))[np.ix_(used, used)]
    spread = np.sqrt(np.maximum(np.diag(covariance), np.finfo(float).tiny))
    values, vectors = np.linalg.eigh(covariance / np.outer(spread, spread))
    told = values > (LEAST_TOLD if prior is not None else 0.0)
    chi2 = float(np.sum((vectors.T @ (off / spread))[told] ** 2 / values[told]))
    squared, variance, count = 0.0, 0.0, 0
    for volume in volumes:
        q = normalise(volume.pixel, solution.estimate.intrinsics, solution.estimate.distortion)
        jacobian = depth_jacobian(solution.estimate, volume, q)[:, used]
        squared += float(np.sum((jacobian @ off) ** 2))
        variance += float(np.einsum("ni,ij,nj->", jacobian, covariance, jacobian))
        count += len(q)
    count = max(count, 1)
    return Halves(
        np.sqrt(squared / count), np.sqrt(variance / count), float(stats.chi2.sf(chi2, np.count_nonzero(told)))
    )


def _by_views(part: Solution, prior: Prior | None) -> Float:
    """(p, p) covariance that the views' errors give the estimate, without the prior's own."""
    if prior is None:
        return part.covariance
    return part.covariance - part.covariance @ prior.information @ part.covariance


@dataclass(frozen=True)
class Whiteness:
    """Correlation of neighbouring corners' residuals; they share no noise, so that it should be none."""

    correlation: float
    p: float

    @property
    def sentence(self) -> str:
        if self.p >= ALARM:
            return f"residuals are white: neighbouring corners correlate by {self.correlation:.2f} (p = {self.p:.2f})"
        return (
            f"residuals of neighbouring corners go together ({self.correlation:.2f}, p = {self.p:.1g}): the lens or "
            "the board is not as modelled; try more distortion terms, and see that the board is flat"
        )


def whiteness(adjusted: Adjusted) -> Whiteness:
    """Of corners one square apart on the board, in the same view."""
    seen, solution = adjusted.seen, adjusted.solution
    used = np.nonzero(seen.whitening[:, 0, 0] > 0.0)[0]
    # views far apart, so that only corners of the same one are neighbours
    place = np.column_stack([seen.target[used], 10.0 * seen.half.max() * seen.view[used]])
    tree = cKDTree(place)
    square = float(np.median(tree.query(place, k=2)[0][:, 1]))
    pairs = used[tree.query_pairs(1.2 * square, output_type="ndarray")]
    first, second = pairs[:, 0], pairs[:, 1]
    residual = solution.corner_residual
    products = np.sum(residual[first] * residual[second], axis=1)
    variance = float(np.mean(residual[used] ** 2))
    # what is fitted to residuals makes neighbours go apart, by as much as the fit has them in common
    correlation = float(np.mean(products + variance * leverage(seen, solution, first, second)) / (2.0 * variance))
    error = np.sqrt(1.0 / (2.0 * len(products)))
    return Whiteness(correlation, float(stats.norm.sf(correlation / error)))


@dataclass(frozen=True)
class LensTrial:
    """A lens model by views that it was not fitted to, whose boards' poses are found by their corners alone."""

    terms: int
    held_out: float
    """Mean squared residual of corners, in given sigmas."""
    depth: float
    """m, how far a typical view's depth by the lasers is from its board; 0 without lasers."""
    worse_by: float
    """Than the best one, in standard errors of the difference: that of corners or of depth, whichever is more."""


def choose_lens(seen: Observations, start: Estimate, *, folds: int = 3) -> tuple[int, list[LensTrial]]:
    """The fewest terms that are not clearly worse than the best, neither at held-out corners nor in depth there.

    The camera is fitted to the corners of the other views and held, then the laser planes to their lines.
    """
    thin = _thinned(seen)
    errors = {}
    for terms in LENGTHS:
        padded = np.zeros(terms)
        padded[: min(terms, len(start.distortion))] = start.distortion[:terms]
        try:
            errors[terms] = _held_out(thin, replace(start, distortion=padded), folds)
        except (InputError, np.linalg.LinAlgError):
            continue
    if not errors:
        return len(start.distortion), []
    corner, depth = (np.stack([error[kind] for error in errors.values()]) for kind in (0, 1))
    depth = depth[:, np.isfinite(depth).all(axis=0)]
    worse = np.maximum(_worse_by(corner), _worse_by(depth))
    trials = [
        LensTrial(terms, float(at.mean()), float(np.sqrt(np.median(away))) if len(away) else 0.0, float(more))
        for terms, at, away, more in zip(errors, corner, depth, worse, strict=True)
    ]
    # each may be the best in one way and not in the other
    least = max(1.0, min(trial.worse_by for trial in trials))
    return next(trial.terms for trial in trials if trial.worse_by <= least), trials


def _worse_by(error: Float) -> Float:
    """(models,) of error (models, views): than the least, in standard errors of the difference."""
    models, views = error.shape
    if views < 2:
        return np.zeros(models)
    off = error - error[np.argmin(error.mean(axis=1))]
    spread = off.std(axis=1, ddof=1) / np.sqrt(views)
    return np.asarray(off.mean(axis=1) / np.where(spread > 0.0, spread, np.inf))


def _thinned(seen: Observations) -> Observations:
    """Some points of each line stand for all."""
    return _with_lines(seen, np.arange(len(seen.laser))[:: max(1, len(seen.laser) // (LINE_POINTS * seen.count))])


def _with_lines(seen: Observations, number: Index) -> Observations:
    """With these laser points alone."""
    return replace(
        seen,
        laser_view=seen.laser_view[number],
        laser=seen.laser[number],
        laser_pixel=seen.laser_pixel[number],
        laser_weight=seen.laser_weight[number],
        along=seen.along[number],
    )


def _held_out(seen: Observations, start: Estimate, folds: int) -> tuple[Float, Float]:
    """(views,) of each when it is left out: mean squared residual of its corners, and typical m^2 of depth, or NaN."""
    out, depth = np.empty(seen.count), np.full(seen.count, np.nan)
    alone = replace(_with_lines(seen, np.empty(0, dtype=np.intp)), lasers=0)
    for fold in range(folds):
        test = np.arange(seen.count) % folds == fold
        camera = replace(start.of_views(~test), planes=np.zeros((0, 3)))
        fitted = adjust(without_views(alone, test), camera, free_parameters(camera, warp=False)).estimate
        there = without_views(alone, ~test)
        held = fitted.with_poses(start.rotation[test], start.translation[test])
        posed = adjust(there, held, np.zeros(len(held.shared), dtype=bool)).estimate
        squared = corners(there, posed).residual.reshape(-1, 2) ** 2
        out[test] = [squared[there.view == i].mean() for i in range(there.count)]
        planes = replace(fitted, planes=start.planes)
        try:
            only = free_parameters(planes, warp=False, camera=False)
            planes = adjust(_near(without_views(seen, test), planes), planes, only).estimate
        except InputError:
            continue  # too few of the other views have lines
        lines = without_views(seen, ~test)
        away = depth_from_board(lines, replace(posed, planes=planes.planes)) ** 2
        # a wrong line is as far off for every lens: the median keeps it from counting for more than others
        for i in np.unique(lines.laser_view):
            depth[np.nonzero(test)[0][i]] = np.median(away[lines.laser_view == i])
    return out, depth


def _near(seen: Observations, estimate: Estimate) -> Observations:
    """Without points of lines that are far from the planes, which were found by most of them."""
    off = np.abs(depth_from_board(seen, estimate))
    typical = float(np.median(off)) / 0.6745 if len(off) else 0.0  # of a normal distribution
    return _with_lines(seen, np.nonzero(off <= STRAY * typical)[0])


def depth_from_board(seen: Observations, estimate: Estimate) -> Float:
    """(m,) m, depth of the laser points by their plane less that of the flat board."""
    q = normalise(seen.laser_pixel, estimate.intrinsics, estimate.distortion)
    ray = np.column_stack([q, np.ones(len(q))])
    normal, shift = estimate.rotation[seen.laser_view, :, 2], estimate.translation[seen.laser_view]
    board = np.sum(normal * shift, axis=1) / np.sum(normal * ray, axis=1)
    return np.asarray(1.0 / np.sum(estimate.planes[seen.laser] * ray, axis=1) - board)
