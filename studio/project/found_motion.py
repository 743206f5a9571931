"""The motion that a calibration found, and what a scan's points are placed with in place of what its axis was to do.

A point of step i is P in the camera's frame and was A_i^-1 P at step 0, where A_i is the motion of the board, and of
what stands in its place, relative to the camera (`analysis.calibration.motion`).
"""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from analysis.calibration.motion import Held, Motion, turntable
from render.base.arrays import Float
from render.base.model import Model, Position, quantity
from render.base.pose import Turn, invert, rotation_vector
from render.scene.motion import LinearStage, NoMotion, PoseList, Turntable
from render.scene.scene import Scene
from studio.project.covariance import Entry, check_covariance

Covariance = tuple[Annotated[tuple[Entry, ...], Field(max_length=6)], ...]
Share = Annotated[float, Field(ge=-1e3, le=1e3)]
CAMERA: Held = "camera"
BOARD: Held = "board"
MADE = {"stage": "linear", "turntable": "turntable", "hand_eye": "poses"}
"""The kind of a scene's motion that each is of."""


class _Found(Model):
    covariance: Covariance = quantity((), label="Covariance", help="Of these values; none: exact.", max_length=6)

    @property
    def values(self) -> Float:
        """(3,) or (6,) of what the covariance is."""
        raise NotImplementedError

    @property
    def sigma(self) -> Float:
        """Of each of the values; 0 where it is exact."""
        size = len(self.values)
        return np.asarray(np.sqrt(np.maximum(np.diag(_matrix(self.covariance, size)), 0.0)))

    @model_validator(mode="after")
    def _goes_with_its_values(self) -> Self:
        size = len(self.values)
        if self.covariance:
            if len(self.covariance) != size or any(len(row) != size for row in self.covariance):
                raise ValueError(f"covariance is not square; allowed: {size} rows of {size} numbers")
            check_covariance(np.array(self.covariance), "covariance")
        return self


class FoundStage(_Found):
    """A stage, by the board's way in the camera's frame."""

    kind: Literal["stage"] = "stage"
    step: tuple[Share, Share, Share] = quantity(label="Way", help="Of the board for each metre told.")

    @property
    def values(self) -> Float:
        return np.array(self.step)

    def of(self, motion: Motion) -> tuple[Motion, Float]:
        """What was told to a scene's axis, carried out as it was found, and (p, p) the covariance of its parameters."""
        return motion.with_parameters(self.values), _matrix(self.covariance, 3)


class FoundTurntable(_Found):
    """A turntable, by its axis in the camera's frame."""

    kind: Literal["turntable"] = "turntable"
    axis: tuple[Share, Share, Share] = quantity(label="Axis", help="Direction about which the board turns.")
    point: Position = quantity(unit="m", label="Point", help="Of the axis, next to the camera.")

    @property
    def values(self) -> Float:
        return np.array([*self.axis, *self.point])

    @model_validator(mode="after")
    def _is_an_axis(self) -> Self:
        length = float(np.linalg.norm(self.axis))
        if not abs(length - 1.0) < 1e-3:
            raise ValueError(f"axis has a length of {length:.6g}; allowed: 1")
        return self

    def of(self, motion: Motion) -> tuple[Motion, Float]:
        """As of a stage."""
        axis, point = self.values[:3], self.values[3:]
        found = turntable(motion.group, motion.given, axis / np.linalg.norm(axis), point)
        back = np.linalg.pinv(found.axis_and_point_derivative())
        return found, back @ _matrix(self.covariance, 6) @ back.T


class FoundHand(_Found):
    """A robot's hand, by the camera's pose in it, or in its base where it carries the objects."""

    kind: Literal["hand_eye"] = "hand_eye"
    holds: Held = quantity("camera", label="Holds", help="The camera, or what is measured.")
    rotation: tuple[Turn, Turn, Turn] = quantity(unit="rad", label="Rotation vector")
    translation: Position = quantity(unit="m", label="Position")

    @property
    def values(self) -> Float:
        return np.array([*self.rotation, *self.translation])

    def of(self, motion: Motion) -> tuple[Motion, Float]:
        """As of a stage."""
        return motion.with_parameters(self.values), _matrix(self.covariance, 6)


FoundMotion = Annotated[FoundStage | FoundTurntable | FoundHand, Field(discriminator="kind")]


