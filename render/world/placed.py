"""A scene placed at one of its steps, as the light groups receive it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from render.base.arrays import Float
from render.camera.camera import Camera
from render.laser.laser import LineLaser
from render.scene.scene import Scene
from render.world.world import World


class PlacedLaser(NamedTuple):
    """One laser, the camera that sees its light, and the world in which both stand."""

    world: World
    camera: Camera
    laser: LineLaser
    T_world_camera: Float
    T_world_laser: Float


@dataclass(frozen=True)
class PlacedScene:
    """A scene, its triangles placed for `step`, and where camera and lasers are then."""

    world: World
    scene: Scene
    step: int = 0

    @property
    def camera(self) -> Camera:
        return self.scene.camera

    @property
    def T_world_camera(self) -> Float:
        return self.scene.T_world_camera(self.step)

    @property
    def lasers(self) -> tuple[PlacedLaser, ...]:
        return tuple(
            PlacedLaser(self.world, self.camera, laser, self.T_world_camera, self.scene.T_world_laser(i, self.step))
            for i, laser in enumerate(self.scene.lasers)
        )
