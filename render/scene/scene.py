"""The scene: a rig (camera and lasers, rigid together), objects, ambient light and motion. Frozen and validated."""

from __future__ import annotations

import math
from functools import cached_property
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from render.base.model import Model, quantity
from render.base.pose import Pose, invert
from render.camera.camera import Camera
from render.laser.laser import LineLaser, laser_plane
from render.material.material import Lambertian, Material
from render.scene.lights import Environment, Light
from render.scene.motion import Motion, NoMotion
from render.scene.shape import Shape
from render.scene.wear import Wear

Array = NDArray[np.float64]


class Rig(Model):
    """Camera and lasers, mounted rigidly; the rig moves as one."""

    T_world_rig: Pose = Pose()
    camera: Camera
    lasers: tuple[LineLaser, ...] = quantity((), label="Lasers", max_length=64)


class SceneObject(Model):
    """One thing in the scene."""

    name: str = quantity(label="Name", min_length=1, max_length=100)
    shape: Shape
    material: Material = Lambertian()
    T_world_object: Pose = Pose()
    scale: float = quantity(1.0, label="Scale", help="Multiplies the shape's size.", ge=1e-9, le=1e6)
    crease_angle: float = quantity(
        0.0,
        unit="rad",
        label="Smooth shading up to",
        help="Facets that meet at less are shaded as one curved surface, by the file's normals if it has any; "
        "0: as they are. The truth stays that of the facets.",
        ge=0,
        le=math.pi,
    )
    wear: Wear | None = quantity(None, label="Wear", help="Dents and scratches.")
    visible: bool = quantity(True, label="Visible", help="Hidden objects are neither drawn nor measured.")


class Scene(Model):
    """Everything that light meets, at step 0 of its motion."""

    rig: Rig
    objects: Annotated[tuple[SceneObject, ...], Field(max_length=10_000)] = ()
    lights: Annotated[tuple[Light, ...], Field(max_length=1000)] = ()
    environment: Environment = Environment()
    motion: Motion = NoMotion()

    @model_validator(mode="after")
    def _names_are_unique(self) -> Scene:
        for what, named in (("lasers", self.rig.lasers), ("objects", self.objects), ("lights", self.lights)):
            seen: set[str] = set()
            for item in named:
                if item.name in seen:
                    raise ValueError(f"{what}: the name {item.name!r} is used twice; allowed: one each")
                seen.add(item.name)
        return self

    @property
    def camera(self) -> Camera:
        return self.rig.camera

    @property
    def lasers(self) -> tuple[LineLaser, ...]:
        return self.rig.lasers

    @property
    def frame_count(self) -> int:
        return self.motion.frame_count

    @cached_property
    def visible_objects(self) -> tuple[SceneObject, ...]:
        return tuple(item for item in self.objects if item.visible)

    def T_world_rig(self, step: int = 0) -> Array:
        """(4, 4) pose of the rig at a step."""
        if not isinstance(self.motion, NoMotion) and self.motion.moves == "rig":
            return np.asarray(self.motion.displacement(step) @ self.rig.T_world_rig.matrix)
        return self.rig.T_world_rig.matrix

    def T_world_camera(self, step: int = 0) -> Array:
        """(4, 4) pose of the camera at a step."""
        return np.asarray(self.T_world_rig(step) @ self.camera.T_rig_camera.matrix)

    def T_world_laser(self, laser: int, step: int = 0) -> Array:
        """(4, 4) pose of a laser at a step."""
        return np.asarray(self.T_world_rig(step) @ self.lasers[laser].T_rig_laser.matrix)

    def T_camera_laser(self, laser: int) -> Array:
        """(4, 4) pose of a laser in the camera frame; the same at every step."""
        return np.asarray(invert(self.camera.T_rig_camera.matrix) @ self.lasers[laser].T_rig_laser.matrix)

    def T_world_object(self, item: SceneObject, step: int = 0) -> Array:
        """(4, 4) pose of an object at a step."""
        if not isinstance(self.motion, NoMotion) and self.motion.moves == "objects":
            return np.asarray(self.motion.displacement(step) @ item.T_world_object.matrix)
        return item.T_world_object.matrix

    def laser_plane(self, laser: int) -> Array:
        """(4,) plane (a, b, c, d) of a laser in the camera frame, d <= 0."""
        return laser_plane(self.T_camera_laser(laser))

    def scaled(self, image_scale: float) -> Scene:
        """The same scene seen with `image_scale` times the pixels a side."""
        if image_scale == 1.0:
            return self
        camera = self.camera.scaled(image_scale)
        return self.model_copy(update={"rig": self.rig.model_copy(update={"camera": camera})})
