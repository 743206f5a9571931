"""Checks of a scene's geometry: placements that cannot be rendered or triangulated, one message each."""

from __future__ import annotations

import numpy as np

from render.base.errors import InputError
from render.base.pose import invert, transform_points
from render.camera.focus import check_lens
from render.material.material import Glass
from render.scene.scene import Scene
from render.world.enclosure import objects_around
from render.world.world import World

CENTRE_TOLERANCE = 1e-6
"""Least distance, m, of a laser's plane from the camera's centre at which it can be triangulated."""


def check_placement(world: World, scene: Scene, step: int = 0) -> None:
    """Raise InputError: nothing to see, a camera inside a solid, a sheet through the camera's centre."""
    if len(world.triangles) == 0:
        raise InputError(
            "the scene has no visible object",
            where="scene.objects",
            found=f"{len(scene.objects)} hidden" if scene.objects else "none",
            allowed="at least one visible object",
            cure="add an object, or make one visible",
        )
    for i, laser in enumerate(scene.lasers):
        distance = abs(float(scene.laser_plane(i)[3]))
        if distance < CENTRE_TOLERANCE:
            raise InputError(
                "the laser's plane passes through the camera's centre, so no depth can be triangulated",
                where=f"scene.rig.lasers[{i}] ({laser.name})",
                found=f"a distance of {distance * 1e6:.3g} um",
                allowed=f"more than {CENTRE_TOLERANCE * 1e6:g} um",
                cure="move the laser sideways (a baseline) or turn its sheet away from the camera",
            )
    check_lens(scene.camera)
    # a camera may look through the water that it is in
    solid = [item for item, one in enumerate(scene.visible_objects) if not isinstance(one.material, Glass)]
    around = objects_around(world, solid, scene.T_world_camera(step)[:3, 3])
    if around:
        raise InputError(
            "the camera is inside an object",
            where="scene.rig.camera",
            found=f"its centre lies within {scene.visible_objects[around[0]].name!r}",
            allowed="a camera outside every solid that is not of glass",
            cure="move the rig or the object, or check the object's unit and scale",
        )
    if not _in_view(world, scene, step):
        raise InputError(
            "nothing is visible: no object lies in the camera's field of view",
            where="scene.rig.camera",
            found=_where_things_are(world, scene, step),
            allowed="at least one triangle ahead of the camera and within its image",
            cure="turn the camera (z looks forward, y down) or move the objects",
        )


def _in_view(world: World, scene: Scene, step: int) -> bool:
    """Conservative: false only when every triangle is behind the camera or beyond one edge of the undistorted image."""
    camera = scene.camera
    points = transform_points(invert(scene.T_world_camera(step)), world.vertices)
    edge = np.array(
        [
            [-0.5, -0.5],
            [camera.width - 0.5, -0.5],
            [-0.5, camera.height - 0.5],
            [camera.width - 0.5, camera.height - 0.5],
        ]
    )
    middle = np.array([[(camera.width - 1) / 2, -0.5], [(camera.width - 1) / 2, camera.height - 0.5]])
    sides = np.array([[-0.5, (camera.height - 1) / 2], [camera.width - 0.5, (camera.height - 1) / 2]])
    border, ok = camera.normalise(np.concatenate([edge, middle, sides]))
    if not np.all(ok):
        return bool(np.any(points[:, 2] > 0.0))
    low, high = border.min(axis=0), border.max(axis=0)
    x, y, z = points[:, 0], points[:, 1], points[:, 2]
    outside = np.stack([z <= 0.0, x < low[0] * z, x > high[0] * z, y < low[1] * z, y > high[1] * z])
    if not np.all(np.any(outside, axis=0)):
        return True
    return bool(np.any(~np.any(np.all(outside[:, world.triangles], axis=2), axis=0)))


def _where_things_are(world: World, scene: Scene, step: int) -> str:
    points = transform_points(invert(scene.T_world_camera(step)), world.vertices)
    low, high = points.min(axis=0), points.max(axis=0)
    ranges = ", ".join(f"{axis} {a:.3g}..{b:.3g} m" for axis, a, b in zip("xyz", low, high, strict=True))
    return f"all objects within {ranges} of the camera frame"
