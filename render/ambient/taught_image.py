"""The coarse ambient image of a block's first frame, where another frame of the block sees much the same.

It is taken over as it is, or by the place of what is seen, and what that makes of it is measured in the frame itself,
as `coarse_image.py` does: some pixels, drawn by chance, are sampled in two halves a and b, which know nothing of each
other or of the image I, and

    E[(I - a)(I - b)] = (I - L)^2,     E[a b] = L^2
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial

import numpy as np

from render.ambient.coarse_image import (
    COARSE_ERROR,
    HELD_OUT_SAMPLES,
    HELD_OUT_SHARE,
    CoarseImage,
    own_places,
    radiance_at,
)
from render.ambient.guided_image import Places, guided_image, places_of
from render.ambient.mended_image import mended_grid
from render.ambient.path_state import CLAMPED, INVALID
from render.ambient.path_tracer import CameraPaths
from render.ambient.pixel_samples import PixelSamples
from render.base.arrays import Bool, Float, Float32, Int
from render.base.pose import invert
from render.run import Run
from render.world.placed import PlacedScene

CHECKED = 2048
"""Most pixels on which the image is checked."""
CHECK_SEED = 49_979_687


@dataclass(frozen=True)
class CoarseLesson:
    """The coarse image of a frame, and all that it depends on."""

    coarse: CoarseImage
    placed: PlacedScene
    seen_from: tuple[object, ...]


def taken_over(lesson: CoarseLesson, placed: PlacedScene, paths: CameraPaths, run: Run) -> CoarseImage | None:
    """The image as this frame has it, with paths of random numbers of their own; None: it is too far off. Raises
    Cancelled.

    Pixel by pixel; where that is too far off place by place: the light of the grid's points where their image shows
    what this one sees; and where that is as well, with samples of what it does not show.
    """
    coarse, camera = lesson.coarse, placed.camera
    if lesson.placed.camera != camera:
        return None
    pixels = _drawn(camera.height * camera.width, run)
    film = PixelSamples(pixels)
    film.add(paths, pixels, np.full((len(pixels), 2), HELD_OUT_SAMPLES, np.int32), run)
    halves = film.means().astype(np.float64)
    radiance, square = coarse.radiance, _square(coarse.radiance.reshape(-1, 3)[pixels], halves)
    if square > COARSE_ERROR**2 and coarse.grid is not None and lesson.placed.world is placed.world:
        shown = partial(_shown_before, lesson.placed, placed.world.rays.centre)

        def where_it_was(pixels: Int, seen: Float32, item: Int) -> Float:
            return shown(pixels, seen, item)[0]

        places: Places = where_it_was
        found = radiance_at(coarse.grid, paths, pixels, places)
        grid, square = coarse.grid, _square(found, halves)
        if square > COARSE_ERROR**2:
            mended = mended_grid(coarse.grid, paths, camera.height, shown, film, run)
            if mended is None:
                return None
            (grid, new), places = mended, own_places(paths)
            # what the image was made of does not tell how far it is off
            apart = ~np.isin(pixels, new)
            square = _square(radiance_at(grid, paths, pixels[apart], places), halves[apart])
        if square <= COARSE_ERROR**2:
            radiance = guided_image(grid, paths, camera.height, places, run)
    if square > COARSE_ERROR**2:
        return None
    # where it is worse than where it comes from is not known, so that it may be so everywhere
    power = float(np.mean(halves[:, 0] * halves[:, 1]))
    deviation: Float32 = np.sqrt(coarse.deviation**2 + np.float32(max(square - coarse.error**2, 0.0) * power))
    dropped, clamped = (int(film.invalid_counts[kind]) for kind in (INVALID, CLAMPED))
    return CoarseImage(
        radiance,
        math.sqrt(square),
        deviation,
        coarse.block,
        film.total,
        dropped,
        clamped,
        film.cut / film.total,
        taken_over=True,
    )


def _square(image: Float32, halves: Float) -> float:
    """Squared relative error of an image (n, 3) by the halves (n, 2, 3) of samples; infinite where all is dark."""
    power = float(np.sum(halves[:, 0] * halves[:, 1]))
    off = float(np.sum((image - halves[:, 0]) * (image - halves[:, 1])))
    return max(off, 0.0) / power if power > 0.0 else math.inf


def _shown_before(before: PlacedScene, centre: Float, pixels: Int, seen: Float32, item: Int) -> tuple[Float, Bool]:
    """(n, 2) rows and columns at which another frame's camera has what is seen at some pixels, and whether they are in
    its image; what is infinitely far, or what it has no image of, is where it was."""
    to_camera = invert(before.T_world_camera)
    points = seen[:, 6:9].astype(np.float64) @ to_camera[:3, :3].T + (to_camera[:3, :3] @ centre + to_camera[:3, 3])
    place, there = before.camera.project(points)
    near = item >= 0
    place = np.where((there & near)[:, None], place[:, ::-1], places_of(pixels, before.camera.width))
    inside = np.all((place >= -0.5) & (place <= np.array([before.camera.height, before.camera.width]) - 0.5), axis=1)
    return place, inside & (there | ~near)


def _drawn(pixels: int, run: Run) -> Int:
    """Some pixels, one by chance of each of equal parts of the image."""
    count = min(CHECKED, -(-pixels // HELD_OUT_SHARE))
    random = np.random.default_rng(run.shifted(CHECK_SEED).seed)
    edges = np.linspace(0, pixels, count + 1).astype(np.int64)
    return random.integers(edges[:-1], edges[1:]).astype(np.int32)
