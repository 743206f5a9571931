"""The joint adjustment: damped Gauss-Newton steps, with the views' poses eliminated one by one (Schur complement).

What is left are the few parameters that all views share; the inverse of their reduced normal matrix is their
covariance, poses included. Source: Triggs et al., Bundle adjustment - a modern synthesis, 2000, section 6.1.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.calibration.estimate import Estimate
from analysis.calibration.observations import Index, Observations
from analysis.calibration.residuals import Linear, corners, laser_points
from render.base.arrays import Bool, Float
from render.base.errors import InputError

STEPS = 100
SMALLEST_STEP = 1e-7
"""In standard deviations of the parameters: steps below it change nothing that matters."""
SETTLED = 1e-3
"""In standard deviations: a last full step that would move nothing by more is the end."""
ROUNDING = 1e-9
"""Of chi-square: what a step may add by rounding alone."""
SINGULAR = 1e-13
"""Smallest eigenvalue of the scaled normal matrix at which its parameters count as determined."""
OPEN_POSE, LEAST_POSE = 1e-12, 1e-9
"""Added to the scaled information on a pose, and least of it that is scaled: so little that no known pose feels it."""


@dataclass(frozen=True)
class Prior:
    """What was known before of all shared parameters: value (p,) and information (p, p); zero where nothing was."""

    value: Float
    information: Float


@dataclass(frozen=True)
class Solution:
    """The adjusted parameters and what is known of their errors."""

    estimate: Estimate
    free: NDArray[np.bool_]
    """(p,) which shared parameters were estimated."""
    covariance: Float
    """(p, p) of the shared parameters; zero where they were held."""
    information: Float
    """(p, p) reduced normal matrix, of free parameters and held ones alike."""
    corner_residual: Float
    """(n, 2) in standard deviations."""
    laser_residual: Float
    """(m,) in standard deviations."""
    freedom: int
    """Observations less parameters."""
    converged: bool

    @property
    def chi2(self) -> float:
        return float(np.sum(self.corner_residual**2) + np.sum(self.laser_residual**2))


@dataclass(frozen=True)
class _Normal:
    """Normal equations, the poses' part by placement of the board."""

    shared: Float
    mixed: Float
    pose: Float
    right_shared: Float
    right_pose: Float
    cost: float


def adjust(seen: Observations, start: Estimate, free: Bool, prior: Prior | None = None, steps: int = STEPS) -> Solution:
    """The least-squares estimate of the free shared parameters and of all poses.

    free (p,) as of `free_parameters`. InputError: the views do not determine the parameters.
    """
    estimate, damping, guess = start, 0.0, None
    normal, _, _, guess = _normal(seen, estimate, free, prior, guess)
    for _ in range(steps):
        shared, poses, size = _step(normal, free, damping)
        if size < SMALLEST_STEP and damping == 0.0:
            break  # whether such a step lessens the cost is decided by rounding
        there = estimate.moved(shared, poses)
        with np.errstate(all="ignore"):
            tried, _, _, tried_guess = _normal(seen, there, free, prior, guess)
        if tried.cost <= normal.cost * (1.0 + 1e-12) + ROUNDING:
            estimate, normal, guess = there, tried, tried_guess
            damping = 0.0 if damping < 1e-8 else damping / 10.0
        else:
            guess = None
            damping = max(10.0 * damping, 1e-6)
            if damping > 1e8:
                break
    normal, at_corners, at_lasers, _ = _normal(seen, estimate, free, prior, guess)
    reduced, _, _ = _reduced(normal, 0.0)
    _, _, remaining = _step(normal, free, 0.0)
    parameters = int(np.count_nonzero(free)) + 6 * (1 + int(estimate.group.max(initial=-1)))
    return Solution(
        estimate=estimate,
        free=free,
        covariance=_covariance(reduced, free, estimate.names),
        information=reduced,
        corner_residual=at_corners.residual.reshape(-1, 2),
        laser_residual=at_lasers.residual,
        freedom=seen.residual_count - parameters,
        converged=remaining < SETTLED,
    )


def view_information(seen: Observations, estimate: Estimate, start: Float | None = None) -> Float:
    """(views, p, p) what each view alone tells of the shared parameters, its pose unknown; start as `laser_points`."""
    everything = np.ones(len(estimate.shared), dtype=bool)
    normal, at_corners, at_lasers, _ = _normal(seen, estimate, everything, None, start)
    assert len(normal.pose) == seen.count
    own = np.stack([a.T @ a + b.T @ b for a, b in _by_view(seen, at_corners, at_lasers, "by_shared")])
    # a view that leaves its pose open in some direction says nothing by way of it; turns and shifts have other sizes
    size = np.sqrt(np.maximum(np.diagonal(normal.pose, axis1=1, axis2=2), LEAST_POSE))[:, :, None]
    pose = normal.pose / (size * size.transpose(0, 2, 1)) + OPEN_POSE * np.eye(6)
    mixed = normal.mixed / size
    return own - mixed.transpose(0, 2, 1) @ np.linalg.solve(pose, mixed)


