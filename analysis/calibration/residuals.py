"""Residuals of the joint adjustment, in standard deviations, with their analytic derivatives.

A corner: where the camera sees it less where it was found. A laser point: on its scan line, where the camera sees the
curve in which the laser plane cuts the board, less where the line was found. With q = (x, y, 1) on the laser plane
P = q / (m . q), that curve is  F(q) = (R^T (P - t))_z - warp = 0; together with the scan line's own equation it gives
the two unknowns of q, and its derivatives follow from both equations (implicit function theorem). Of a board that is
carried from view to view, P = A P0 by a motion A, derivatives are those by P0, where it was placed, and by A.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from analysis.calibration.estimate import Estimate
from analysis.calibration.lens import CAMERA, Lens, lens_of, normalise, project_point
from analysis.calibration.observations import Index, Observations
from render.base.arrays import Float

SEARCH, FOUND, FARTHEST = 12, 1e-13, 0.2
"""Steps of a search along the laser's curve, the step at which it ends, and the longest one, of normalised q."""


class Linear(NamedTuple):
    """Residuals (r,) with derivatives by the shared parameters (r, p) and by their own placement's pose (r, 6)."""

    residual: Float
    by_shared: Float
    by_pose: Float


class Corners(NamedTuple):
    """As in `Observations`."""

    view: Index
    pixel: Float
    target: Float
    whitening: Float


class LaserPoints(NamedTuple):
    """As in `Observations`."""

    view: Index
    laser: Index
    along: Index
    pixel: Float
    weight: Float


class Boards(NamedTuple):
    """Where the boards are, as kernels take it: of (views,) each, and what is common to them."""

    rotation: Float
    translation: Float
    moved: Float
    """(views, 3, 3) rotation of the motion that carried them."""
    shift: Float
    """(views, 3) m."""
    derivative: Float
    """(views, p, 3, 4) of that motion by its parameters."""
    warp: Float
    centre: Float
    half: Float
    planes: Float


def corners(seen: Observations, estimate: Estimate) -> Linear:
    """(2 n,) residuals of the corners, u and v in turn, whitened."""
    size = len(estimate.shared)
    count = len(seen.view)
    out = Linear(np.empty((count, 2)), np.zeros((count, 2, size)), np.empty((count, 2, 6)))
    lens, boards = _as_kernels_take(seen, estimate)
    given = Corners(seen.view, seen.pixel, seen.target, seen.whitening)
    linear_corners(given, lens, boards, estimate.camera_count, out)
    return Linear(out.residual.ravel(), out.by_shared.reshape(-1, size), out.by_pose.reshape(-1, 6))


def laser_points(seen: Observations, estimate: Estimate, start: Float | None = None) -> tuple[Linear, Float]:
    """(m,) residuals of the laser points, and (m, 2) where they are, normalised, to start the next search from."""
    count = len(seen.laser)
    q = normalise(seen.laser_pixel, estimate.intrinsics, estimate.distortion) if start is None else start.copy()
    out = Linear(np.empty(count), np.zeros((count, len(estimate.shared))), np.empty((count, 6)))
    lens, boards = _as_kernels_take(seen, estimate)
    found = LaserPoints(seen.laser_view, seen.laser, seen.along, seen.laser_pixel, seen.laser_weight)
    linear_laser_points(found, lens, boards, estimate.camera_count, q, out)
    return out, q


def _as_kernels_take(seen: Observations, estimate: Estimate) -> tuple[Lens, Boards]:
    views = len(estimate.rotation)
    if estimate.motion is None:
        moved = np.tile(np.eye(3), (views, 1, 1)), np.zeros((views, 3)), np.empty((views, 0, 3, 4))
    else:
        moves = estimate.motion.moves()
        moved = moves.rotation, moves.shift, moves.derivative
    given = (estimate.rotation, estimate.translation, *moved, estimate.warp, seen.centre, seen.half, estimate.planes)
    return lens_of(estimate.intrinsics, estimate.distortion), Boards(*(np.ascontiguousarray(one) for one in given))


@numba.njit(nogil=True, cache=True, error_model="numpy")
def linear_corners(given: Corners, lens: Lens, boards: Boards, camera: int, out: Linear) -> None:
    """Fills residual (n, 2), by_shared (n, 2, p), which is zero before, and by_pose (n, 2, 6)."""
    view, pixel, target, whitening = given
    residual, by_shared, by_pose = out
    by_q, by_camera = np.empty((2, 2)), np.empty((2, CAMERA))
    arm, outward, by_point, row = np.empty(3), np.empty(2), np.empty(3), np.empty(by_shared.shape[2])
    motion = by_shared.shape[2] - boards.derivative.shape[1]
    row[:] = 0.0
    pose = np.empty(6)
    for i in range(len(view)):
        v = view[i]
        turn = boards.rotation[v]
        outward[:] = 1.0 - ((target[i] - boards.centre) / boards.half) ** 2
        height = outward[0] * boards.warp[0] + outward[1] * boards.warp[1]
        arm[:] = turn[:, 0] * target[i, 0] + turn[:, 1] * target[i, 1] + turn[:, 2] * height
        point = arm + boards.translation[v]
        x, y = point[0] / point[2], point[1] / point[2]
        seen = project_point(x, y, lens, by_q, by_camera)
        by_pose[i] = 0.0
        residual[i] = 0.0
        for k in range(2):
            by_point[:2] = by_q[k] / point[2]
            by_point[2] = -(by_q[k, 0] * x + by_q[k, 1] * y) / point[2]
            row[:camera] = by_camera[k, :camera]
            row[camera : camera + 2] = _dot(by_point, turn[:, 2]) * outward
            _by_motion(boards, v, by_point, point, row[motion:])
            _by_pose(boards.moved[v], by_point, arm, pose)
            for j in range(2):
                w = whitening[i, j, k]
                residual[i, j] += w * (seen[k] - pixel[i, k])
                by_shared[i, j] += w * row
                by_pose[i, j] += w * pose


