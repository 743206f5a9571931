"""Virtual boards that a project's own motion carries, so that its axis is found beside its truth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from analysis.calibration.board import Board
from analysis.calibration.estimate import Estimate
from analysis.calibration.motion import Motion, Told
from analysis.calibration.observations import View
from analysis.calibration.virtual import exact_view, noisy
from render.base.arrays import Float
from render.base.pose import rotation_vector
from render.scene.motion import PoseList
from studio.calibration.in_silico import LEAST_SEEN
from studio.project.found_motion import true_motion
from studio.project.project import Project

POSITIONS = 8
"""Of the one board that is carried."""
FEWEST_POSITIONS = 3
LONGEST, WIDEST = 0.2, float(np.radians(40.0))
"""m and rad to either side at most: a board is to be seen from the same side all the time."""
LASER_STEP = 8


def carried_views(
    project: Project, board: Board, truth: Estimate, *, seed: int, sigmas: tuple[float, float]
) -> tuple[list[View], Estimate, Told] | None:
    """Views of one board at several positions, the truth with the motion, and what the axis was told.

    truth: with poses of the board, in the first of which that is carried. sigmas px of corners and lines.
    None: the project stands still, or the camera sees the board at too few positions.
    """
    motion = carried_motion(project)
    if motion is None:
        return None
    size = (project.scene.camera.width, project.scene.camera.height)
    # of a hand the positions that are seen do, of an axis all are to be seen, over less of it if need be
    by_hand = motion.kind == "hand_eye"
    for number in range(len(truth.rotation)):
        for share in (1.0,) if by_hand else (1.0, 0.5, 0.25, 0.125):
            chosen = motion if by_hand else replace(motion, given=share * motion.given)
            there = replace(truth, rotation=truth.rotation[[number]], translation=truth.translation[[number]])
            there = _carried(there, chosen)
            views = _views(there, board, size, sigmas)
            seen = np.array([len(view.pixel) >= LEAST_SEEN * len(board.target) for view in views])
            if seen.all() or (by_hand and seen.sum() >= FEWEST_POSITIONS):
                kept = np.nonzero(seen)[0]
                rng = np.random.default_rng([seed, number])
                by_name = {views[i].name: ("", np.asarray(chosen.given[i])) for i in kept}
                told = Told(motion.kind, by_name, motion.holds)
                return noisy([views[i] for i in kept], rng), replace(truth, motion=chosen), told
    return None


def carried_motion(project: Project) -> Motion | None:
    """The project's motion as it carries what is seen, in the camera's frame, at positions over the whole of it."""
    scene = project.scene
    moved, last = scene.motion, scene.frame_count - 1
    if isinstance(moved, PoseList):
        some = np.unique(np.linspace(0, last, POSITIONS).round().astype(int))
        turned = np.array([rotation_vector(moved.displacement(int(i))[:3, :3]) for i in some])
        shows = len(some) >= FEWEST_POSITIONS and np.linalg.svd(turned - turned[0], compute_uv=False)[1] >= 0.2
        return true_motion(scene, some) if shows else None
    motion = true_motion(scene, np.linspace(-0.5, 0.5, POSITIONS) * last)
    if motion is None or not np.any(motion.given):
        return None
    return replace(motion, given=_within(motion.given, LONGEST if motion.kind == "stage" else WIDEST))


def _within(given: Float, most: float) -> Float:
    return given * min(1.0, most / max(float(np.abs(given).max()), 1e-12))


def _carried(there: Estimate, motion: Motion) -> Estimate:
    """The only pose of an estimate, in the first position, and those that follow from it."""
    count = len(motion.given)
    rotation, translation = np.repeat(there.rotation, count, axis=0), np.repeat(there.translation, count, axis=0)
    posed = replace(there, rotation=rotation, translation=translation, motion=motion)
    return posed.moved(np.zeros(len(posed.shared)), np.zeros((1, 6)))


def _views(there: Estimate, board: Board, size: tuple[int, int], sigmas: tuple[float, float]) -> list[View]:
    given = {"corner_sigma": sigmas[0], "laser_sigma": sigmas[1]}
    names = (f"moved {i}" for i in range(len(there.rotation)))
    return [
        exact_view(name, there, i, board.target, size, laser_step=LASER_STEP, **given) for i, name in enumerate(names)
    ]
