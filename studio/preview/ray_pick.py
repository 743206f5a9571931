"""What a ray through a point of the 3D view meets: a mesh, its corner that is near on the screen, or the ground."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from render.base.arrays import Float
from render.base.pose import transform_points
from studio.preview.preview import Look, Placed
from studio.preview.view_camera import Eye

NEAR_PX = 14.0
"""How near the mouse must be to a corner on the screen."""


@dataclass(frozen=True)
class MeshHit:
    """Where a ray meets a mesh first."""

    placed: Placed
    triangle: int
    distance: float
    """m along the ray."""


@dataclass(frozen=True)
class Spot:
    """A place that something can be put at."""

    point: Float
    """(3,) m, world."""
    kind: Literal["corner", "surface", "ground"]


def mesh_hit(
    look: Look, origin: Float, direction: Float, wanted: Callable[[int], bool] = lambda index: True
) -> MeshHit | None:
    """The nearest mesh on a ray (3,), (3,) of the world, of those objects whose index is wanted."""
    found: MeshHit | None = None
    for item in look.placed:
        if not wanted(item.index):
            continue
        start = transform_points(item.T_object_world, origin) - item.body.rays.centre
        local = item.T_object_world[:3, :3] @ direction
        hit, far = item.body.rays.intersect(start[None].astype(np.float32), local[None].astype(np.float32))
        if hit[0] >= 0 and (found is None or far[0] < found.distance):
            found = MeshHit(item, int(hit[0]), float(far[0]))
    return found


def spot_at(
    look: Look,
    eye: Eye,
    at: tuple[float, float],
    size: tuple[int, int],
    wanted: Callable[[int], bool] = lambda index: True,
    ground: float | None = None,
) -> Spot | None:
    """Under a point of a view of `size` pixels: a corner of the mesh's facet, its face, or the ground at a height, m.

    None: there is nothing.
    """
    origin, direction = eye.ray(*at, size)
    hit = mesh_hit(look, origin, direction, wanted)
    if hit is not None:
        surface = hit.placed.body.surface
        corners = transform_points(hit.placed.T_world_object, surface.vertices[surface.triangles[hit.triangle]])
        apart = np.linalg.norm(eye.project(corners, size) - at, axis=1)
        if np.nanmin(apart, initial=math.inf) <= NEAR_PX:
            return Spot(corners[int(np.nanargmin(apart))], "corner")
        return Spot(origin + hit.distance * direction, "surface")
    if ground is None or direction[2] == 0.0:
        return None
    distance = (ground - origin[2]) / direction[2]
    return Spot(origin + distance * direction, "ground") if distance > 0.0 else None
