"""Observations that do not go with the others: wrong stripes, bad views, single corners; each is left out and named."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy import stats

from analysis.calibration.adjust import (
    Prior,
    Solution,
    adjust,
    bending,
    rescaled,
    weakest_mixture,
    without,
    without_views,
)
from analysis.calibration.estimate import Estimate
from analysis.calibration.observations import Observations
from analysis.calibration.residuals import corners, laser_points
from render.base.arrays import Bool, Float
from render.base.errors import InputError

ROUNDS = 8
STRAY = 5.0
"""Standard deviations, by what is typical of all, at which a single corner or laser point is left out."""
BAD = 4.0
"""Times the typical residual at which a view's corners, or a stripe, are bad as a whole."""
CHANCE = 1e-6
"""That noise alone takes so much of a stripe so far off: the median of one point or two says little."""
MOST_BENT = 2.0
"""Rise of chi-square one sigma away, 1 where errors are linear: sets whose sigmas hold have 1.0 to 1.6."""

MOST_BENT_AT_TWO = 4.0
"""The same two sigma away, along the three directions known least, over 4: such sets have 1.0 to 2.4."""


@dataclass(frozen=True)
class Adjusted:
    """The last adjustment, of what goes together, and what was left out of it."""

    solution: Solution
    seen: Observations
    """Sigmas as the residuals have them, weights of what was left out zero."""
    corner_scale: float
    laser_scale: float
    """Standard deviations by the residuals over those given."""
    left_out: tuple[str, ...]


def adjust_robustly(seen: Observations, start: Estimate, free: Bool, prior: Prior | None = None) -> Adjusted:
    """Adjust with Cauchy's weights, leave out what is far off by them, then adjust what remains by least squares.

    InputError: as `adjust`, or the steps do not come to an end.
    """
    estimate = start
    for _ in range(ROUNDS):
        weighted = _weighted(seen, estimate, free, prior)
        before, estimate = estimate, weighted
        if np.abs(estimate.shared - before.shared).max() < 1e-6 * np.abs(before.shared).max():
            break
    corner_bad, laser_bad, view_bad, told = outliers(seen, estimate)
    kept = without_views(without(seen, corner_bad, laser_bad), view_bad)
    estimate = estimate.of_views(~view_bad)
    solution = adjust(kept, estimate, free, prior)
    corner_scale, laser_scale = rescaled(solution, kept)
    scaled = kept.scaled(corner_scale, laser_scale)
    if max(corner_scale, laser_scale) > 1.0:
        solution = adjust(scaled, solution.estimate, free, prior)
    if not solution.converged:
        raise InputError(
            "the adjustment does not settle: its numbers would be those of a chance moment",
            where="calibration",
            found=f"least is known of a mixture of {weakest_mixture(solution.information, free, estimate.names)}",
            cure="ask for fewer distortion terms, or photograph the board at other tilts and distances",
        )
    rise, farther = bending(scaled, solution, prior), bending(scaled, solution, prior, far=2.0, directions=3)
    if rise > MOST_BENT or farther > MOST_BENT_AT_TWO:
        raise InputError(
            "the parameters' errors are larger than any covariance of them holds for",
            where="calibration",
            found=f"chi-square rises by {rise:.3g} and {4.0 * farther:.3g} one and two sigma away, not 1 and 4, by a "
            f"mixture of {weakest_mixture(solution.information, free, estimate.names)}",
            cure="ask for fewer distortion terms, or photograph the board at other tilts and distances",
        )
    return Adjusted(solution, scaled, corner_scale, laser_scale, told)


def _residuals(seen: Observations, estimate: Estimate) -> tuple[Float, Float]:
    """(n,) length of each corner's residual and (m,) size of each laser point's, in typical ones."""
    corner = np.linalg.norm(corners(seen, estimate).residual.reshape(-1, 2), axis=1)
    laser = np.abs(laser_points(seen, estimate)[0].residual)
    # medians of |r| for unit sigma: 1.1774 in two dimensions (Rayleigh), 0.6745 in one
    scale_corner = max(float(np.median(corner)) / 1.1774, 1e-9)
    scale_laser = max(float(np.median(laser)) / 0.6745, 1e-9) if len(laser) else 1.0
    return corner / max(scale_corner, 1.0), laser / max(scale_laser, 1.0)


def _weighted(seen: Observations, estimate: Estimate, free: Bool, prior: Prior | None) -> Estimate:
    corner, laser = _residuals(seen, estimate)
    by_corner = 1.0 / np.sqrt(1.0 + (corner / 2.4) ** 2)
    by_laser = 1.0 / np.sqrt(1.0 + (laser / 2.4) ** 2)
    weighted = replace(
        seen,
        whitening=seen.whitening * by_corner[:, None, None],
        laser_weight=seen.laser_weight * by_laser,
    )
    return adjust(weighted, estimate, free, prior, steps=10).estimate


def outliers(seen: Observations, estimate: Estimate) -> tuple[Bool, Bool, Bool, tuple[str, ...]]:
    """Which corners (n,), laser points (m,) and views are left out, and why, in words."""
    corner, laser = _residuals(seen, estimate)
    corner_bad, laser_bad, view_bad = corner > STRAY, laser > STRAY, np.zeros(seen.count, dtype=bool)
    told = []
    for number, name in enumerate(seen.names):
        own = seen.view == number
        typical = float(np.median(corner[own])) / 1.1774
        if typical > BAD:
            view_bad[number] = True
            told.append(f"{name}: its corners are {typical:.0f} times as far off as is typical; the view is left out")
            continue
        if np.count_nonzero(corner_bad & own):
            told.append(f"{name}: {np.count_nonzero(corner_bad & own)} stray corners left out")
        for one in range(seen.lasers):
            line = (seen.laser_view == number) & (seen.laser == one)
            if not line.any():
                continue
            middle = float(np.median(laser[line]))
            away = middle / 0.6745
            if away > BAD and _chance(middle, int(np.count_nonzero(line))) < CHANCE:
                laser_bad |= line
                told.append(
                    f"{name}: the line of laser {one} is {away:.0f} times as far off as is typical, as a reflection "
                    "is, or the line of a mirrored photograph; left out"
                )
            elif np.count_nonzero(laser_bad & line):
                told.append(f"{name}: {np.count_nonzero(laser_bad & line)} stray points of laser {one} left out")
    return corner_bad, laser_bad, view_bad, tuple(told)


def _chance(off: float, count: int) -> float:
    """That of so many normal residuals half or more are beyond a number of standard deviations."""
    return float(stats.binom.sf((count + 1) // 2 - 1, count, 2.0 * stats.norm.sf(off)))
