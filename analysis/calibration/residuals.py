"""Residuals of the joint adjustment, in standard deviations, with their analytic derivatives.

A corner: where the camera sees it less where it was found. A laser point: on its scan line, where the camera sees the
curve in which the laser plane cuts the board, less where the line was found. With q = (x, y, 1) on the laser plane
P = q / (m . q), that curve is  F(q) = (R^T (P - t))_z - warp = 0; together with the scan line's own equation it gives
the two unknowns of q, and its derivatives follow from both equations (implicit function theorem). Of a board that is
carried from view to view, P = A P0 by a motion A, derivatives are those by P0, where it was placed, and by A.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np

from analysis.calibration.estimate import Estimate
from analysis.calibration.lens import normalise, project
from analysis.calibration.motion import Moves, cross_matrices
from analysis.calibration.observations import Index, Observations
from render.base.arrays import Float


@dataclass(frozen=True)
class Linear:
    """Residuals (r,) with derivatives by the shared parameters (r, p) and by their own placement's pose (r, 6)."""

    residual: Float
    by_shared: Float
    by_pose: Float


def corners(seen: Observations, estimate: Estimate) -> Linear:
    """(2 n,) residuals of the corners, u and v in turn, whitened."""
    rotation = estimate.rotation[seen.view]
    place, outward = board_points(seen, estimate.warp, seen.target)
    turned = np.einsum("nij,nj->ni", rotation, place)
    point = turned + estimate.translation[seen.view]
    q = point[:, :2] / point[:, 2:]
    pixel, by_q, by_camera = project(q, estimate.intrinsics, estimate.distortion)
    by_point = np.concatenate([by_q, -by_q @ q[:, :, None]], axis=2) / point[:, 2, None, None]
    by_shared = np.zeros((len(q), 2, len(estimate.shared)))
    camera = estimate.camera_count
    by_shared[:, :, :camera] = by_camera
    by_shared[:, :, camera : camera + 2] = (by_point @ rotation[:, :, 2, None]) * outward[:, None, :]
    if estimate.motion is not None:
        moves = estimate.motion.moves()
        by_shared[:, :, estimate.motion_slice] = _by_motion(moves, seen.view, by_point, point)
        back = moves.rotation[seen.view]
        turned, by_point = np.einsum("nji,nj->ni", back, turned), by_point @ back
    by_pose = np.concatenate([-by_point @ cross_matrices(turned), by_point], axis=2)
    residual = np.einsum("nij,nj->ni", seen.whitening, pixel - seen.pixel)
    return Linear(
        residual.ravel(),
        (seen.whitening @ by_shared).reshape(-1, by_shared.shape[2]),
        (seen.whitening @ by_pose).reshape(-1, 6),
    )


def laser_points(seen: Observations, estimate: Estimate, start: Float | None = None) -> tuple[Linear, Float]:
    """(m,) residuals of the laser points, and (m, 2) where they are, normalised, to start the next search from."""
    count = len(seen.laser)
    everyone = np.arange(count)
    along, across = seen.along, 1 - seen.along
    q = normalise(seen.laser_pixel, estimate.intrinsics, estimate.distortion) if start is None else start
    for _ in range(12):
        pixel, by_q, by_camera = project(q, estimate.intrinsics, estimate.distortion)
        level, level_q, level_shared, level_pose = _board_level(seen, estimate, q)
        matrix = np.stack([by_q[everyone, across], level_q], axis=1)
        off = np.stack([pixel[everyone, across] - seen.laser_pixel[everyone, across], level], axis=1)
        step = np.clip(np.linalg.solve(matrix, off[:, :, None])[:, :, 0], -0.2, 0.2)
        q = q - step
        # the pixel goes along: left behind, it would make the cost depend on where the search began
        pixel = pixel - np.einsum("nij,nj->ni", by_q, step)
        if np.abs(step).max(initial=0.0) < 1e-13:
            break
    by_both = np.linalg.solve(matrix.transpose(0, 2, 1), by_q[everyone, along][:, :, None])[:, :, 0]
    by_shared = -by_both[:, 1, None] * level_shared
    camera = estimate.camera_count
    by_shared[:, :camera] += by_camera[everyone, along] - by_both[:, 0, None] * by_camera[everyone, across]
    residual = pixel[everyone, along] - seen.laser_pixel[everyone, along]
    weight = seen.laser_weight[:, None]
    return Linear(residual * seen.laser_weight, by_shared * weight, -by_both[:, 1, None] * level_pose * weight), q


