"""Where the edges of mirrors and clear glass are in the image: a part too thin for a few rays is found by them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from render.base.pose import invert, transform_points
from render.camera.camera import Camera
from render.world.world import World

Float = NDArray[np.float64]
Bool = NDArray[np.bool_]

MOST_POINTS = 1 << 12
"""On one edge."""
SHORT = 8
"""Cells."""
BEFORE = 1e-3
"""Of its distance, how much nearer the camera something must be to hide an edge."""


def find_edges(world: World, objects: Bool, camera: Camera, T_world_camera: Float, size: int, found: Bool) -> None:
    """Set found (h, w), cells of size x size pixels, where the camera sees an edge of some objects' (o,) triangles."""
    triangles = world.triangles[objects[world.object_id]]
    used = np.zeros(len(world.vertices), np.bool_)
    used[triangles] = True
    points = transform_points(invert(T_world_camera), world.vertices[used])
    corners = (np.cumsum(used) - 1)[triangles]
    pixels, valid = camera.project(points)
    inside = valid & np.all((pixels >= -0.5) & (pixels < (camera.width - 0.5, camera.height - 0.5)), axis=1)
    known = np.zeros(len(points), np.bool_)
    column, row = np.floor((pixels[inside].T + 0.5) / size).astype(np.int64)
    known[inside] = found[row, column]
    lines = [points[~known]]
    for a, b in ((0, 1), (1, 2), (2, 0)):
        start, stop = corners[:, a], corners[:, b]
        # of short edges the ends say enough; of one that passes the camera nothing is known
        steps = np.abs(pixels[start] - pixels[stop]).max(axis=1, initial=0.0) / size
        steps = np.where(valid[start] & valid[stop], np.minimum(steps, MOST_POINTS), MOST_POINTS).astype(np.int64)
        # a short one between two places that are found has nothing to add
        long = np.flatnonzero(np.where(known[start] & known[stop], steps > SHORT, steps > 0))
        steps = steps[long] + 1
        place = np.arange(int(steps.sum())) - np.repeat(np.cumsum(steps) - steps, steps)
        share = ((place + 0.5) / np.repeat(steps, steps))[:, None]
        start, stop = (np.repeat(points[ends[long]], steps, axis=0) for ends in (start, stop))
        lines.append((1.0 - share) * start + share * stop)
    points = np.concatenate(lines)
    pixels, valid = camera.project(points)
    valid &= np.all((pixels >= -0.5) & (pixels < (camera.width - 0.5, camera.height - 0.5)), axis=1)
    points = points[valid]
    column, row = np.floor((pixels[valid].T + 0.5) / size).astype(np.int64)
    new = ~found[row, column]
    points, row, column = points[new], row[new], column[new]
    distance = np.linalg.norm(points, axis=1)
    directions = ((points / distance[:, None]) @ T_world_camera[:3, :3].T).astype(np.float32)
    origins = np.repeat((T_world_camera[:3, 3] - world.rays.centre)[None].astype(np.float32), len(points), axis=0)
    hidden = world.rays.occluded(origins, directions, ((1.0 - BEFORE) * distance).astype(np.float32))
    found[row[~hidden], column[~hidden]] = True
