"""Where new things go: in front of the camera, in the middle of what camera and lasers see, in a size that suits."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from render.base.model import Vector3
from render.base.pose import Pose, invert
from render.laser.laser import LineLaser
from render.scene.scene import Scene
from render.scene.shape import Box, Cylinder, Parametric, Plane, Sphere, StepBlock, VGroove, WeldTee

Array = NDArray[np.float64]

USUAL_DISTANCE = 0.5
NEAR, FAR = 0.02, 50.0
STAGE_STEP = 0.001
"""m between two frames of a new stage."""
FREE = 0.02
"""m; lasers nearer to each other than this stand in each other's way."""


def working_distance(scene: Scene) -> float:
    """Depth (m) at which the first laser's sheet meets the camera's axis; else the focus, the objects, or 0.5 m."""
    for i in range(len(scene.lasers)):
        _, _, c, d = scene.laser_plane(i)
        if abs(c) > 1e-9 and NEAR < -d / c < FAR:
            return float(-d / c)
    focus = scene.camera.lens.focus_distance
    if focus is not None and NEAR < focus < FAR:
        return focus
    ahead = depths_ahead(scene)
    return float(np.median(ahead)) if ahead else USUAL_DISTANCE


def depths_ahead(scene: Scene) -> list[float]:
    """Of the objects before the camera, m."""
    to_camera = invert(scene.T_world_camera())
    depths = [float((to_camera @ scene.T_world_object(item)[:, 3])[2]) for item in scene.visible_objects]
    return [depth for depth in depths if NEAR < depth < FAR]


def target(scene: Scene) -> Array:
    """(3,) the point in the world on the camera's axis at the working distance."""
    return np.asarray((scene.T_world_camera() @ [0.0, 0.0, working_distance(scene), 1.0])[:3])


def field_of_view(scene: Scene) -> float:
    """The smaller side of what the camera sees at the working distance, m."""
    camera = scene.camera
    return working_distance(scene) * min(camera.width / camera.fx, camera.height / camera.fy)


def across_the_line(scene: Scene) -> Vector3:
    """A step (m) of a stage, along the level axis of the world that most crosses the first laser's sheet.

    A stage that runs along the line scans the same profile again and again.
    """
    if not scene.lasers:
        return STAGE_STEP, 0.0, 0.0
    x, y = np.abs(scene.T_world_laser(0)[:2, 0])
    return (STAGE_STEP, 0.0, 0.0) if x > y else (0.0, STAGE_STEP, 0.0)


def object_pose(scene: Scene, flat: bool = False) -> Pose:
    """At the target, upright in the world; a flat thing that the camera would see edge-on is turned to face it."""
    rotation: Vector3 = (0.0, 0.0, 0.0)
    towards_camera = -scene.T_world_camera()[:3, 2]
    if flat and towards_camera[2] < 0.5:
        centre = target(scene)
        rotation = Pose.looking_at(vector(centre), vector(centre + towards_camera)).rotation
    return Pose(translation=vector(target(scene)), rotation=rotation)


def sized(kind: type[Parametric], side: float) -> Parametric:
    """A primitive about `side` (m) across, with round measures."""
    s = rounded(side)
    if kind is Plane:
        return Plane(width=2 * s, height=2 * s)
    if kind is Box:
        return Box(size_x=s, size_y=s, size_z=s / 2)
    if kind is Sphere:
        return Sphere(radius=s / 2)
    if kind is Cylinder:
        return Cylinder(radius=s / 4, length=s)
    if kind is StepBlock:
        return StepBlock(steps=4, tread=s / 4, rise=s / 10, width=s)
    if kind is VGroove:
        return VGroove(depth=s / 5, width=s, length=s, thickness=s / 3)
    return WeldTee(
        length=2 * s,
        base_width=2 * s,
        upright_height=s,
        thickness=s / 12,
        leg=s / 12,
        convexity=s / 100,
        ripple_pitch=s / 50,
        ripple_height=s / 500,
        ground_band=s / 4,
    )


def new_laser(scene: Scene, name: str) -> LineLaser:
    """A laser beside the camera whose sheet crosses the camera's axis at the working distance.

    Its baseline is the first laser's, or 0.4 of the distance; on the first free side: right, left, below, above.
    """
    distance = working_distance(scene)
    T = scene.camera.T_rig_camera.matrix
    offsets = [laser.T_rig_laser.matrix[:3, 3] - T[:3, 3] for laser in scene.lasers]
    baseline = float(np.linalg.norm(offsets[0])) if offsets else 0.0
    baseline = baseline if baseline > FREE else rounded(0.4 * distance)
    x, y, z = T[:3, 0], T[:3, 1], T[:3, 2]
    sides = ((x, y), (-x, y), (y, -x), (-y, -x))
    aim = T[:3, 3] + distance * z
    for stretch in (1.0, 1.5, 2.0, 3.0):
        for side, along in sides:
            offset = stretch * baseline * side
            if all(np.linalg.norm(offset - other) > FREE for other in offsets):
                # the fan opens along the laser's y, which is the axis across the baseline
                pose = Pose.looking_at(vector(T[:3, 3] + offset), vector(aim), vector(along))
                return LineLaser(name=name, T_rig_laser=pose)
    return LineLaser(name=name, T_rig_laser=scene.lasers[-1].T_rig_laser)


def light_pose(scene: Scene) -> tuple[Pose, float]:
    """Beside and above the camera, facing the target along z; and its distance from the target, m."""
    distance = working_distance(scene)
    T = scene.T_world_camera()
    place = T[:3, 3] - 0.6 * distance * T[:3, 0] - 0.6 * distance * T[:3, 1]
    centre = target(scene)
    return Pose.looking_at(vector(place), vector(centre)), float(np.linalg.norm(place - centre))


def rounded(length: float) -> float:
    """The nearest of 1, 2, 5 times a power of ten below or at a length."""
    power = 10.0 ** math.floor(math.log10(length))
    return float(next(step for step in (5.0, 2.0, 1.0) if step * power <= length * (1 + 1e-9)) * power)


def vector(values: Array) -> Vector3:
    """(3,) array -> the tuple that models hold, free of digits that mean nothing."""
    x, y, z = (round(float(value), 9) + 0.0 for value in values)
    return x, y, z