def _board_level(seen: Observations, estimate: Estimate, q: Float) -> tuple[Float, Float, Float, Float]:
    """(m,) height F of the laser plane's point above the board, its derivatives by q, shared parameters and pose."""
    m = estimate.planes[seen.laser]
    rotation = estimate.rotation[seen.laser_view]
    scale = np.einsum("ni,ni->n", m, np.concatenate([q, np.ones((len(q), 1))], axis=1))
    point = np.concatenate([q, np.ones((len(q), 1))], axis=1) / scale[:, None]
    arm = point - estimate.translation[seen.laser_view]
    place = np.einsum("nji,nj->ni", rotation, arm)
    relative = (place[:, :2] - seen.centre) / seen.half
    outward = 1.0 - relative**2
    level = place[:, 2] - outward @ estimate.warp
    slope = np.concatenate([2.0 * estimate.warp * relative / seen.half, np.ones((len(q), 1))], axis=1)
    by_point = np.einsum("nij,nj->ni", rotation, slope)
    facing = np.einsum("ni,ni->n", by_point, point)
    level_q = (by_point[:, :2] - m[:, :2] * facing[:, None]) / scale[:, None]
    by_shared = np.zeros((len(q), len(estimate.shared)))
    camera = estimate.camera_count
    by_shared[:, camera : camera + 2] = -outward
    for laser in range(len(estimate.planes)):
        own = seen.laser == laser
        by_shared[own, estimate.plane_slice(laser)] = -facing[own, None] * point[own]
    if estimate.motion is not None:
        moves = estimate.motion.moves()
        by_shared[:, estimate.motion_slice] = -_by_motion(moves, seen.laser_view, by_point[:, None], point)[:, 0]
        back = moves.rotation[seen.laser_view]
        arm, by_point = (np.einsum("nji,nj->ni", back, each) for each in (arm, by_point))
    by_pose = np.concatenate([-np.cross(arm, by_point), -by_point], axis=1)
    return level, level_q, by_shared, by_pose


def _by_motion(moves: Moves, view: Index, by_point: Float, point: Float) -> Float:
    """(n, k, p) of k functions of points (n, 3) of some views (n,), whose derivatives by the point are (n, k, 3)."""
    given = (moves.rotation, moves.shift, moves.derivative, by_point, point)
    return np.asarray(through_motion(view, *(np.ascontiguousarray(one) for one in given)))


@numba.njit(nogil=True, cache=True, error_model="numpy")
def through_motion(
    view: Index, rotation: Float, shift: Float, derivative: Float, by_point: Float, point: Float
) -> Float:
    """What each parameter of a motion moves a point by, where it was placed, and what that does to functions of it."""
    count, rows, size = len(view), by_point.shape[1], derivative.shape[1]
    out, placed, moved = np.empty((count, rows, size)), np.empty(3), np.empty(3)
    for i in range(count):
        v = view[i]
        for a in range(3):
            placed[a] = 0.0
            for b in range(3):
                placed[a] += rotation[v, b, a] * (point[i, b] - shift[v, b])
        for p in range(size):
            for a in range(3):
                by = derivative[v, p, a]
                moved[a] = by[0] * placed[0] + by[1] * placed[1] + by[2] * placed[2] + by[3]
            for row in range(rows):
                by = by_point[i, row]
                out[i, row, p] = by[0] * moved[0] + by[1] * moved[1] + by[2] * moved[2]
    return out


def board_points(seen: Observations, warp: Float, target: Float) -> tuple[Float, Float]:
    """(n, 2) places on the board -> (n, 3) m in the board's frame, and (n, 2) height a metre of each warp."""
    outward = 1.0 - ((target - seen.centre) / seen.half) ** 2
    return np.concatenate([target, (outward @ warp)[:, None]], axis=1), outward
