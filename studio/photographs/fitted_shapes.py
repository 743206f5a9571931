"""Points without truth against the shape that they should lie on: a straight line or a plane, a circle or a sphere."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from render.base.arrays import Float

TRIALS, SEED = 200, 20240501
"""Random subsets that a robust start is the best of."""
STRAY = 5.0
"""Robust sigmas beyond which a point is no part of the shape."""
ROUNDS = 10
FLAT = 1e-3
"""Of the points' extent: with less in the second direction they lie on one line, and any plane through it fits."""


@dataclass(frozen=True)
class Fit:
    """A shape and how the points (n,) lie about it, m."""

    residual: Float
    """(n,) signed distance."""
    direction: Float
    """(n, d) unit vector from the shape to the point's side."""
    inlier: NDArray[np.bool_]
    """(n,)"""
    radius: float = float("nan")

    @property
    def rms(self) -> float:
        """Of the points that are part of the shape."""
        return float(np.sqrt(np.mean(self.residual[self.inlier] ** 2)))

    @property
    def strays(self) -> float:
        """Share of the points that are not."""
        return 1.0 - float(np.mean(self.inlier))

    def normalised(self, error: Float) -> float:
        """Typical |residual| over what is told: 1 where sigma is true. error (n, d): one sigma of each point."""
        told = np.abs((error * self.direction).sum(axis=1))
        known = (told > 0.0) & self.inlier
        # the median of |normal| is 0.6745
        return float(np.median(np.abs(self.residual[known]) / told[known]) / 0.6745) if known.any() else float("nan")


def fit_flat(points: Float) -> Fit | None:
    """Points (n, 2) or (n, 3), m -> straight line or plane by total least squares; None: they do not span one.

    Strays are left out by a robust start (least median of squares; Rousseeuw, 1984) and rounds of trimming.
    """
    count, size = points.shape
    if count < 3 * size or _thin(points):
        return None

    def flat(chosen: Float) -> tuple[Float, float]:
        middle = chosen.mean(axis=0)
        normal = np.linalg.svd(chosen - middle, full_matrices=False)[2][-1] if len(chosen) > size else _across(chosen)
        return normal, float(normal @ middle)

    def residual(shape: tuple[Float, float]) -> Float:
        return np.asarray(points @ shape[0] - shape[1])

    picks = _subsets(count, size)
    start = min((flat(points[pick]) for pick in picks), key=lambda one: float(np.median(np.abs(residual(one)))))
    inlier = _near(residual(start), size)
    for _ in range(ROUNDS):
        start = flat(points[inlier])
        again = _near(residual(start), size)
        if np.array_equal(again, inlier):
            break
        inlier = again
    return Fit(residual(start), np.broadcast_to(start[0], points.shape), inlier)


def fit_round(points: Float) -> Fit | None:
    """Points (n, 2) or (n, 3), m -> circle or sphere; None: too few points, or they lie flat.

    Linear least squares for |p|^2 = 2 c p + k, then Gauss-Newton on distances, strays trimmed.
    """
    count, size = points.shape
    if count < 4 * size or _thin(points):
        return None

    def solve(chosen: Float) -> Float:
        middle = chosen.mean(axis=0)
        local = chosen - middle
        system = np.column_stack([2.0 * local, np.ones(len(local))])
        found = np.linalg.lstsq(system, (local**2).sum(axis=1), rcond=None)[0]
        centre = found[:size]
        return np.append(centre + middle, np.sqrt(max(found[size] + centre @ centre, 0.0)))

    def residual(shape: Float) -> Float:
        return np.asarray(np.linalg.norm(points - shape[:size], axis=1) - shape[size])

    shape = min(
        (solve(points[pick]) for pick in _subsets(count, 2 * size)),
        key=lambda one: float(np.median(np.abs(residual(one)))),
    )
    inlier = _near(residual(shape), size)
    for _ in range(ROUNDS):
        away = points[inlier] - shape[:size]
        away /= np.maximum(np.linalg.norm(away, axis=1), 1e-12)[:, None]
        step = np.linalg.lstsq(np.column_stack([away, np.ones(len(away))]), residual(shape)[inlier], rcond=None)[0]
        shape = shape + step
        inlier = _near(residual(shape), size)
    away = points - shape[:size]
    return Fit(residual(shape), away / np.linalg.norm(away, axis=1)[:, None], inlier, float(shape[size]))


def _near(residual: Float, size: int) -> NDArray[np.bool_]:
    scale = 1.4826 * float(np.median(np.abs(residual)))
    near = np.abs(residual) <= STRAY * max(scale, 1e-12)
    return np.asarray(near if near.sum() > size else np.ones(len(residual), np.bool_))


def _thin(points: Float) -> bool:
    """Of points in space: no second direction."""
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return bool(points.shape[1] == 3 and spread[1] <= FLAT * spread[0])


def _subsets(count: int, size: int) -> Float:
    rng = np.random.default_rng(SEED)
    return np.stack([rng.choice(count, size, replace=False) for _ in range(TRIALS)])


def _across(chosen: Float) -> Float:
    """Unit normal of a straight line through two points, or a plane through three."""
    steps = chosen[1:] - chosen[0]
    normal = np.cross(steps[0], steps[1]) if len(steps) == 2 else np.array([-steps[0, 1], steps[0, 0]])
    return np.asarray(normal / max(float(np.linalg.norm(normal)), 1e-300))
