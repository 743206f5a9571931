"""The coarse ambient image of a block's first frame, where another frame of the block sees much the same.

It is taken over pixel by pixel, and what that makes of it is measured in the frame itself, as `coarse_image.py` does:
some pixels, drawn by chance, are sampled in two halves a and b, which know nothing of each other or of the image I, and

    E[(I - a)(I - b)] = (I - L)^2,     E[a b] = L^2
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from render.ambient.coarse_image import COARSE_ERROR, HELD_OUT_SAMPLES, HELD_OUT_SHARE, CoarseImage
from render.ambient.path_state import CLAMPED, INVALID
from render.ambient.path_tracer import CameraPaths
from render.ambient.pixel_samples import PixelSamples
from render.base.arrays import Float32, Int
from render.run import Run
from render.world.placed import PlacedScene
from render.world.world import World

CHECKED = 2048
"""Most pixels on which the image is checked."""
CHECK_SEED = 49_979_687


@dataclass(frozen=True)
class CoarseLesson:
    """The coarse image of a frame, and all that it depends on."""

    coarse: CoarseImage
    world: World
    seen_from: tuple[object, ...]


def taken_over(lesson: CoarseLesson, placed: PlacedScene, paths: CameraPaths, run: Run) -> CoarseImage | None:
    """The image as this frame has it, with paths of random numbers of their own; None: it is too far off. Raises
    Cancelled."""
    coarse, camera = lesson.coarse, placed.camera
    if coarse.radiance.shape[:2] != (camera.height, camera.width):
        return None
    pixels = _drawn(coarse.radiance.shape[0] * coarse.radiance.shape[1], run)
    film = PixelSamples(pixels)
    film.add(paths, pixels, np.full((len(pixels), 2), HELD_OUT_SAMPLES, np.int32), run)
    halves, image = film.means().astype(np.float64), coarse.radiance.reshape(-1, 3)[pixels].astype(np.float64)
    power = float(np.sum(halves[:, 0] * halves[:, 1]))
    square = float(np.sum((image - halves[:, 0]) * (image - halves[:, 1])))
    if power <= 0.0 or square > COARSE_ERROR**2 * power:
        return None
    error = math.sqrt(max(square, 0.0) / power)
    # where it is worse than where it comes from is not known, so that it may be so everywhere
    more = max(error**2 - coarse.error**2, 0.0) * power / (3.0 * len(pixels))
    deviation: Float32 = np.sqrt(coarse.deviation**2 + np.float32(more))
    dropped, clamped = (int(film.invalid_counts[kind]) for kind in (INVALID, CLAMPED))
    return replace(
        coarse,
        error=error,
        deviation=deviation,
        samples=film.total,
        dropped=dropped,
        clamped=clamped,
        cut=film.cut / film.total,
        taken_over=True,
    )


def _drawn(pixels: int, run: Run) -> Int:
    """Some pixels, one by chance of each of equal parts of the image."""
    count = min(CHECKED, -(-pixels // HELD_OUT_SHARE))
    random = np.random.default_rng(run.shifted(CHECK_SEED).seed)
    edges = np.linspace(0, pixels, count + 1).astype(np.int64)
    return random.integers(edges[:-1], edges[1:]).astype(np.int32)
