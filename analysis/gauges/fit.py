"""Curves through a part of a profile by generalised least squares, with the derivative of their parameters.

A point moves along its own direction d when the line in the image does, so that it misses the curve F(P, theta) = 0 by
e = F / (dF/dP . d) of its sigmas; e^T C^-1 e is least, C the correlation of the points (Aitken, Proc. R. Soc.
Edinburgh 55, 1935). Points that miss by more than 5 sigma are left out.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.gauges.profile import Profile
from analysis.gauges.spikes import spikes
from analysis.measures import MAD_TO_SIGMA, robust_sigma
from render.base.arrays import Float

Curve = Callable[[Float, Float], tuple[Float, Float, Float]]
"""(m, 2) points and (p,) parameters -> F (m,), dF/dP (m, 2), dF/dtheta (m, p)."""
ITERATIONS = 30
ROUNDS = 4
OUTLIER_SIGMAS = 5.0
DRAWN_SIGMAS = 3.0
"""A usual miss from which far points may have drawn the curve to them: they have if most lie so much nearer another."""
DRAWN, DRAWN_SEED = 50, 11
"""Curves that are drawn by chance then: with a third of the points false, 15 of them have no false one in three."""
DRAWN_STEPS = 2
"""Of Gauss and Newton through as many points as parameters: lines are there after the first, circles begin there."""
ALONE = 3.0
"""Times the steps on either side, of a step that stands alone."""
GRAZING = 1e-3
"""Sine of the angle between curve and d below which a point slides along the curve and tells nothing of it."""
FOOT_STEPS = 3
"""Of Newton's method, for the foot of a point's ray: of a line the second is exact."""
BEYOND_CHANCE = 3.0
"""Sigmas by which the sum of squares exceeds its mean before it tells of more than the predicted noise."""


@dataclass(frozen=True)
class Frame:
    """Axes along and across a part of the profile, about its middle."""

    centre: Float
    axes: Float
    """(2, 2): rows are the directions along, and across towards the laser."""

    def local(self, position: Float) -> Float:
        return np.asarray((position - self.centre) @ self.axes.T)

    def out(self, local: Float) -> Float:
        return np.asarray(local @ self.axes + self.centre)


@dataclass(frozen=True)
class Fit:
    """A curve through points of a profile."""

    theta: Float
    """(p,) parameters, lengths in m, in the frame."""
    sigma: Float
    """(p,) their random sigma."""
    gradient: Float
    """(p, m, 2) their derivative by the position of each point of the profile; 0 where a point is not used."""
    here: NDArray[np.bool_]
    """(m,) the points that are used."""
    frame: Frame
    ratio: float
    """Of the residuals to what the sigmas predict, at least 1, and 1 as long as chance explains them (R. T. Birge,
    Phys. Rev. 40, 1932)."""


def frame_of(position: Float) -> Frame:
    """Axes by the greatest spread of (m, 2) points, but for those far above or below most; along goes right, or up."""
    height = position[:, 1] - np.median(position[:, 1])
    most = position[np.abs(height) <= OUTLIER_SIGMAS * robust_sigma(height)]
    position = most if np.ptp(most[:, 0]) > 0.5 * np.ptp(position[:, 0]) else position
    centre = position.mean(axis=0)
    along = np.linalg.svd(position - centre, full_matrices=False)[2][0]
    along = along if (along[0], along[1]) > (0.0, 0.0) else -along
    return Frame(centre, np.array([along, [-along[1], along[0]]]))


def polynomial(degree: int) -> Curve:
    """Across as a polynomial of along: theta are its coefficients, the constant first."""
    powers = np.arange(degree + 1)

    def curve(local: Float, theta: Float) -> tuple[Float, Float, Float]:
        along, across = local.T
        by_theta = -(along[:, None] ** powers)
        slope = (theta[1:] * powers[1:] * along[:, None] ** (powers[1:] - 1)).sum(axis=1)
        return across + by_theta @ theta, np.stack([-slope, np.ones(len(along))], axis=1), by_theta

    return curve


def two_levels(upper: NDArray[np.bool_]) -> Curve:
    """Two parallel lines, the points where `upper` (m,) on the second: constant, slope, and step (ISO 5436-1)."""

    def curve(local: Float, theta: Float) -> tuple[Float, Float, Float]:
        along, across = local.T
        by_theta = -np.stack([np.ones(len(along)), along, upper], axis=1)
        by_point = np.stack([np.full(len(along), -theta[1]), np.ones(len(along))], axis=1)
        return across + by_theta @ theta, by_point, by_theta

    return curve


def circle(local: Float, theta: Float) -> tuple[Float, Float, Float]:
    """Centre along and across, and radius."""
    beside = local - theta[:2]
    distance = np.maximum(np.linalg.norm(beside, axis=1), 1e-12)
    outwards = beside / distance[:, None]
    return distance - theta[2], outwards, np.column_stack([-outwards, -np.ones(len(local))])


def circle_start(local: Float) -> Float:
    """By linear least squares of x^2 + y^2 (Kasa, IEEE Trans. Instrum. Meas. 25, 1976)."""
    scale = float(np.abs(local).max()) or 1.0
    unit = local / scale
    found = np.linalg.lstsq(np.column_stack([2.0 * unit, np.ones(len(unit))]), (unit**2).sum(axis=1), rcond=None)[0]
    return np.asarray(scale * np.append(found[:2], math.sqrt(max(found[2] + found[:2] @ found[:2], 1e-12))))


def fit(
    profile: Profile,
    weight: Float,
    curve_of: Callable[[NDArray[np.bool_]], Curve],
    start: Callable[[Float], Float],
    axes: Float | None = None,
) -> Fit:
    """Curve through the points of a profile that have a weight (m,), of their squared misses.

    curve_of: its curve, from the (m,) points used; start: (n, 2) local points -> (p,) first parameters; axes: of the
    frame, in place of those of the points.
    """
    here = weight > 0.0
    # a false point far off draws a curve so near that it is no outlier of it
    places, sigma = profile.position[here], np.linalg.norm(profile.random[here], axis=1)
    here[np.flatnonzero(here)[spikes(places, sigma)]] = False
    frame = frame_of(profile.position[here])
    frame = frame if axes is None else Frame(frame.centre, axes)
    for round_left in reversed(range(ROUNDS)):
        part = profile.taken(here)
        local, direction = frame.local(part.position), part.random @ frame.axes.T
        curve, whitening = curve_of(here), _weighted(part.whitening(), weight[here])
        theta = _solved(curve, local, direction, whitening, start(local), ITERATIONS)
        e, by_theta, by_point = _misses(curve, local, direction, theta)
        white, usual = _white(whitening, e), max(1.0, robust_sigma(e))
        wrong = np.abs(e) > OUTLIER_SIGMAS * usual
        if round_left == ROUNDS - 1 and usual > DRAWN_SIGMAS:
            found, of_most = _of_most_points(curve_of, start, here, local, direction, len(theta))
            # not where a side of a step would be left without points
            whole = np.linalg.matrix_rank(by_theta[~found]) == len(theta)
            wrong = found if of_most < usual / DRAWN_SIGMAS and whole else wrong
        if round_left == 0 or not wrong.any() or len(e) - np.count_nonzero(wrong) <= len(theta):
            break
        here = here.copy()
        here[np.flatnonzero(here)[wrong]] = False
    solved = np.asarray(np.linalg.pinv(_white(whitening, by_theta)), dtype=np.float64)
    gradient = np.zeros((len(theta), len(profile.index), 2))
    gradient[:, here] = -(_gain(whitening, solved)[:, :, None] * by_point) @ frame.axes
    ratio = birge(white, float(weight[here].sum()) - len(theta))
    return Fit(theta, np.linalg.norm(solved, axis=1), gradient, here, frame, ratio)


def _solved(
    curve: Curve, local: Float, direction: Float, whitening: tuple[Float, Float], theta: Float, most: int
) -> Float:
    """Parameters of the least weighted misses, by at most so many steps of Gauss and Newton from some first ones."""
    for _ in range(most):
        e, by_theta, _ = _misses(curve, local, direction, theta)
        change = np.linalg.lstsq(_white(whitening, by_theta), -_white(whitening, e), rcond=None)[0]
        theta = theta + change
        if np.all(np.abs(change) <= 1e-9 * np.abs(theta) + 1e-12):
            break
    return theta


def _of_most_points(
    curve_of: Callable[[NDArray[np.bool_]], Curve],
    start: Callable[[Float], Float],
    here: NDArray[np.bool_],
    local: Float,
    direction: Float,
    parameters: int,
) -> tuple[NDArray[np.bool_], float]:
    """(n,) the points off a curve that most of them are near, and how near these are, in sigmas.

    Of curves through as few points as it takes, drawn by chance, the one of the least median miss (Rousseeuw, J. Am.
    Stat. Assoc. 79, 1984): no far points draw it to them, as long as they are fewer than half.
    """
    random, curve, used = np.random.default_rng(DRAWN_SEED), curve_of(here), np.flatnonzero(here)
    nearest, least = start(local), math.inf
    with np.errstate(all="ignore"):  # points that are no curve's
        for _ in range(DRAWN):
            some = np.sort(random.choice(len(local), parameters, replace=False))
            of_some = np.zeros_like(here)
            of_some[used[some]] = True
            theta = _through(curve_of(of_some), local[some], start(local[some]))
            value, by_point, _ = curve(local, theta)
            # to first order: which curve is nearest is not a matter of where the feet of its points are
            middle = float(np.median(np.abs(value / _along(by_point, direction))))
            if middle < least:
                nearest, least = theta, middle
        e = _misses(curve, local, direction, nearest)[0]
    usual = max(1.0, MAD_TO_SIGMA * float(np.median(np.abs(e))))
    return _off_at_a_leap(e, OUTLIER_SIGMAS * usual), usual


def _through(curve: Curve, points: Float, theta: Float) -> Float:
    """Parameters of the curve through as many points as it has of them; a line and two levels take the first step."""
    for _ in range(DRAWN_STEPS):
        value, _, by_theta = curve(points, theta)
        theta = theta - np.linalg.lstsq(by_theta, value, rcond=None)[0]
    return theta


def _along(by_point: Float, direction: Float) -> Float:
    """(n,) change of F where a point moves along its own direction, away from 0 where it slides along the curve."""
    step = np.einsum("ij,ij->i", by_point, direction)
    least = GRAZING * np.linalg.norm(by_point, axis=1) * np.linalg.norm(direction, axis=1)
    return np.where(np.abs(step) < least, np.copysign(least, step), step)


def _off_at_a_leap(e: Float, limit: float) -> NDArray[np.bool_]:
    """(n,) the misses beyond a limit, in runs that end at a leap of as much from one point to the next.

    False points stand apart from the line. Where a line leaves the curve bit by bit it has another shape, such as a
    cylinder that is cut aslant, and what is asked for is the curve through all of it.
    """
    off = np.abs(e) > limit
    step = np.abs(np.diff(e))
    before, after = np.append(0.0, step[:-1]), np.append(step[1:], 0.0)
    edge = off[1:] != off[:-1]
    # steps of a bent line grow bit by bit, those among false points are anything, and behind a soft edge all are off
    beside = np.where(edge, np.where(off[1:], before, after), np.maximum(before, after))
    leap = (step > limit) & (step > ALONE * beside)
    run = np.append(0, np.cumsum(edge | leap))
    parted = np.zeros(run[-1] + 1, dtype=np.bool_)
    parted[run[1:][leap]] = parted[run[:-1][leap]] = True
    return np.asarray(off & parted[run])


def birge(white: Float, free: float) -> float:
    """As of `Fit.ratio`; white: (n,) whitened residuals, of which as many are free."""
    chi2 = float(white @ white)
    excess = chi2 > free + BEYOND_CHANCE * math.sqrt(2.0 * max(free, 0.0))
    return math.sqrt(chi2 / free) if excess and free > 0.0 else 1.0


def _misses(curve: Curve, local: Float, direction: Float, theta: Float) -> tuple[Float, Float, Float]:
    """Of (n,) points, in sigmas: e, and its derivatives by theta (n, p) and by the local position (n, 2).

    A point's true place is the foot of its own ray on the curve, P - e d. Derivatives are taken there: where the point
    was seen they hold its noise, and correlate with e, which made flanks steeper by up to 0.4 sigma.
    """
    e = np.zeros(len(local))
    for _ in range(FOOT_STEPS):
        value, by_point, by_theta = curve(local - e[:, None] * direction, theta)
        step = _along(by_point, direction)
        e = e + value / step
        # the foot of a wild point, which is left out soon, may be anywhere
        reach = OUTLIER_SIGMAS * max(1.0, robust_sigma(e))
        miss, e = e, np.clip(e, -reach, reach)
    return miss, by_theta / step[:, None], by_point / step[:, None]


def _weighted(whitening: tuple[Float, Float], weight: Float) -> tuple[Float, Float]:
    """W for misses that each are times the root of their weight (n,)."""
    diagonal, below = whitening
    root = np.sqrt(weight)
    return diagonal * root, below * np.append(0.0, root[:-1])


def _white(whitening: tuple[Float, Float], values: Float) -> Float:
    """W applied to (n,) or (n, p)."""
    diagonal, below = (one.reshape(-1, *[1] * (values.ndim - 1)) for one in whitening)
    found = diagonal * values
    found[1:] += below[1:] * values[:-1]
    return np.asarray(found)


def _gain(whitening: tuple[Float, Float], solved: Float) -> Float:
    """(p, n): how the parameters answer to e, from the (p, n) solution of the whitened problem."""
    diagonal, below = whitening
    gain = solved * diagonal
    gain[:, :-1] += solved[:, 1:] * below[1:]
    return np.asarray(gain)