def leverage(seen: Observations, solution: Solution, first: Index, second: Index) -> Float:
    """(k,) how much the fits at two corners of a view, numbers first (k,) and second (k,), have in common, u plus v.

    Of whitened residuals r the covariance is I - J C J^T, J their derivatives by all parameters and C the covariance of
    these; returned is the entry of J C J^T.
    """
    normal, at_corners, _, _ = _normal(seen, solution.estimate, solution.free, None, None)
    by_pose = at_corners.by_pose.reshape(-1, 2, 6)
    group = solution.estimate.group[seen.view]
    follow = np.linalg.solve(normal.pose, normal.mixed)[group]
    by_shared = at_corners.by_shared.reshape(len(by_pose), 2, -1) - by_pose @ follow
    common = np.sum((by_shared[first] @ solution.covariance) * by_shared[second], axis=(1, 2))
    pose = np.linalg.inv(normal.pose)[group[first]]
    return np.asarray(common + np.sum((by_pose[first] @ pose) * by_pose[second], axis=(1, 2)))


def bending(
    seen: Observations, solution: Solution, prior: Prior | None = None, *, far: float = 1.0, directions: int = 1
) -> float:
    """Rise of chi-square `far` standard deviations from the estimate over far squared, the greatest of both sides of
    the directions that are known least.

    It is 1 where residuals are linear over their parameters' errors, as the covariance supposes; far above it, the
    valley of the cost bends away from the covariance's own axes.
    """
    used = np.nonzero(solution.free)[0]
    if len(used) == 0:
        return 1.0
    normal, _, _, guess = _normal(seen, solution.estimate, solution.free, prior, None)
    matrix, _, follow = _reduced(normal, 0.0)
    inner = matrix[np.ix_(used, used)]
    scale = 1.0 / np.sqrt(np.diag(inner))
    values, vectors = np.linalg.eigh(inner * np.outer(scale, scale))
    costs = []
    for value, vector in zip(values[:directions], vectors.T[:directions], strict=True):
        step = np.zeros(len(solution.free))
        step[used] = far * scale * vector / np.sqrt(max(value, SINGULAR))
        with np.errstate(all="ignore"):
            moved = [solution.estimate.moved(side * step, -follow @ (side * step)) for side in (1.0, -1.0)]
            costs += [_normal(seen, there, solution.free, prior, guess)[0].cost for there in moved]
    return (max(costs) - normal.cost) / far**2


def _by_view(seen: Observations, at_corners: Linear, at_lasers: Linear, name: str) -> list[tuple[Float, Float]]:
    numbers = np.arange(seen.count + 1)
    corner, laser = 2 * np.searchsorted(seen.view, numbers), np.searchsorted(seen.laser_view, numbers)
    a, b = getattr(at_corners, name), getattr(at_lasers, name)
    return [(a[corner[i] : corner[i + 1]], b[laser[i] : laser[i + 1]]) for i in range(seen.count)]


def _normal(
    seen: Observations, estimate: Estimate, free: Bool, prior: Prior | None, guess: Float | None
) -> tuple[_Normal, Linear, Linear, Float]:
    at_corners = corners(seen, estimate)
    at_lasers, guess = laser_points(seen, estimate, guess)
    size = len(estimate.shared)
    shared = at_corners.by_shared.T @ at_corners.by_shared + at_lasers.by_shared.T @ at_lasers.by_shared
    right = at_corners.by_shared.T @ at_corners.residual + at_lasers.by_shared.T @ at_lasers.residual
    group = estimate.group
    groups = 1 + int(group.max(initial=-1))
    mixed, pose, right_pose = np.zeros((groups, 6, size)), np.zeros((groups, 6, 6)), np.zeros((groups, 6))
    by_shared, by_pose = (_by_view(seen, at_corners, at_lasers, name) for name in ("by_shared", "by_pose"))
    residual = _by_view(seen, at_corners, at_lasers, "residual")
    for i, (g, h), (a, b), (r, s) in zip(group, by_shared, by_pose, residual, strict=True):
        mixed[i] += a.T @ g + b.T @ h
        pose[i] += a.T @ a + b.T @ b
        right_pose[i] += a.T @ r + b.T @ s
    cost = float(at_corners.residual @ at_corners.residual + at_lasers.residual @ at_lasers.residual)
    if prior is not None:
        off = estimate.shared - prior.value
        shared, right = shared + prior.information, right + prior.information @ off
        cost += float(off @ prior.information @ off)
    cost = cost if np.isfinite(cost) else np.inf
    return _Normal(shared, mixed, pose, right, right_pose, cost), at_corners, at_lasers, guess


def _reduced(normal: _Normal, damping: float) -> tuple[Float, Float, Float]:
    """The shared parameters' own normal matrix and right side, and (views, 6, p) how poses follow them."""
    pose = normal.pose.copy()
    diagonal = np.arange(6)
    pose[:, diagonal, diagonal] *= 1.0 + damping
    follow = np.linalg.solve(pose, normal.mixed)
    matrix = normal.shared - np.einsum("vip,viq->pq", normal.mixed, follow)
    right = normal.right_shared - np.einsum("vip,vi->p", follow, normal.right_pose)
    return np.asarray(0.5 * (matrix + matrix.T)), np.asarray(right), np.asarray(follow)


