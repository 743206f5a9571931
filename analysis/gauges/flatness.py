"""Flatness of a surface that many profiles cross: the form of second degree that they show, from peak to valley.

Each profile's region comes to a few cells, means of neighbouring points, so that a scan of any length is held in little
memory; the form is fitted to all cells by generalised least squares, and read over their places after its least-squares
plane is taken away (the reference plane of ISO 12781-1).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.gauges.fit import OUTLIER_SIGMAS, ROUNDS, birge
from analysis.gauges.one_surface import on_one_surface, together
from analysis.gauges.profile import ANY_SIGMA, Profile
from analysis.gauges.spikes import spikes
from analysis.measures import robust_sigma
from render.base.arrays import Float

CELLS = 24
"""Of a region, in one profile, at most."""
FEWEST_POINTS, USUAL_POINTS = 3, 5
"""Of a cell: of fewer a mean says no more than a point; and as many as there are on average at least."""
UNSURE = 10.0
"""Times the region's median sigma, beyond which a point only spoils its cell, and a cell the surface."""
LEAST_SHARE = 0.6
"""Of the cells of all steps, on one surface: of fewer nobody can say which one is asked for."""
PARAMETERS = 6
FEWEST_CELLS, FEWEST_PROFILES = 12, 3
FLATTEST = 0.02
"""Least width of the cells' places over their length: on narrower ground a second degree across it is not told."""
TOO_FEW = "too few points in the region of all steps: {}; a scan has more"
SEVERAL = (
    "its region holds more than one surface: {:.0f} % of its cells lie on the largest; move its ends, or scan no "
    "farther than the part"
)
JITTER = 1e-9
"""Of a cell's variance, so that cells of exact points have a factor as well."""


@dataclass(frozen=True)
class Cells:
    """The region of one profile as c means of neighbouring points; lengths in m, all in one frame of the part.

    A mean errs by `factor` @ (c,) independent numbers of variance 1, along its `direction`, and by `systematic` times k
    numbers that all profiles share.
    """

    position: Float
    """(c, 3)."""
    direction: Float
    """(c, 3) of length 1: where noise moves the mean."""
    factor: Float
    """(c, c) lower triangle."""
    systematic: Float
    """(c, 3, k)."""
    count: NDArray[np.intp]
    """(c,) points in each."""

    @property
    def points(self) -> int:
        """In all cells."""
        return int(self.count.sum())


@dataclass(frozen=True)
class Form:
    """What was found of a surface; m."""

    value: float
    sigma_random: float
    sigma_systematic: float
    points: int
    """Used."""
    left_out: int
    """Points of all other cells."""
    farthest: float
    """m off the surface, of cells that are of another one, or of none; 0: there are none."""
    theta: Float
    """(6,) coefficients of `_powers` in the frame."""
    centre: Float
    axes: Float
    """(3, 3): rows along, across and off the surface."""
    scale: Float
    """(2,) half extents along and across."""
    places: Float
    """(n, 2) of the cells in units of the scale, over which the form is read."""


