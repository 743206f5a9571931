"""Motion over a scan: one frame a step, of the rig or of the objects."""

from __future__ import annotations

import math
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from render.base.model import Model, Position, quantity
from render.base.pose import Pose, rotation_matrix

Array = NDArray[np.float64]
Moves = Literal["rig", "objects"]
MAX_STEPS = 100_000
Direction = Annotated[float, Field(ge=-1e6, le=1e6)]


class NoMotion(Model):
    """A single frame."""

    kind: Literal["none"] = "none"

    @property
    def frame_count(self) -> int:
        return 1

    def displacement(self, step: int) -> Array:
        return np.eye(4)


class LinearStage(Model):
    """Step i moves by i times `step`, in world axes."""

    kind: Literal["linear"] = "linear"
    moves: Moves = quantity("rig", label="What moves")
    step: Position = quantity(
        (0.0, 0.001, 0.0), unit="m", label="Step", help="Displacement between frames, world axes."
    )
    steps: int = quantity(10, label="Frames", gt=0, le=MAX_STEPS)

    @property
    def frame_count(self) -> int:
        return self.steps

    def displacement(self, step: int) -> Array:
        """(4, 4) world-frame motion of frame `step`."""
        matrix = np.eye(4)
        matrix[:3, 3] = step * np.asarray(self.step)
        return matrix


class Turntable(Model):
    """Step i turns by i times `angle_step` about an axis in the world."""

    kind: Literal["turntable"] = "turntable"
    moves: Moves = quantity("objects", label="What moves")
    centre: Position = quantity((0.0, 0.0, 0.0), unit="m", label="Axis point", help="Any place on the axis.")
    axis: tuple[Direction, Direction, Direction] = quantity((0.0, 0.0, 1.0), label="Axis direction")
    angle_step: float = quantity(math.radians(1), unit="rad", label="Step", ge=-math.pi, le=math.pi)
    steps: int = quantity(360, label="Frames", gt=0, le=MAX_STEPS)

    @model_validator(mode="after")
    def _axis_has_length(self) -> Turntable:
        if not np.linalg.norm(self.axis) > 1e-9:
            raise ValueError(f"axis {self.axis} has no direction; allowed: any vector but zero")
        return self

    @property
    def frame_count(self) -> int:
        return self.steps

    def displacement(self, step: int) -> Array:
        """(4, 4) world-frame motion of frame `step`."""
        axis = np.asarray(self.axis) / np.linalg.norm(self.axis)
        matrix = np.eye(4)
        matrix[:3, :3] = rotation_matrix(axis * (self.angle_step * step))
        centre = np.asarray(self.centre)
        matrix[:3, 3] = centre - matrix[:3, :3] @ centre
        return matrix


class PoseList(Model):
    """Step i applies the i-th given motion, in world axes, to the initial pose."""

    kind: Literal["poses"] = "poses"
    moves: Moves = quantity("rig", label="What moves")
    poses: tuple[Pose, ...] = quantity(
        label="Poses", help="World-frame motions, one a frame.", min_length=1, max_length=MAX_STEPS
    )

    @property
    def frame_count(self) -> int:
        return len(self.poses)

    def displacement(self, step: int) -> Array:
        """(4, 4) world-frame motion of frame `step`."""
        return self.poses[step].matrix


Motion = Annotated[NoMotion | LinearStage | Turntable | PoseList, Field(discriminator="kind")]