def _step(normal: _Normal, free: Bool, damping: float) -> tuple[Float, Float, float]:
    """The step of the shared parameters and of the poses, and its length in standard deviations."""
    matrix, right, follow = _reduced(normal, damping)
    used = np.nonzero(free)[0]
    inner = matrix[np.ix_(used, used)]
    scale = 1.0 / np.sqrt(np.maximum(np.diag(normal.shared)[used], np.finfo(float).tiny))
    scaled = inner * np.outer(scale, scale)
    values, vectors = np.linalg.eigh(scaled + damping * np.eye(len(used)))
    values = np.maximum(values, SINGULAR)
    along = vectors.T @ (right[used] * scale)
    shared = np.zeros(len(free))
    shared[used] = -scale * (vectors @ (along / values))
    poses = -np.linalg.solve(normal.pose, normal.right_pose[:, :, None])[:, :, 0] if damping == 0.0 else None
    if poses is None:
        pose = normal.pose.copy()
        pose[:, np.arange(6), np.arange(6)] *= 1.0 + damping
        poses = -np.linalg.solve(pose, normal.right_pose[:, :, None])[:, :, 0]
    poses = poses - follow @ shared
    size = float(np.sqrt(max(np.sum(along**2 / values), 0.0)))
    return shared, poses, size + float(np.sqrt(max(np.einsum("vi,vij,vj->", poses, normal.pose, poses), 0.0)))


def _covariance(matrix: Float, free: Bool, names: tuple[str, ...]) -> Float:
    used = np.nonzero(free)[0]
    if len(used) == 0:
        return np.zeros_like(matrix)
    inner = matrix[np.ix_(used, used)]
    diagonal = np.diag(inner)
    lost = [names[i] for i, value in zip(used, diagonal, strict=True) if not value > 0.0]
    scale = 1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
    values, vectors = np.linalg.eigh(inner * np.outer(scale, scale))
    if lost or values[0] < SINGULAR:
        weak = ", ".join(lost) if lost else weakest_mixture(matrix, free, names)
        raise InputError(
            "the views do not determine all parameters",
            where="calibration",
            found=f"nothing is known of a mixture of {weak}",
            cure="photograph the board at other tilts and distances, or ask for fewer distortion terms",
        )
    inverse = (vectors / values) @ vectors.T
    out = np.zeros_like(matrix)
    out[np.ix_(used, used)] = inverse * np.outer(scale, scale)
    return out


def weakest_mixture(information: Float, free: Bool, names: tuple[str, ...]) -> str:
    """Of information (p, p): the three free parameters that weigh most in the combination known least."""
    used = np.nonzero(free)[0]
    inner = information[np.ix_(used, used)]
    scale = 1.0 / np.sqrt(np.maximum(np.diag(inner), np.finfo(float).tiny))
    _, vectors = np.linalg.eigh(inner * np.outer(scale, scale))
    return ", ".join(names[used[i]] for i in np.argsort(-np.abs(vectors[:, 0]))[:3])


def rescaled(solution: Solution, seen: Observations) -> tuple[float, float]:
    """Standard deviations of corners and of laser points over those they came with; at least 1.

    The freedom that the parameters take is shared out by the number of observations.
    """
    numbers = (2 * np.count_nonzero(seen.whitening[:, 0, 0]), np.count_nonzero(seen.laser_weight))
    sums = (np.sum(solution.corner_residual**2), np.sum(solution.laser_residual**2))
    share = max(solution.freedom, 1) / max(sum(numbers), 1)
    corner, laser = (float(np.sqrt(max(s / max(n * share, 1.0), 1.0))) for s, n in zip(sums, numbers, strict=True))
    return corner, laser


def without(seen: Observations, corner: Bool, laser: Bool) -> Observations:
    """The same with some corners (n,) and laser points (m,) left out."""
    return replace(
        seen,
        whitening=np.where(corner[:, None, None], 0.0, seen.whitening),
        laser_weight=np.where(laser, 0.0, seen.laser_weight),
    )


def without_views(seen: Observations, bad: Bool) -> Observations:
    """The same without some views (views,), the others numbered anew."""
    number = np.cumsum(~bad) - 1
    corner, laser = ~bad[seen.view], ~bad[seen.laser_view]
    return replace(
        seen,
        names=tuple(name for name, left_out in zip(seen.names, bad, strict=True) if not left_out),
        view=number[seen.view[corner]],
        pixel=seen.pixel[corner],
        target=seen.target[corner],
        whitening=seen.whitening[corner],
        laser_view=number[seen.laser_view[laser]],
        laser=seen.laser[laser],
        laser_pixel=seen.laser_pixel[laser],
        laser_weight=seen.laser_weight[laser],
        along=seen.along[laser],
    )
