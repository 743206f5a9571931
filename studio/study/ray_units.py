"""How many rays this machine traces in a second, so that times of two machines compare."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from render.mesh.primitives import sphere
from render.scene.shape import Sphere
from render.world.embree import RayScene

RAYS, RUNS = 1 << 16, 7
SEED = 20_261_122
RAY_SPEED = "rays_per_second"
"""Beside the seconds of a row: of the process that measured it."""
MILLION = 1e6


@dataclass(frozen=True)
class Throughput:
    """What rays alone cost on the machine that measured; the median of several."""

    rays_per_second: float
    frame_seconds: float
    """Of one ray a pixel: no frame whose truth is known takes less."""


def throughput(speeds: Sequence[float], pixels: float) -> Throughput | None:
    """speeds: of each row; pixels: of the smallest image. None: no row tells."""
    known = [speed for speed in speeds if math.isfinite(speed) and speed > 0.0]
    if not known:
        return None
    speed = float(np.median(known))
    return Throughput(speed, pixels / speed)


@lru_cache(maxsize=1)
def rays_per_second() -> float:
    """First hits of rays in all directions on a ball of 65,000 triangles, one thread, per second of processor time.

    Median of several runs, measured once a process. The rays are the same on every machine.
    """
    ball = sphere(Sphere(radius=1.0, segments=256))
    scene = RayScene(ball.vertices, ball.triangles)
    generator = np.random.Generator(np.random.Philox(SEED))
    origins = generator.uniform(-2.0, 2.0, (RAYS, 3)).astype(np.float32)
    directions = generator.normal(size=(RAYS, 3)).astype(np.float32)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    seconds = []
    for _ in range(RUNS):
        before = time.process_time()
        scene.intersect(origins, directions)
        seconds.append(time.process_time() - before)
    return RAYS / float(np.median(seconds))
