"""How many terms the lens has: the fewest to which no lens with more is proved better on views that are held out.

A lens with more terms than it needs predicts views that it was not fitted to worse than one without, by the errors of
the needless ones; squared residuals therefore hide a term until it is far plainer than its own error. So the residuals
r of the smaller lens are held against what the larger one takes off them: the sum of r (r - s), s those of the larger,
is zero on average where its terms are needless. Its noise is that of s (r - s), summed view by view as a view's corners
may err together; what a term takes off is no noise, though it be in a few views alone. Views are few: Student's t.
Source: Clark and West, Approximately normal tests for equal predictive accuracy in nested models, 2007.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy import stats

from analysis.calibration.adjust import adjust, without_views
from analysis.calibration.checks import depth_from_board
from analysis.calibration.estimate import Estimate, free_parameters
from analysis.calibration.lens import LENGTHS
from analysis.calibration.observations import Index, Observations
from analysis.calibration.residuals import corners
from analysis.calibration.robust import STRAY
from render.base.arrays import Float
from render.base.errors import InputError

PROOF = 0.05
"""Chance at which a lens without needless terms is passed over, all larger ones together."""
LINE_POINTS = 100
"""A view, of all lasers, by which lenses are compared."""


@dataclass(frozen=True)
class LensTrial:
    """A lens model by views that it was not fitted to, whose boards' poses are found by their corners alone."""

    terms: int
    held_out: float
    """Mean squared residual of corners, in given sigmas."""
    depth: float
    """m, how far a typical view's depth by the lasers is from its board; 0 without lasers."""
    p: float
    """That noise alone makes one of the lenses with more terms seem so much better than this one."""


def choose_lens(seen: Observations, start: Estimate, *, folds: int = 3) -> tuple[int, list[LensTrial]]:
    """The fewest terms to which no lens with more is proved better by its held-out corners.

    The camera is fitted to the corners of the other views and held, then the laser planes to their lines. Depth is told
    and proves nothing: it has a line's noise where a view's corners have that of a hundred.
    """
    thin = _thinned(seen)
    residuals, depths = dict[int, Float](), list[Float]()
    for terms in LENGTHS:
        padded = np.zeros(terms)
        padded[: min(terms, len(start.distortion))] = start.distortion[:terms]
        try:
            residuals[terms], depth = _held_out(thin, replace(start, distortion=padded), folds)
        except (InputError, np.linalg.LinAlgError):
            continue
        depths.append(depth)
    if not residuals:
        return len(start.distortion), []
    both = [depth[np.isfinite(depths).all(axis=0)] for depth in depths]
    trials = []
    for (terms, residual), away in zip(residuals.items(), both, strict=True):
        more = [_by_noise(seen, residual, other) for larger, other in residuals.items() if larger > terms]
        typical = float(np.sqrt(np.median(away))) if len(away) else 0.0
        trials.append(
            LensTrial(terms, float(np.mean(residual**2)), typical, min([1.0, *(len(more) * p for p in more)]))
        )
    # to the one with the most terms there is none with more
    return next(trial.terms for trial in trials if trial.p >= PROOF), trials


def _by_noise(seen: Observations, smaller: Float, larger: Float) -> float:
    """p that needless terms seem to take so much off held-out residuals, (n, 2) each in sigmas."""
    off = smaller - larger
    noise = np.bincount(seen.view, weights=np.sum(larger * off, axis=1), minlength=seen.count)
    spread = float(noise.std(ddof=1)) * np.sqrt(seen.count)
    return float(stats.t.sf(np.sum(smaller * off) / spread, seen.count - 1)) if spread > 0.0 else 1.0


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
    """Of each view when it is left out: (n, 2) residuals of its corners, and (views,) typical m^2 of depth, or NaN."""
    out, depth = np.empty((len(seen.view), 2)), np.full(seen.count, np.nan)
    alone = replace(_with_lines(seen, np.empty(0, dtype=np.intp)), lasers=0)
    for fold in range(folds):
        test = np.arange(seen.count) % folds == fold
        camera = replace(start.of_views(~test), planes=np.zeros((0, 3)))
        fitted = adjust(without_views(alone, test), camera, free_parameters(camera, warp=False)).estimate
        there = without_views(alone, ~test)
        held = fitted.with_poses(start.rotation[test], start.translation[test])
        posed = adjust(there, held, np.zeros(len(held.shared), dtype=bool)).estimate
        out[test[seen.view]] = corners(there, posed).residual.reshape(-1, 2)
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
