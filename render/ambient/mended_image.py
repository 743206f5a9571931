"""A frame's own grid of ambient light where much of what it sees was seen by another: the light of that one there, and
samples of its own where the other shows something else, or nothing."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from render.ambient.coarse_image import FIRST_SAMPLES, seen_grid
from render.ambient.guided_image import LightGrid
from render.ambient.guided_interpolation import DARK, ON_EDGE, smooth_grid
from render.ambient.path_tracer import CameraPaths
from render.ambient.pixel_samples import PixelSamples
from render.base.arrays import Bool, Float, Float32, Int
from render.run import Run

LEAST_FIT = 0.5
"""Of a point's light from the other grid: below, what is seen there is as likely something else."""
MOST_NEW = 0.5
"""Of the grid's points: where more are new, a coarse image that knows nothing of the other costs little more."""

Shown = Callable[[Int, Float32, Int], tuple[Float, Bool]]
"""Rows and columns (n, 2) of another image at which some pixels (n,) are, where (n, SEEN) and (n,) is seen; (n,)
whether they are in it."""


def mended_grid(
    known: LightGrid, paths: CameraPaths, height: int, shown: Shown, film: PixelSamples, run: Run
) -> tuple[LightGrid, Int] | None:
    """The grid, `known.block` pixels from point to point, and (m,) the pixels that were sampled, into the film; None:
    too many would have to be. Raises Cancelled."""
    width = paths.view.width
    grid = seen_grid(paths, height, known.block, run.threads)
    place, inside = shown(grid.pixels, grid.seen, grid.item)
    radiance = np.empty((len(grid.pixels), 3), np.float32)
    taken = (known.at(place, grid.seen, grid.item, radiance) >= LEAST_FIT) & inside
    new = grid.pixels[~taken]
    if len(new) > MOST_NEW * len(grid.pixels):
        return None
    film.extend(new)
    for level in range(1, FIRST_SAMPLES + 1):
        film.add(paths, new, np.full((len(new), 2), level, np.int32), run)
    radiance[~taken] = film.means(new).mean(axis=1)
    # what was taken over is of what the point's centre shows, also where its pixel holds light of something else
    item = np.where(grid.on_edge & ~taken, np.int32(ON_EDGE), grid.item)
    light = np.empty_like(radiance)
    smooth_grid(grid.across, grid.seen, item, radiance, light)
    light[taken] = (radiance / (grid.seen[:, :3] + np.float32(DARK)))[taken]
    return LightGrid((height, width), grid.block, grid.seen, item, light), new
