"""Sums over the images of passes: what a goal in depth asks of them, a pixel at a time."""

from __future__ import annotations

from functools import partial

import numba
import numpy as np

from render.base.arrays import Bool, Float, Float32, Long
from render.base.threads import map_chunks
from render.importance import CELL
from render.laser_indirect.connection_buffer import BLOCK, PassBuffer

BLOCKS_A_CHUNK = 1 << 12
"""Blocks that a thread does at a time."""
SMOOTHED_ROWS = 128
"""Rows of an image that a thread smooths at a time, at least."""


def block_sums(values: Float32, blocks: int) -> Float:
    """(pixels,) -> (blocks,)."""
    out = np.empty(blocks)
    map_chunks(partial(_block_sums, values, out), blocks, BLOCKS_A_CHUNK)
    return out


def weigh_blocks(values: Float32, weight: Float32) -> Float:
    """Multiply (pixels,), mostly zeros, by weights (blocks, BLOCK) -> (blocks,) sums of what becomes of them."""
    out = np.empty(len(weight))
    map_chunks(partial(_weigh_blocks, values, weight, out), len(out), BLOCKS_A_CHUNK)
    return out


def scale_blocks(values: Float32, factors: Float, most: float) -> None:
    """Multiply (pixels,), mostly zeros, by the factor of each block (blocks,), to `most` at most."""
    map_chunks(partial(_scale_blocks, values, factors, most), len(factors), BLOCKS_A_CHUNK)


def smoothed(image: Float32, sigma: float) -> Float32:
    """(h, w) convolved with a Gaussian that ends at four sigmas; beyond its edges the image goes on as in a mirror."""
    import cv2

    reach = int(4 * sigma + 0.5)
    weights, out = cv2.getGaussianKernel(2 * reach + 1, sigma, cv2.CV_32F), np.empty_like(image)

    def work(start: int, stop: int) -> None:
        first, last = max(start - reach, 0), min(stop + reach, len(image))
        band = cv2.sepFilter2D(image[first:last], -1, weights, weights, borderType=cv2.BORDER_REFLECT)
        out[start:stop] = band[start - first : stop - first]

    map_chunks(work, len(image), max(SMOOTHED_ROWS, 4 * reach))
    return out


def mean_image(buffers: list[PassBuffer]) -> Float32:
    """(pixels,) mean of the images of passes."""
    out = np.zeros(len(buffers[0].image), np.float32)
    images, touched = tuple(buffer.image for buffer in buffers), tuple(buffer.touched for buffer in buffers)
    map_chunks(partial(_add_touched, images, touched, out), len(touched[0]), BLOCKS_A_CHUNK)
    return out


# what is zero is only read: its memory may not have been given by the system yet
@numba.njit(nogil=True, cache=True, error_model="numpy")
def _block_sums(values: Float32, out: Float, start: int, stop: int) -> None:
    for block in range(start, stop):
        total = 0.0
        for pixel in range(block * BLOCK, min((block + 1) * BLOCK, values.shape[0])):
            total += values[pixel]
        out[block] = total


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _weigh_blocks(values: Float32, weight: Float32, out: Float, start: int, stop: int) -> None:
    for block in range(start, stop):
        total, first = 0.0, block * BLOCK
        for k in range(min(BLOCK, values.shape[0] - first)):
            if values[first + k] != 0.0:
                values[first + k] *= weight[block, k]
                total += values[first + k]
        out[block] = total


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _scale_blocks(values: Float32, factors: Float, most: float, start: int, stop: int) -> None:
    for block in range(start, stop):
        for pixel in range(block * BLOCK, min((block + 1) * BLOCK, values.shape[0])):
            if values[pixel] != 0.0:
                values[pixel] = min(values[pixel] * factors[block], most)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _add_touched(images: tuple[Float32, ...], touched: tuple[Bool, ...], out: Float32, start: int, stop: int) -> None:
    for k in range(len(images)):
        for block in range(start, stop):
            if touched[k][block]:
                for pixel in range(block * BLOCK, min((block + 1) * BLOCK, out.shape[0])):
                    out[pixel] += images[k][pixel] / len(images)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def run_means(images: tuple[Float32, ...], weight: Float32, blocks: Long, out: Float, start: int, stop: int) -> None:
    """As `run_variances`, the mean of each run's weighted sum."""
    for i in range(start, stop):
        for j in range(BLOCK // CELL):
            out[blocks[i], j] = 0.0
            for k in range(len(images)):
                out[blocks[i], j] += _run_sum(images[k], weight, blocks[i], j) / len(images)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def run_variances(
    images: tuple[Float32, ...], weight: Float32, blocks: Long, out: Float32, start: int, stop: int
) -> None:
    """Images of passes (pixels,), weights (all blocks, BLOCK) and some blocks (n,) -> variance of a pass, of each run's
    weighted sum, into out (all blocks, BLOCK / CELL), for blocks start .. stop of the n."""
    passes = len(images)
    found = np.empty(passes)
    for i in range(start, stop):
        block = blocks[i]
        for j in range(BLOCK // CELL):
            mean = 0.0
            for n in range(passes):
                found[n] = _run_sum(images[n], weight, block, j)
                mean += found[n] / passes
            square = 0.0
            for n in range(passes):
                square += (found[n] - mean) ** 2
            out[block, j] = square / (passes - 1)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _run_sum(image: Float32, weight: Float32, block: int, j: int) -> float:
    total, first = 0.0, block * BLOCK
    for k in range(j * CELL, min((j + 1) * CELL, image.shape[0] - first)):
        total += image[first + k] * weight[block, k]
    return total
