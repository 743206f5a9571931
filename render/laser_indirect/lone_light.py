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

from render.base.arrays import Bool, Float, Float32, Int
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


def lone_light(total: Float, largest: Float32, weight: float, projection: Projection) -> tuple[Int, Float32]:
    """(n,) pixels, and the radiance there that one pass alone found and that is a peak beside the line, of sums over
    all passes (pixels,) and the brightest of them, with the weight of all."""
    line = np.zeros(len(total), np.bool_)
    line[projection.pixel] = True
    blocks = len(projection.peaks)
    found = [(np.zeros(0, np.int32), np.zeros(0, np.float32))] * max(1, -(-blocks // BLOCKS_A_CHUNK))

    def work(start: int, stop: int) -> None:
        places, light = np.empty((stop - start) * BLOCK, np.int32), np.empty((stop - start) * BLOCK, np.float32)
        n = _find_lone((total, largest), 1.0 / weight, projection.peaks, line, (places, light), start, stop)
        found[start // BLOCKS_A_CHUNK] = places[:n].copy(), light[:n].copy()

    map_chunks(work, blocks, BLOCKS_A_CHUNK)
    places, light = (np.concatenate(parts) for parts in zip(*found, strict=True))
    return places, light


def spread_lone(radiance: Float32, places: Int, light: Float32) -> float:
    """Smooth, in place, the part of radiance (h, w) that is `light` in some pixels (n,) over SPREAD_SIGMA, and return
    its share; the sum stays."""
    if len(places) == 0:
        return 0.0
    height, width = radiance.shape
    moved, whole = float(light.sum(dtype=np.float64)), float(radiance.sum(dtype=np.float64))
    flat = radiance.reshape(-1)
    flat[places] = np.maximum(flat[places] - light, 0.0)
    down, across = -(-height // COARSE), -(-width // COARSE)
    cell = places // width // COARSE * across + places % width // COARSE
    sums = np.bincount(cell, light, down * across).astype(np.float32).reshape(down, across)
    coarse = smoothed(sums / np.float32(COARSE**2), SPREAD_SIGMA / COARSE)
    bands = range(0, down, COARSE)
    # beyond the edges that the blocks go over
    found = sum(float(_fine(coarse, start, radiance.shape).sum(dtype=np.float64)) for start in bands)
    for start in bands:
        fine = _fine(coarse, start, radiance.shape)
        radiance[start * COARSE :][: len(fine)] += fine * np.float32(moved / found if found > 0.0 else 0.0)
    return moved / whole


def _fine(coarse: Float32, start: int, shape: tuple[int, int]) -> Float32:
    """Some rows of an image (h, w), from those of the coarse one that begin at `start`; all of it at once would be as
    large as the image."""
    import cv2

    low, high = max(start - 1, 0), min(start + COARSE + 1, len(coarse))
    wide = cv2.resize(
        coarse[low:high], (coarse.shape[1] * COARSE, (high - low) * COARSE), interpolation=cv2.INTER_LINEAR
    )
    rows = min(shape[0] - start * COARSE, COARSE * COARSE)
    return wide[(start - low) * COARSE :][:rows, : shape[1]]


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
    sums: tuple[Float, Float32],
    scale: float,
    peaks: Float32,
    line: Bool,
    out: tuple[Int, Float32],
    start: int,
    stop: int,
) -> int:
    """Of blocks start .. stop, by the sums over all passes and the largest, pixels and their light -> out; how many."""
    (total, largest), (places, light), n = sums, out, 0
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
                    if largest[pixel] > 0.0:
                        places[n], light[n] = pixel, scale * largest[pixel]
                        n += 1
    return n
