"""Where the edges of mirrors and clear glass are in the image: a part too thin for a few rays is found by them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from render.base.arrays import Bool, Float
from render.base.pose import invert, transform_points
from render.camera.camera import Camera
from render.world.world import World

MOST_POINTS = 1 << 12
"""On one edge."""
SHORT = 8
"""Cells."""
BATCH = 1 << 20
"""Points at a time, so that their number costs no memory; a cell that one of them finds needs none of the next."""
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
    inside, cells = _cells(camera, pixels, valid, size)
    known = np.zeros(len(points), np.bool_)
    known[inside] = found[cells]
    for first in range(0, len(points), BATCH):
        batch = slice(first, first + BATCH)
        _find_points(world, camera, T_world_camera, points[batch][~known[batch]], size, found)
    for a, b in ((0, 1), (1, 2), (2, 0)):
        start, stop = corners[:, a], corners[:, b]
        # of short edges the ends say enough; of one that passes the camera nothing is known
        steps = np.abs(pixels[start] - pixels[stop]).max(axis=1, initial=0.0) / size
        steps = np.where(valid[start] & valid[stop], np.minimum(steps, MOST_POINTS), MOST_POINTS).astype(np.int64)
        # a short one between two places that are found has nothing to add
        long = np.flatnonzero(np.where(known[start] & known[stop], steps > SHORT, steps > 0))
        steps = steps[long] + 1
        batches = np.searchsorted(np.cumsum(steps), np.arange(BATCH, int(steps.sum()), BATCH))
        for some, count in zip(np.split(long, batches), np.split(steps, batches), strict=True):
            along = _points_along(points[start[some]], points[stop[some]], count)
            _find_points(world, camera, T_world_camera, along, size, found)


def _points_along(start: Float, stop: Float, count: NDArray[np.int64]) -> Float:
    """(sum of count, 3) points, evenly along each line from start (n, 3) to stop (n, 3)."""
    place = np.arange(int(count.sum())) - np.repeat(np.cumsum(count) - count, count)
    share = ((place + 0.5) / np.repeat(count, count))[:, None]
    return np.asarray((1.0 - share) * np.repeat(start, count, axis=0) + share * np.repeat(stop, count, axis=0))


def _find_points(world: World, camera: Camera, T_world_camera: Float, points: Float, size: int, found: Bool) -> None:
    """Set the cells of `found` in which the camera sees one of the points (n, 3), in its frame."""
    inside, (row, column) = _cells(camera, *camera.project(points), size)
    points = points[inside]
    new = ~found[row, column]
    points, row, column = points[new], row[new], column[new]
    distance = np.linalg.norm(points, axis=1)
    directions = ((points / distance[:, None]) @ T_world_camera[:3, :3].T).astype(np.float32)
    origins = np.repeat((T_world_camera[:3, 3] - world.rays.centre)[None].astype(np.float32), len(points), axis=0)
    hidden = world.rays.occluded(origins, directions, ((1.0 - BEFORE) * distance).astype(np.float32))
    found[row[~hidden], column[~hidden]] = True


def _cells(
    camera: Camera, pixels: Float, valid: Bool, size: int
) -> tuple[Bool, tuple[NDArray[np.int64], NDArray[np.int64]]]:
    """Which of the pixels (n, 2) are in the image, and the cell of each that is, as row and column."""
    inside = valid & np.all((pixels >= -0.5) & (pixels < (camera.width - 0.5, camera.height - 0.5)), axis=1)
    column, row = np.floor((pixels[inside].T + 0.5) / size).astype(np.int64)
    return inside, (row, column)