def motion_fault(found: FoundMotion | None, scene: Scene) -> str:
    """Why a scene's points cannot be placed by it, as a sentence; empty: they can, or the scene stands still."""
    moved = scene.motion
    if found is None or isinstance(moved, NoMotion):
        return ""
    if moved.kind != MADE[found.kind]:
        return f"calibration.motion is of kind {found.kind}; allowed: none, as scene.motion is of kind {moved.kind}"
    if isinstance(found, FoundHand) and (found.holds == "camera") != (moved.moves == "rig"):
        return f"calibration.motion has a hand that holds the {found.holds}, and scene.motion moves the {moved.moves}"
    return ""


def true_motion(scene: Scene, steps: Any) -> Motion | None:
    """The scene's own, with what its axis was told at some steps (n,); of an axis these may be fractions.

    None: the scene stands still.
    """
    moved, camera = scene.motion, scene.rig.T_world_rig.matrix @ scene.camera.T_rig_camera.matrix
    group, along = np.zeros(len(steps), dtype=np.intp), np.eye(3)[1]
    if isinstance(moved, NoMotion):
        return None
    rotation, sign = camera[:3, :3], 1.0 if moved.moves == "objects" else -1.0
    if isinstance(moved, LinearStage):
        length = float(np.linalg.norm(moved.step))
        way = sign * rotation.T @ np.array(moved.step) / length if length > 0.0 else np.zeros(3)
        return Motion("stage", group, length * np.asarray(steps), way, along)
    if isinstance(moved, Turntable):
        axis = sign * rotation.T @ np.array(moved.axis) / np.linalg.norm(moved.axis)
        point = rotation.T @ (np.array(moved.centre) - camera[:3, 3])
        return turntable(group, moved.angle_step * np.asarray(steps), axis, point)
    assert isinstance(moved, PoseList)
    poses = np.array([moved.displacement(int(step)) for step in steps])
    eye, given, holds = scene.camera.T_rig_camera.matrix, poses @ scene.rig.T_world_rig.matrix, CAMERA
    if moved.moves == "objects":
        eye, given, holds = camera, invert(poses), BOARD
    return Motion("hand_eye", group, given, np.append(rotation_vector(eye[:3, :3]), eye[:3, 3]), along, holds)


def values_of(motion: Motion) -> Float:
    """(3,) or (6,) what a motion is, as `FoundMotion.values` has it."""
    if motion.kind != "turntable":
        return motion.parameters
    axis, point = motion.axis()
    return np.append(axis, point - axis * (axis @ point))


def measured_pose(scene: Scene, found: FoundMotion | None, step: int) -> Float:
    """(4, 4) T_world_camera by which a step's points are placed on the objects as they stand in the scene at that step.

    The scene's own where no motion was found.
    """
    told = None if found is None else true_motion(scene, (0, step))
    if found is None or told is None:
        return scene.T_world_camera(step)
    moves = found.of(told)[0].moves()
    board = np.eye(4)
    board[:3, :3], board[:3, 3] = moves.rotation[1], moves.shift[1]
    carried = np.eye(4)
    if scene.motion.kind != "none" and scene.motion.moves == "objects":
        carried = scene.motion.displacement(step) @ invert(scene.motion.displacement(0))
    return np.asarray(carried @ scene.T_world_camera(0) @ invert(board))


def motion_error(scene: Scene, found: FoundMotion | None, step: int, points: Float) -> Float | None:
    """(m, 3) m in the camera's frame at a step -> (m, 3, k) how k independent errors of the motion, all of variance 1,
    move them; None: it is taken as exact. That they go with errors of the camera is left out."""
    told = None if found is None else true_motion(scene, (0, step))
    if found is None or told is None or not found.covariance:
        return None
    motion, covariance = found.of(told)
    moves = motion.moves()
    first = (points - moves.shift[1]) @ moves.rotation[1]
    by_parameters = np.einsum("pij,mj->mip", moves.derivative[1], np.column_stack([first, np.ones(len(first))]))
    spread = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    divisor = np.where(spread > 0.0, spread, 1.0)
    variance, mode = np.linalg.eigh(covariance / np.outer(divisor, divisor))
    return np.asarray(-(by_parameters * spread) @ (mode * np.sqrt(np.maximum(variance, 0.0))))


def _matrix(rows: Covariance, size: int) -> Float:
    return np.array(rows) if rows else np.zeros((size, size))
