"""Visibility: whether the segment from a point on a surface to a target is unoccluded."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from render.base.arrays import Float
from render.base.threads import map_chunks
from render.world.embree import CHUNK, RayScene


def visible(
    rays: RayScene, points: Float, normals: Float, towards: Float, threads: int | None = None
) -> NDArray[np.bool_]:
    """(n, 3) world points on surfaces, unit normals and vectors to a target on their side -> (n,) not occluded."""
    if len(points) == 0:
        return np.zeros(0, dtype=np.bool_)
    origins = (points - rays.centre + normals * rays.surface_offset).astype(np.float32)
    distance = np.linalg.norm(towards, axis=1)
    directions = (towards / distance[:, None]).astype(np.float32)
    far = distance.astype(np.float32)
    unoccluded = np.empty(len(points), dtype=np.bool_)

    def work(start: int, stop: int) -> None:
        unoccluded[start:stop] = ~rays.occluded(
            origins[start:stop], directions[start:stop], far[start:stop], coherent=True
        )

    map_chunks(work, len(points), CHUNK // 4, threads)
    return unoccluded
