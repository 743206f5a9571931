"""Per-pixel truth at pixel centres: depth, position, normal and object, each hit recomputed in float64."""

from __future__ import annotations

import math
from typing import NamedTuple

import numba
import numpy as np

from render.base.arrays import Float, Float32, Int
from render.camera.camera import Camera
from render.camera.rays import camera_rays
from render.frame import Truth
from render.run import Run
from render.world.embree import CHUNK
from render.world.triangles import Surface, facet_of
from render.world.world import World


class FlatTruth(NamedTuple):
    """The images of a `Truth`, (h w, ...)."""

    depth_z: Float32
    depth_range: Float32
    position: Float32
    normal: Float32
    object_id: Int


@numba.njit(nogil=True, cache=True, error_model="numpy")
def fill_truth(
    surface: Surface, T_world_camera: Float, start: int, triangle: Int, normalised: Float, images: FlatTruth
) -> None:
    """Write the pixels from `start` on of the images from their hits: triangle (n,), -1 for none."""
    m = T_world_camera
    depth_z, depth_range, position, normal, item = images
    for r in range(triangle.shape[0]):
        i, t = start + r, triangle[r]
        x, y = normalised[r, 0], normalised[r, 1]
        if t < 0 or x != x:
            depth_z[i] = depth_range[i] = np.nan
            item[i] = -1
            for axis in range(3):
                position[i, axis] = normal[i, axis] = np.nan
            continue
        a0, a1, a2, n0, n1, n2 = facet_of(surface, t)
        height = n0 * (m[0, 3] - a0) + n1 * (m[1, 3] - a1) + n2 * (m[2, 3] - a2)
        d0 = m[0, 0] * x + m[0, 1] * y + m[0, 2]
        d1 = m[1, 0] * x + m[1, 1] * y + m[1, 2]
        d2 = m[2, 0] * x + m[2, 1] * y + m[2, 2]
        # d has length 1 along the camera's axis, so its multiple is depth_z
        s = -height / (n0 * d0 + n1 * d1 + n2 * d2)
        sign = (1.0 if height >= 0.0 else -1.0) / math.sqrt(n0 * n0 + n1 * n1 + n2 * n2)
        depth_z[i] = s
        depth_range[i] = s * math.sqrt(x * x + y * y + 1.0)
        position[i, 0], position[i, 1], position[i, 2] = m[0, 3] + s * d0, m[1, 3] + s * d1, m[2, 3] + s * d2
        normal[i, 0], normal[i, 1], normal[i, 2] = sign * n0, sign * n1, sign * n2
        item[i] = surface.object_id[t]


def truth_images(
    world: World,
    camera: Camera,
    T_world_camera: Float,
    run: Run = Run(),
) -> Truth:
    """One exact ray through each pixel's centre. Raises Cancelled."""
    n = camera.width * camera.height
    depth_z, depth_range = np.empty(n, np.float32), np.empty(n, np.float32)
    position, normal = np.empty((n, 3), np.float32), np.empty((n, 3), np.float32)
    item = np.empty(n, np.int32)
    view, surface, rays = camera.view(T_world_camera), world.surface, world.rays

    def work(start: int, stop: int) -> None:
        count = stop - start
        normalised, offsets = np.empty((count, 2)), np.empty((count, 2), np.float32)
        directions = np.empty((count, 3), np.float32)
        camera_rays(view, np.arange(start, stop, dtype=np.int32), 1, 0, False, normalised, offsets, directions)
        triangle = rays.from_point(T_world_camera[:3, 3], directions)
        images = FlatTruth(depth_z, depth_range, position, normal, item)
        fill_truth(surface, T_world_camera, start, triangle, normalised, images)

    run.map(work, n, CHUNK)
    shape = (camera.height, camera.width)
    return Truth(
        depth_z=depth_z.reshape(shape),
        depth_range=depth_range.reshape(shape),
        position=position.reshape(*shape, 3),
        normal=normal.reshape(*shape, 3),
        object_id=item.reshape(shape),
    )