def cells(profile: Profile, region: tuple[float, float], T_part_laser: Float) -> Cells:
    """The region of a profile in the part's frame; no cells where the region has too few points."""
    low, high = region
    inside = np.flatnonzero(profile.weight(low, high) > 0.0)
    sigma = np.linalg.norm(profile.random[inside], axis=1)
    here = inside[sigma <= UNSURE * (float(np.median(sigma)) if len(sigma) else 0.0)]
    order = here[np.argsort(profile.position[here, 0], kind="stable")]
    order = order[~spikes(profile.position[order], np.linalg.norm(profile.random[order], axis=1))]
    number = max(1, min(CELLS, len(order) // USUAL_POINTS))
    cell = ((profile.position[order, 0] - low) / (high - low) * number).astype(np.intp)
    count = np.bincount(cell, minlength=number)
    full = np.flatnonzero(count >= FEWEST_POINTS)
    mean = np.zeros((len(full), len(profile.index)))
    for row, one in enumerate(full):
        mean[row, order[cell == one]] = 1.0 / count[one]
    direction = mean @ profile.random
    direction /= np.maximum(np.linalg.norm(direction, axis=1, keepdims=True), 1e-30)
    spread = profile.spread(mean[:, :, None] * direction[:, None, :])
    covariance = spread.T @ spread
    covariance += JITTER * np.diag(np.diag(covariance)) + np.eye(len(full)) * (JITTER * ANY_SIGMA) ** 2
    to_part = T_part_laser[:3, :3] @ np.array([[0.0, 0.0], [1.0, 0.0], [0.0, -1.0]])
    return Cells(
        position=(mean @ profile.position) @ to_part.T + T_part_laser[:3, 3],
        direction=direction @ to_part.T,
        factor=np.asarray(np.linalg.cholesky(covariance), dtype=np.float64),
        systematic=np.einsum("ij,cjk->cik", to_part, np.einsum("cm,mjk->cjk", mean, profile.systematic)),
        count=count[full],
    )


def flatness(profiles: Sequence[Cells], like: Form | None = None) -> Form | str:
    """The form of all profiles' cells, or why there is none; like: of the cells of this one, in its frame.

    A surface flatter than its sigma is found up to some two sigmas less flat than it is, as noise has peaks and valleys
    as well.
    """
    every = [one for one in profiles if len(one.position)]
    if sum(len(one.position) for one in every) < FEWEST_CELLS:
        return TOO_FEW.format(sum(one.points for one in every))
    on = _on_it(every, like)
    if isinstance(on, str):
        return on
    profiles = [taken for one, here in zip(every, on, strict=True) if len((taken := _taken(one, here)).position)]
    position = np.concatenate([np.zeros((0, 3)), *(one.position for one in profiles)])
    if len(position) < FEWEST_CELLS:
        return TOO_FEW.format(sum(one.points for one in profiles))
    centre = position.mean(axis=0)
    lengths, axes = np.linalg.svd(position - centre, full_matrices=False)[1:]
    if lengths[1] < FLATTEST * lengths[0] or len(profiles) < FEWEST_PROFILES:
        return f"its points lie on too few lines; a flatness needs {FEWEST_PROFILES} steps of a scan or more, apart"
    if like is not None:
        centre, axes = like.centre, like.axes
    local = (position - centre) @ axes.T
    scale = np.abs(local[:, :2]).max(axis=0) if like is None else like.scale
    direction = np.concatenate([one.direction for one in profiles]) @ axes.T
    used = np.ones(len(position), dtype=np.bool_)
    theta = np.zeros(PARAMETERS)
    for left in reversed(range(ROUNDS)):
        for _ in range(3):
            theta, solved, miss, gain, slope = _solve(profiles, local, direction, scale, theta, used)
        wrong = used & (np.abs(miss) > OUTLIER_SIGMAS * max(1.0, robust_sigma(miss[used])))
        if left == 0 or not wrong.any() or np.count_nonzero(used & ~wrong) < FEWEST_CELLS:
            break
        used &= ~wrong
    others = np.concatenate([one.position[~here] for one, here in zip(every, on, strict=True)])
    places = local[used, :2] / scale if like is None else like.places
    by_theta = _off_plane(places)
    height = by_theta @ theta
    difference = by_theta[int(np.argmax(height))] - by_theta[int(np.argmin(height))]
    shared = np.concatenate([one.systematic for one in profiles]) if len(profiles) else np.zeros((0, 3, 0))
    off = np.einsum("ni,ij,njk->nk", slope, axes, shared)
    points = int(np.concatenate([one.count for one in profiles])[used].sum())
    return Form(
        value=float(difference @ theta),
        sigma_random=birge(miss[used], int(np.count_nonzero(used)) - PARAMETERS)
        * float(np.linalg.norm(difference @ solved)),
        sigma_systematic=float(np.linalg.norm(difference @ gain @ off)),
        points=points,
        left_out=sum(one.points for one in every) - points,
        farthest=float(np.abs(_over((others - centre) @ axes.T, scale, theta)).max(initial=0.0)),
        theta=theta,
        centre=centre,
        axes=axes,
        scale=scale,
        places=places,
    )


def _on_it(profiles: Sequence[Cells], like: Form | None) -> list[NDArray[np.bool_]] | str:
    """Which cells of each profile are of the surface that most are of, or of that of a form; or why nobody knows."""
    position, direction = (
        np.concatenate([getattr(one, name) for one in profiles]) for name in ("position", "direction")
    )
    sigma = np.concatenate([np.linalg.norm(one.factor, axis=1) for one in profiles])
    if like is not None:
        here = together(_over((position - like.centre) @ like.axes.T, like.scale, like.theta) / sigma)
    else:
        sure = sigma <= UNSURE * float(np.median(sigma))
        here = sure.copy()
        here[sure] = on_one_surface(position[sure], direction[sure], sigma[sure])
        if (share := float(here.sum() / sure.sum())) < LEAST_SHARE:
            return SEVERAL.format(100.0 * share)
    return np.split(here, np.cumsum([len(one.position) for one in profiles])[:-1])


def _taken(one: Cells, here: NDArray[np.bool_]) -> Cells:
    """A part of the cells."""
    if here.all():
        return one
    factor = np.linalg.cholesky((one.factor @ one.factor.T)[np.ix_(here, here)])
    return replace(
        one,
        position=one.position[here],
        direction=one.direction[here],
        factor=np.asarray(factor, dtype=np.float64),
        systematic=one.systematic[here],
        count=one.count[here],
    )


def _over(local: Float, scale: Float, theta: Float) -> Float:
    """(n,) m, of (n, 3) places in a form's frame over it."""
    return np.asarray(local[:, 2] - _powers(local[:, :2] / scale) @ theta)


def _solve(
    profiles: Sequence[Cells], local: Float, direction: Float, scale: Float, theta: Float, used: NDArray[np.bool_]
) -> tuple[Float, Float, Float, Float, Float]:
    """One step of Gauss and Newton.

    theta; a factor (6, n) of its covariance; the whitened misses (n,), 0 where a cell is not used; its derivative by
    the cells' heights off the surface (6, n); the surface's normal at them (n, 3), 1 off the surface.
    """
    by_theta, slope = _powers(local[:, :2] / scale), _normal(local[:, :2] / scale, scale, theta)
    sight = np.einsum("ij,ij->i", slope, direction)
    sight = np.where(np.abs(sight) < 1e-3, np.copysign(1e-3, sight), sight)
    white, height = np.zeros((len(local), PARAMETERS)), np.zeros(len(local))
    gain_of: list[tuple[slice, Float]] = []
    start = 0
    for one in profiles:
        part = slice(start, start := start + len(one.position))
        # in place of the inverse of a block without its unused cells: these get a variance beyond all others
        factor = one.factor if used[part].all() else _without(one.factor, ~used[part])
        whitening = np.linalg.inv(factor) / sight[part]
        white[part], height[part] = whitening @ by_theta[part], whitening @ local[part, 2]
        gain_of.append((part, whitening))
    solved = np.linalg.pinv(white)
    theta = solved @ height
    gain = np.zeros((PARAMETERS, len(local)))
    for part, whitening in gain_of:
        gain[:, part] = solved[:, part] @ whitening
    return theta, np.asarray(solved, dtype=np.float64), height - white @ theta, gain, slope


def _without(factor: Float, unused: NDArray[np.bool_]) -> Float:
    covariance = factor @ factor.T
    huge = 1e12 * np.diag(covariance)
    covariance[unused] = covariance[:, unused] = 0.0
    covariance[unused, unused] = huge[unused]
    return np.asarray(np.linalg.cholesky(covariance))


def _powers(unit: Float) -> Float:
    """(n, 6) of (n, 2) places: constant, plane, and second degree."""
    x, y = unit.T
    return np.column_stack([np.ones(len(x)), x, y, x * x, x * y, y * y])


def _normal(unit: Float, scale: Float, theta: Float) -> Float:
    x, y = unit.T
    along = (theta[1] + 2.0 * theta[3] * x + theta[4] * y) / scale[0]
    across = (theta[2] + theta[4] * x + 2.0 * theta[5] * y) / scale[1]
    return np.column_stack([-along, -across, np.ones(len(x))])


def _off_plane(places: Float) -> Float:
    """(n, 6): the form's height over its least-squares plane at the places, by theta."""
    powers = _powers(places)
    plane = powers[:, :3]
    return np.asarray(powers - plane @ np.linalg.lstsq(plane, powers, rcond=None)[0])
