"""Light that a single pass found, and that would be a peak beside the line by itself: it is spread about its place.

Where a line is the goal, the light away from it is made of so few paths that one of them may put into its pixel as much
as the line has. Over the image that is a faint glow without bias; to the line extraction it is a bright spot that no
other render of the scene has. So a run of pixels whose light would make or hide a peak (`render.importance`) has to do
so without the brightest pass of each pixel as well. Otherwise that pass is taken out of it and smoothed, which keeps
the light in the image and leaves no peak of it. What glints in many passes stays as it is.
"""

from __future__ import annotations

from functools import partial

import numba
import numpy as np

from render.base.arrays import Bool, Float, Float32
from render.base.threads import map_chunks
from render.importance import CELL
from render.laser_indirect.connection_buffer import BLOCK, PassBuffer
from render.laser_indirect.line_goal import Projection
from render.laser_indirect.line_sums import BLOCKS_A_CHUNK, smoothed

COARSE = 8
"""Pixels a side that are summed before they are smoothed."""
SPREAD_SIGMA = 16.0
"""px over which such light is smoothed: what is left of a spot is a thousandth of its height."""


def keep_largest(buffers: list[PassBuffer], largest: Float32, weight: float, most: float) -> None:
    """Raise `largest` (pixels,) to the radiance of each pass of a wave, weighed, no pass for more than `most`."""
    images, touched = tuple(buffer.image for buffer in buffers), tuple(buffer.touched for buffer in buffers)
    map_chunks(partial(_keep_largest, images, touched, weight, most, largest), len(touched[0]), BLOCKS_A_CHUNK)


def lone_light(total: Float, largest: Float32, weight: float, projection: Projection) -> Float32:
    """(pixels,) radiance that one pass alone found and that is a peak beside the line, of sums over all passes
    (pixels,) and the brightest of them, with the weight of all."""
    out, line = np.zeros(len(total), np.float32), np.zeros(len(total), np.bool_)
    line[projection.pixel] = True
    work = partial(_find_lone, total, largest, 1.0 / weight, projection.peaks, line, out)
    map_chunks(work, len(projection.peaks), BLOCKS_A_CHUNK)
    return out


def spread(light: Float32) -> Float32:
    """(h, w) smoothed over SPREAD_SIGMA; the sum stays."""
    import cv2

    height, width = light.shape
    padded = np.pad(light, ((0, -height % COARSE), (0, -width % COARSE)))
    down, across = (size // COARSE for size in padded.shape)
    sums = padded.reshape(down, COARSE, across, COARSE).sum(axis=(1, 3), dtype=np.float32)
    coarse = smoothed(sums / np.float32(COARSE**2), SPREAD_SIGMA / COARSE)
    fine = cv2.resize(coarse, (across * COARSE, down * COARSE), interpolation=cv2.INTER_LINEAR)[:height, :width]
    found = float(fine.sum(dtype=np.float64))
    # beyond the edges that the blocks go over
    return fine * np.float32(float(light.sum(dtype=np.float64)) / found if found > 0.0 else 0.0)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _keep_largest(
    images: tuple[Float32, ...], touched: tuple[Bool, ...], weight: float, most: float, largest: Float32,
    start: int, stop: int,
) -> None:  # fmt: skip
    for k in range(len(images)):
        for block in range(start, stop):
            if touched[k][block]:
                for pixel in range(block * BLOCK, min((block + 1) * BLOCK, largest.shape[0])):
                    if images[k][pixel] != 0.0:
                        largest[pixel] = max(largest[pixel], np.float32(weight * min(images[k][pixel], most)))


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _find_lone(
    total: Float, largest: Float32, scale: float, peaks: Float32, line: Bool, out: Float32, start: int, stop: int
) -> None:
    for block in range(start, stop):
        for first in range(block * BLOCK, min((block + 1) * BLOCK, total.shape[0]), CELL):
            last = min(first + CELL, total.shape[0])
            risen, without, measured = 0.0, 0.0, False
            for pixel in range(first, last):
                weight = scale * peaks[block, pixel - block * BLOCK]
                risen += weight * total[pixel]
                without += weight * (total[pixel] - largest[pixel])
                measured |= line[pixel]
            if risen >= 1.0 > without and not measured:
                for pixel in range(first, last):
                    out[pixel] = scale * largest[pixel]
