"""Whether a calibration may be believed: its halves against each other, and its residuals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats
from scipy.spatial import cKDTree

from analysis.calibration.adjust import Prior, Solution, adjust, leverage, without_views
from analysis.calibration.depth import Volume, depth_jacobian
from analysis.calibration.estimate import Estimate
from analysis.calibration.lens import normalise
from analysis.calibration.observations import Observations
from analysis.calibration.robust import Adjusted
from render.base.arrays import Float
from render.base.errors import InputError

ALARM = 0.02
"""p-value at which a check speaks: the two of a good calibration do so together less than once in twenty times."""
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


def depth_from_board(seen: Observations, estimate: Estimate) -> Float:
    """(m,) m, depth of the laser points by their plane less that of the flat board."""
    q = normalise(seen.laser_pixel, estimate.intrinsics, estimate.distortion)
    ray = np.column_stack([q, np.ones(len(q))])
    normal, shift = estimate.rotation[seen.laser_view, :, 2], estimate.translation[seen.laser_view]
    board = np.sum(normal * shift, axis=1) / np.sum(normal * ray, axis=1)
    return np.asarray(1.0 / np.sum(estimate.planes[seen.laser] * ray, axis=1) - board)
