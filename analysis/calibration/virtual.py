"""Views of a board by exact projection: what a calibration would be given, in silico or of a view not yet taken."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from analysis.calibration.estimate import Estimate
from analysis.calibration.lens import normalise, project
from analysis.calibration.observations import Stripe, View
from render.base.arrays import Float


def exact_view(
    name: str,
    estimate: Estimate,
    number: int,
    target: Float,
    size: tuple[int, int],
    *,
    corner_sigma: float = 0.05,
    laser_sigma: float = 0.05,
    laser_step: int = 1,
) -> View:
    """What the camera sees of pose `number` of an estimate: corners inside the image, laser lines inside the board.

    target (n, 2) m; size (width, height) px; laser_step: every so many rows have a laser point. Lasers are
    measured along rows, between the outermost corners.
    """
    rotation, translation = estimate.rotation[number], estimate.translation[number]
    least, greatest = target.min(axis=0), target.max(axis=0)
    centre, half = 0.5 * (least + greatest), 0.5 * (greatest - least)
    height = (1.0 - ((target - centre) / half) ** 2) @ estimate.warp
    point = np.concatenate([target, height[:, None]], axis=1) @ rotation.T + translation
    ahead = np.where(point[:, 2:] > 1e-6, point[:, 2:], np.nan)
    pixel, _, _ = project(point[:, :2] / ahead, estimate.intrinsics, estimate.distortion)
    seen = _inside(pixel, size)
    stripes = []
    for laser in range(len(estimate.planes)):
        line = _laser_line(estimate, laser, (rotation, translation), (centre, half), size, laser_step)
        found, place = line[:, :2], line[:, 2:]
        on = _inside(found, size) & np.all((place >= least) & (place <= greatest), axis=1)
        stripes.append(Stripe(laser, found[on], np.full(int(on.sum()), laser_sigma)))
    covariance = np.broadcast_to(np.eye(2) * corner_sigma**2, (int(seen.sum()), 2, 2))
    return View(name, pixel[seen], covariance, target[seen], tuple(one for one in stripes if len(one.pixel)))


def noisy(views: Sequence[View], rng: np.random.Generator) -> list[View]:
    """The same views with errors drawn from their own covariances."""
    out = []
    for view in views:
        root = np.linalg.cholesky(view.covariance)
        pixel = view.pixel + np.einsum("nij,nj->ni", root, rng.normal(size=view.pixel.shape))
        stripes = []
        for stripe in view.stripes:
            moved = stripe.pixel.copy()
            moved[:, 0 if stripe.axis == "rows" else 1] += stripe.sigma * rng.normal(size=len(moved))
            stripes.append(Stripe(stripe.laser, moved, stripe.sigma, stripe.axis))
        out.append(View(view.name, pixel, view.covariance, view.target, tuple(stripes)))
    return out


def _inside(pixel: Float, size: tuple[int, int]) -> np.ndarray:
    with np.errstate(invalid="ignore"):
        return np.all((pixel >= 0.0) & (pixel <= np.array(size) - 1.0), axis=1)


def _laser_line(
    estimate: Estimate,
    laser: int,
    pose: tuple[Float, Float],
    shape: tuple[Float, Float],
    size: tuple[int, int],
    step: int,
) -> Float:
    """(rows, 4) where the laser's line crosses each image row, u, v, and its place on the board, m."""
    (rotation, translation), (centre, half), m = pose, shape, estimate.planes[laser]
    v = np.arange(0.0, size[1], step)
    u = np.full_like(v, estimate.intrinsics[2])
    place = np.full((len(v), 3), np.nan)
    for _ in range(50):
        q = normalise(np.stack([u, v], axis=1), estimate.intrinsics, estimate.distortion)
        full = np.concatenate([q, np.ones((len(q), 1))], axis=1)
        point = full / (full @ m)[:, None]
        place = (point - translation) @ rotation
        relative = (place[:, :2] - centre) / half
        level = place[:, 2] - (1.0 - relative**2) @ estimate.warp
        normal = np.concatenate([2.0 * estimate.warp * relative / half, np.ones((len(q), 1))], axis=1) @ rotation.T
        _, by_q, _ = project(q, estimate.intrinsics, estimate.distortion)
        fold = np.linalg.det(by_q)
        by_u = np.column_stack([by_q[:, 1, 1], -by_q[:, 1, 0]]) / np.where(fold > 0.0, fold, np.inf)[:, None]
        facing = np.einsum("ni,ni->n", normal, point)
        level_u = np.einsum("ni,ni->n", normal[:, :2] - m[:2] * facing[:, None], by_u) / (full @ m)
        with np.errstate(divide="ignore", invalid="ignore"):
            change = np.nan_to_num(level / level_u)
        u = u - np.clip(change, -400.0, 400.0)
        u = np.clip(u, -size[0], 2.0 * size[0])
        if np.nanmax(np.abs(change), initial=0.0) < 1e-11:
            break
    # beyond the fold of a lens, and where line and scan line run side by side, nothing was found
    u = np.where((np.abs(change) < 1e-6) & (fold > 0.0) & (level_u != 0.0), u, np.nan)
    return np.concatenate([np.stack([u, v], axis=1), place[:, :2]], axis=1)
