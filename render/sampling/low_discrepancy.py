"""Low-discrepancy pairs: two dimensions of a pixel's samples, stratified over the unit square.

The first 2^k pairs of a row are a (0, k, 2)-net: every elementary interval of area 2^-k holds one (Sobol 1967, first
two dimensions). Each row is Owen-scrambled and shuffled within its powers of two, so that rows are independent and
every prefix is as even as its length allows. A pixel's pairs are a random row with a random shift (Cranley-Patterson
rotation): each is uniform on the unit square, and different dimensions are independent. After LENGTH samples another
random row follows.
"""

from __future__ import annotations

from functools import lru_cache

import numba
import numpy as np
from numpy.typing import NDArray

from render.base.arrays import Float32
from render.sampling.random import bits

Int = NDArray[np.int64]

ROWS, LOG_LENGTH = 64, 10
LENGTH = 1 << LOG_LENGTH
_ROW_MASK, _LOW24 = np.uint64(ROWS - 1), np.uint64(0xFFFFFF)
_S40, _S16 = np.uint64(40), np.uint64(16)


@lru_cache(maxsize=1)
def pair_table() -> Float32:
    """(ROWS, LENGTH, 2) float32 pairs in [0, 1)."""
    random = np.random.default_rng(20)
    x, y = _sobol_integers()
    order = _nested_shuffle(random)
    table = np.empty((ROWS, LENGTH, 2))
    for axis, integers in enumerate((x, y)):
        scrambled = np.take_along_axis(_nested_shuffle(random), integers[order], axis=1)
        table[:, :, axis] = (scrambled + random.random((ROWS, LENGTH))) / LENGTH
    return np.minimum(table, 1.0 - 2.0**-24).astype(np.float32)


def _sobol_integers() -> tuple[Int, Int]:
    """The first LENGTH points of the first two dimensions, times LENGTH."""
    index = np.arange(LENGTH)
    x, y = np.zeros(LENGTH, np.int64), np.zeros(LENGTH, np.int64)
    first = second = 1 << (LOG_LENGTH - 1)
    for bit in range(LOG_LENGTH):
        set_bit = (index >> bit) & 1 == 1
        x[set_bit] ^= first
        y[set_bit] ^= second
        first >>= 1
        second ^= second >> 1
    return x, y


def _nested_shuffle(random: np.random.Generator) -> Int:
    """(ROWS, LENGTH) permutations that randomly swap the halves of every aligned block (Owen 1995)."""
    order = np.tile(np.arange(LENGTH), (ROWS, 1))
    for level in range(LOG_LENGTH):
        halves = order.reshape(ROWS, 1 << level, 2, -1)
        swap = random.random((ROWS, 1 << level, 1, 1)) < 0.5
        order = np.where(swap, halves[:, :, ::-1], halves).reshape(ROWS, LENGTH)
    return order


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def pair_draw(seed: int, index: int, sample: int, dimension: int) -> np.uint64:
    """Random bits for the row and the shift of an index, the same for LENGTH consecutive samples."""
    return bits(seed, index, sample >> LOG_LENGTH, dimension)


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def pair_at(table: Float32, draw: np.uint64, sample: int) -> tuple[float, float]:
    """The pair of one sample from its `pair_draw`."""
    row, k = np.int64(draw & _ROW_MASK), sample & (LENGTH - 1)
    x = table[row, k, 0] + np.int64(draw >> _S40) * 2.0**-24
    y = table[row, k, 1] + np.int64((draw >> _S16) & _LOW24) * 2.0**-24
    return x - 1.0 if x >= 1.0 else x, y - 1.0 if y >= 1.0 else y


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def pair(table: Float32, seed: int, index: int, sample: int, dimension: int) -> tuple[float, float]:
    """The pair of one sample in one (pair of) dimensions of one index; a pure function of the four counters."""
    return pair_at(table, pair_draw(seed, index, sample, dimension), sample)