@numba.njit(nogil=True, cache=True, error_model="numpy")
def linear_laser_points(given: LaserPoints, lens: Lens, boards: Boards, camera: int, q: Float, out: Linear) -> None:
    """Moves q (m, 2) onto the laser's curves and fills residual (m,), by_shared (m, p), zero before, by_pose (m, 6)."""
    view, laser, along, pixel, weight = given
    residual, by_shared, by_pose = out
    by_q, by_camera = np.empty((2, 2)), np.empty((2, CAMERA))
    at = np.empty(LEVEL)
    motion = by_shared.shape[1] - boards.derivative.shape[1]
    for i in range(len(view)):
        v, measured, held = view[i], along[i], 1 - along[i]
        plane = boards.planes[laser[i]]
        for _ in range(SEARCH):
            u = project_point(q[i, 0], q[i, 1], lens, by_q, by_camera)
            _board_level(boards, v, plane, q[i], at)
            first, second, third, fourth = by_q[held, 0], by_q[held, 1], at[1], at[2]
            bottom = first * fourth - second * third
            off = u[held] - pixel[i, held]
            step_x = (off * fourth - second * at[0]) / bottom
            step_y = (first * at[0] - third * off) / bottom
            step_x, step_y = min(max(step_x, -FARTHEST), FARTHEST), min(max(step_y, -FARTHEST), FARTHEST)
            q[i, 0] -= step_x
            q[i, 1] -= step_y
            if max(abs(step_x), abs(step_y)) < FOUND:
                break
        # the pixel goes along: left behind, it would make the cost depend on where the search began
        there = u[measured] - by_q[measured, 0] * step_x - by_q[measured, 1] * step_y
        by_held = (by_q[measured, 0] * fourth - by_q[measured, 1] * third) / bottom
        by_level = (first * by_q[measured, 1] - second * by_q[measured, 0]) / bottom
        w = weight[i]
        residual[i] = w * (there - pixel[i, measured])
        by_shared[i, :camera] = w * (by_camera[measured, :camera] - by_held * by_camera[held, :camera])
        by_shared[i, camera : camera + 2] = w * by_level * at[3:5]
        plane_at = camera + 2 + 3 * laser[i]
        by_shared[i, plane_at : plane_at + 3] = w * by_level * at[5] * at[6:9]
        # of the board: the point does not move with it
        _by_motion(boards, v, at[9:12], at[6:9], by_shared[i, motion:])
        by_shared[i, motion:] *= w * by_level
        _by_pose(boards.moved[v], at[9:12], at[12:15], by_pose[i])
        by_pose[i] *= w * by_level


LEVEL = 15
"""Height of the laser plane's point above the board 0, its derivative by q 1:3 and, negative, by warp 3:5, facing 5,
the point 6:9 m, derivative by the point 9:12, the point from the board's origin 12:15 m."""


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _board_level(boards: Boards, v: int, m: Float, q: Float, at: Float) -> None:
    """Fills at (15,), of the point of the plane m that is seen at q."""
    turn = boards.rotation[v]
    scale = m[0] * q[0] + m[1] * q[1] + m[2]
    point, arm, by_point = at[6:9], at[12:15], at[9:12]
    point[0], point[1], point[2] = q[0] / scale, q[1] / scale, 1.0 / scale
    arm[:] = point - boards.translation[v]
    by_point[:] = turn[:, 2]
    at[0] = _dot(turn[:, 2], arm)
    for k in range(2):
        relative = (_dot(turn[:, k], arm) - boards.centre[k]) / boards.half[k]
        at[3 + k] = 1.0 - relative**2
        at[0] -= at[3 + k] * boards.warp[k]
        by_point += turn[:, k] * (2.0 * boards.warp[k] * relative / boards.half[k])
    at[5] = _dot(by_point, point)
    at[1] = (by_point[0] - m[0] * at[5]) / scale
    at[2] = (by_point[1] - m[1] * at[5]) / scale


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _dot(a: Float, b: Float) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _by_motion(boards: Boards, v: int, by_point: Float, point: Float, out: Float) -> None:
    """What each parameter of a motion moves a point by, and what that does to a function of it."""
    away = point - boards.shift[v]
    turn = boards.moved[v]
    for p in range(len(out)):
        out[p] = 0.0
        for a in range(3):
            by = boards.derivative[v, p, a]
            moved = by[3]
            for b in range(3):
                moved += by[b] * _dot(turn[:, b], away)
            out[p] += by_point[a] * moved


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _by_pose(moved: Float, by_point: Float, arm: Float, out: Float) -> None:
    """Of a function of a point, by the turn about the board's origin and the shift of where the board was placed."""
    for a in range(3):
        out[3 + a] = _dot(moved[:, a], by_point)
    for a in range(3):
        b, c = (a + 1) % 3, (a + 2) % 3
        out[a] = _dot(moved[:, b], arm) * out[3 + c] - _dot(moved[:, c], arm) * out[3 + b]
