"""How far facets are from the round body that they stand for: what no shading shows, and every depth has."""

from __future__ import annotations

import numpy as np

from render.base.arrays import Float
from render.base.pose import transform_points
from render.frame import LaserCurve
from render.scene.scene import Scene
from render.scene.shape import Cylinder, Sphere


def facet_error(scene: Scene, curve: LaserCurve) -> float:
    """RMS over the exact line of the distance to its spheres and cylinders, m; NaN: it crosses none of them.

    Along the body's normal: a sphere of n segments around has facets of at most R (1 - cos(pi / n)) and their like
    along the other direction below it.
    """
    world = transform_points(scene.T_world_camera(0), curve.point)
    off: list[Float] = []
    for number, item in enumerate(scene.visible_objects):
        if not isinstance(item.shape, Sphere | Cylinder):
            continue
        pose = np.asarray(np.linalg.inv(scene.T_world_object(item, 0)), dtype=np.float64)
        own = transform_points(pose, world[curve.object_id == number])
        radius = item.shape.radius * item.scale
        if isinstance(item.shape, Sphere):
            off.append(np.linalg.norm(own, axis=1) - radius)
        else:
            side = np.abs(own[:, 2]) < 0.5 * item.shape.length * item.scale * (1.0 - 1e-9)
            off.append(np.hypot(own[side, 0], own[side, 1]) - radius)
    found = np.concatenate(off) if off else np.empty(0)
    return float(np.sqrt(np.mean(found**2))) if len(found) else float("nan")
