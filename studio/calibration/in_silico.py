"""A project calibrated with virtual boards: corners and lines by the exact projection, with noise; truth beside all."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress

import numpy as np
from scipy.spatial.transform import Rotation

from analysis.calibration.board import Board
from analysis.calibration.calibrate import Calibrated
from analysis.calibration.depth import Volume, depth_off
from analysis.calibration.estimate import Estimate, plane_vector
from analysis.calibration.observations import View
from analysis.calibration.sequential import WAYS
from analysis.calibration.virtual import exact_view, noisy
from render.base.arrays import Float
from render.base.errors import InputError
from studio.project.project import Project

TRIES = 200
"""Poses drawn for each view before the camera is said not to see the board."""
LEAST_SEEN = 0.6
"""Share of the board's corners that a drawn pose must show."""


def truth_of(project: Project) -> Estimate:
    """The project's camera and laser planes, without poses. InputError: it has no laser that measures, or skew."""
    scene = project.scene
    camera = scene.camera
    if camera.skew != 0.0:
        raise InputError("a camera with skew is not calibrated", where="scene.rig.camera.skew", allowed="0")
    planes = []
    for laser in range(len(scene.lasers)):
        plane = scene.laser_plane(laser)
        if abs(plane[3]) < 1e-6:
            raise InputError("the laser plane passes through the camera's centre", where=f"scene.rig.lasers[{laser}]")
        planes.append(plane_vector(plane))
    return Estimate(
        np.array([camera.fx, camera.fy, camera.cx, camera.cy]),
        np.array(camera.distortion),
        np.zeros(2),
        np.array(planes).reshape(-1, 3),
        np.empty((0, 3, 3)),
        np.empty((0, 3)),
    )


def virtual_views(
    project: Project,
    board: Board,
    count: int,
    *,
    seed: int,
    depth: tuple[float, float],
    most_tilt: float,
    sigmas: tuple[float, float],
) -> tuple[list[View], Estimate]:
    """Noisy views of the board in random poses, and the truth with these poses.

    depth (nearest, farthest) m; most_tilt rad; sigmas px of corners and of the line.
    InputError: the camera sees no such board.
    """
    truth, rng = truth_of(project), np.random.default_rng(seed)
    size = (project.scene.camera.width, project.scene.camera.height)
    views: list[View] = []
    rotations, translations = [], []
    for number in range(count):
        for _ in range(TRIES):
            rotation, translation = _pose(rng, truth, board, depth, most_tilt, size)
            posed = Estimate(
                truth.intrinsics, truth.distortion, truth.warp, truth.planes, rotation[None], translation[None]
            )
            view = exact_view(
                f"view {number}",
                posed,
                0,
                board.target,
                size,
                corner_sigma=sigmas[0],
                laser_sigma=sigmas[1],
                laser_step=8,
            )
            if len(view.pixel) >= LEAST_SEEN * len(board.target):
                break
        else:
            raise InputError(
                f"the camera sees too little of a board of {board.columns} x {board.rows} corners that are "
                f"{1e3 * board.square:g} mm apart, from {1e3 * depth[0]:.4g} to {1e3 * depth[1]:.4g} mm before it",
                where="board",
                allowed=f"{LEAST_SEEN:.0%} of its corners in the image",
                cure="take a smaller board, or hold it at other distances (--nearest and --farthest)",
            )
        views.append(view)
        rotations.append(rotation)
        translations.append(translation)
    whole = Estimate(
        truth.intrinsics, truth.distortion, truth.warp, truth.planes, np.array(rotations), np.array(translations)
    )
    return noisy(views, rng), whole


def true_depth_error(result: Calibrated, truth: Estimate) -> list[tuple[float, float]]:
    """Root mean square of the true depth error over each laser's volume, m, and the one told beforehand."""
    return [(_rms(result.estimate, truth, one.volume), one.rms) for one in result.depth]


def other_ways(
    views: Sequence[View], board: Board, size: tuple[int, int], result: Calibrated, truth: Estimate
) -> dict[str, list[float]]:
    """The same of the usual ways, one after the other, on the same views; those that find nothing are missing."""
    terms, lasers = len(result.estimate.distortion), len(truth.planes)
    found = {}
    for name, way in WAYS.items() if board.circle == 0.0 else ():
        with suppress(InputError, np.linalg.LinAlgError):
            estimate = way(views, board.target, size, terms, lasers)
            found[name] = [_rms(estimate, truth, one.volume) for one in result.depth]
    return found


def _rms(estimate: Estimate, truth: Estimate, volume: Volume) -> float:
    return float(np.sqrt(np.mean(depth_off(estimate, truth, volume) ** 2)))


def _pose(
    rng: np.random.Generator,
    truth: Estimate,
    board: Board,
    depth: tuple[float, float],
    most_tilt: float,
    size: tuple[int, int],
) -> tuple[Float, Float]:
    angle, side = rng.uniform(0.1, 1.0) * most_tilt, rng.uniform(0.0, 2.0 * np.pi)
    turn = Rotation.from_rotvec([angle * np.cos(side), angle * np.sin(side), 0.0])
    turn = turn * Rotation.from_rotvec([0.0, 0.0, rng.uniform(-0.3, 0.3)])
    z = rng.uniform(*depth)
    half = 0.5 * np.array(size) / truth.intrinsics[:2] * z
    reach = 0.5 * np.linalg.norm(board.extent[1])
    room = np.maximum(half - 0.6 * reach, 0.05 * half)
    place = np.append(rng.uniform(-room, room), z)
    if len(truth.planes) and rng.uniform() < 0.7:
        m = truth.planes[rng.integers(len(truth.planes))]
        if abs(m[0]) > 1e-9:  # on the plane, where the line crosses the board
            place[0] = np.clip((1.0 - m[2] * z - m[1] * place[1]) / m[0], -half[0], half[0])
    middle = np.append(0.5 * board.extent[1], 0.0)
    rotation = turn.as_matrix()
    return rotation, place - rotation @ middle
