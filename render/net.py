"""Points of the unit square that spread evenly: Sobol's (0, 2)-sequence with Owen's scrambling, counter-based.

Of any 4^k points in a row, aligned to 4^k, each cell of 2^k x 2^k holds one. Indexed by the Morton code of a pixel's
sub-cells (Ahmed and Wonka 2020), every quad of neighbouring cells has four such points, in an order of its own.
Scrambling by hash: Laine and Karras 2011 as bettered by Burley 2020 (Practical Hash-based Owen Scrambling).
"""

from __future__ import annotations

import numba
import numpy as np

from render.random import bits

_ONE, _TWO, _FOUR, _EIGHT, _SIXTEEN = (np.uint64(n) for n in (1, 2, 4, 8, 16))
_LOW, _HALF = np.uint64(0xFFFFFFFF), np.uint64(1 << 31)
_A, _B, _C, _D = (np.uint64(n) for n in (0x6C50B47C, 0xB82F1E52, 0xC7AFE638, 0x8D22F6E6))
_M1, _M2, _M4, _M8 = (np.uint64(n) for n in (0x55555555, 0x33333333, 0x0F0F0F0F, 0x00FF00FF))
_S32 = np.uint64(32)


@numba.njit(nogil=True, cache=True)
def _reversed(x: np.uint64) -> np.uint64:
    """The low 32 bits, the last first."""
    x = ((x >> _ONE) & _M1) | ((x & _M1) << _ONE)
    x = ((x >> _TWO) & _M2) | ((x & _M2) << _TWO)
    x = ((x >> _FOUR) & _M4) | ((x & _M4) << _FOUR)
    x = ((x >> _EIGHT) & _M8) | ((x & _M8) << _EIGHT)
    return (x >> _SIXTEEN) | ((x << _SIXTEEN) & _LOW)


@numba.njit(nogil=True, cache=True)
def _scrambled(x: np.uint64, key: np.uint64) -> np.uint64:
    """32 bits in which each is flipped as the lower ones, and the key, say."""
    x = (x + key) & _LOW
    x ^= (x * _A) & _LOW
    x ^= (x * _B) & _LOW
    x ^= (x * _C) & _LOW
    return x ^ ((x * _D) & _LOW)


@numba.njit(nogil=True, cache=True)
def morton(i: int, j: int) -> int:
    """The bits of i and j, below 2^16, by turns."""
    x, y = np.uint64(i), np.uint64(j)
    x = (x | (x << _EIGHT)) & _M8
    x = (x | (x << _FOUR)) & _M4
    x = (x | (x << _TWO)) & _M2
    x = (x | (x << _ONE)) & _M1
    y = (y | (y << _EIGHT)) & _M8
    y = (y | (y << _FOUR)) & _M4
    y = (y | (y << _TWO)) & _M2
    y = (y | (y << _ONE)) & _M1
    return int(x | (y << _ONE))


@numba.njit(nogil=True, cache=True)
def net_point(seed: int, index: int, number: int, dimension: int) -> tuple[float, float]:
    """Point `number` of the sequence that belongs to (seed, index, dimension), in [0, 1)^2."""
    one, two = bits(seed, index, dimension, 0), bits(seed, index, dimension, 1)
    order = _reversed(_scrambled(_reversed(np.uint64(number)), one & _LOW))
    second, column = np.uint64(0), _HALF
    left = order
    while left != np.uint64(0):
        if left & _ONE:
            second ^= column
        left >>= _ONE
        column ^= column >> _ONE
    x = _reversed(_scrambled(order, one >> _S32))
    y = _reversed(_scrambled(_reversed(second), two & _LOW))
    return np.int64(x) * 2.0**-32, np.int64(y) * 2.0**-32
