"""Sums over the images of passes: what a goal in depth asks of them, a pixel at a time."""

from __future__ import annotations

import numba
import numpy as np

from render.base.arrays import Bool, Float, Float32, Long
from render.importance import CELL
from render.laser_indirect.connection_buffer import BLOCK, PassBuffer


def run_sums(image: Float32, weight: Float32, blocks: Long) -> Float:
    """An image (pixels,), weights (all blocks, BLOCK) and some blocks (n,) -> (n, BLOCK / CELL) weighted sums of each
    run of pixels."""
    out = np.empty((len(blocks), BLOCK // CELL))
    _run_sums(image, weight, blocks, out)
    return out


def mean_image(buffers: list[PassBuffer]) -> Float32:
    """(pixels,) mean of the images of passes."""
    out = np.zeros(len(buffers[0].image), np.float32)
    for buffer in buffers:
        _add_touched(buffer.image, buffer.touched, 1.0 / len(buffers), out)
    return out


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _add_touched(image: Float32, touched: Bool, share: float, out: Float32) -> None:
    for block in np.flatnonzero(touched):
        for pixel in range(block * BLOCK, min((block + 1) * BLOCK, image.shape[0])):
            out[pixel] += share * image[pixel]


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _run_sums(image: Float32, weight: Float32, blocks: Long, out: Float) -> None:
    for i in range(blocks.shape[0]):
        block = blocks[i]
        for j in range(BLOCK // CELL):
            total = 0.0
            for k in range(j * CELL, (j + 1) * CELL):
                pixel = block * BLOCK + k
                if pixel < image.shape[0]:
                    total += image[pixel] * weight[block, k]
            out[i, j] = total
