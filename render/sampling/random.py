"""Counter-based random numbers: (seed, index, sample, dimension) decides every number, so no thread or tile order can.

Three rounds of a 64-bit mixer, one each for the seed, the index (pixel, path) and the pair (sample, dimension). Each
round is a bijection of its counter, so that no two draws of one index are equal; between indices collisions are as rare
as with random numbers. Counters are taken modulo 2^64, sample and dimension modulo 2^32.

    uniform     uniform on [0, 1), 53 bits
    normal      standard normal, by the ziggurat: exact, one draw of bits in 98 %
    bits        the 64 raw bits
"""

from __future__ import annotations

import math

import numba
import numpy as np
from numpy.typing import NDArray

# numba turns uint64 with a plain integer into float64, so every constant below is a uint64
_GOLDEN = np.uint64(0x9E3779B97F4A7C15)
_FIRST, _SECOND = np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB)
_S30, _S27, _S31, _S32, _S11, _S12 = (np.uint64(n) for n in (30, 27, 31, 32, 11, 12))
_LOW = np.uint64(0xFFFFFFFF)

_LAYERS, _LAYER_MASK = 128, np.uint64(127)
_TAIL, _LAYER_AREA = 3.442619855899, 9.91256303526217e-3


def _ziggurat_edges() -> NDArray[np.float64]:
    """(129,) right edges, widest first, of 128 layers of equal area under exp(-x^2/2) (Doornik 2005, eq. 2)."""
    edges = np.zeros(_LAYERS + 1)
    edges[0], edges[1] = _LAYER_AREA / math.exp(-0.5 * _TAIL**2), _TAIL
    for i in range(2, _LAYERS):
        edges[i] = math.sqrt(-2.0 * math.log(_LAYER_AREA / edges[i - 1] + math.exp(-0.5 * edges[i - 1] ** 2)))
    return edges


_EDGES = _ziggurat_edges()


def wrapped(seed: int) -> int:
    """Any integer as a seed for the kernels, in [0, 2^63)."""
    return seed % 2**63


@numba.njit(nogil=True, cache=True)
def _mix(state: np.uint64) -> np.uint64:
    """A bijection of 64 bits with full avalanche (Steele, Lea, Flood 2014, SplitMix64; Stafford's variant 13)."""
    state = (state ^ (state >> _S30)) * _FIRST
    state = (state ^ (state >> _S27)) * _SECOND
    return state ^ (state >> _S31)


@numba.njit(nogil=True, cache=True, inline="always")
def bits(seed: int, index: int, sample: int, dimension: int) -> np.uint64:
    """64 random bits, a pure function of the four counters."""
    key = _mix(np.uint64(seed) + _GOLDEN)
    place = _mix(key + np.uint64(index) * _GOLDEN)
    draw = (np.uint64(sample) << _S32) ^ (np.uint64(dimension) & _LOW)
    return _mix(place ^ (draw * _GOLDEN))


@numba.njit(nogil=True, cache=True, inline="always")
def uniform(seed: int, index: int, sample: int, dimension: int) -> float:
    """A float64, uniform on [0, 1)."""
    return np.int64(bits(seed, index, sample, dimension) >> _S11) * 2.0**-53


@numba.njit(nogil=True, cache=True)
def _open_uniform(state: np.uint64) -> float:
    """A float64, uniform on the open interval (0, 1)."""
    return (np.int64(state >> _S12) + 0.5) * 2.0**-52


@numba.njit(nogil=True, cache=True)
def normal(seed: int, index: int, sample: int, dimension: int) -> float:
    """A float64 from the standard normal distribution (Marsaglia, Tsang 2000; in the form of Doornik 2005, ZIGNOR).

    The 2 % of draws that need more bits continue with SplitMix64 from their own, so one set of counters is one number.
    """
    state = bits(seed, index, sample, dimension)
    while True:
        layer = np.int64(state & _LAYER_MASK)
        x = (np.int64(state) >> 11) * 2.0**-52 * _EDGES[layer]
        if abs(x) < _EDGES[layer + 1]:
            return x
        if layer == 0:
            return math.copysign(_normal_tail(state), x)
        state = _mix(state + _GOLDEN)
        above = math.exp(-0.5 * (_EDGES[layer + 1] ** 2 - x * x))
        below = math.exp(-0.5 * (_EDGES[layer] ** 2 - x * x))
        if below + _open_uniform(state) * (above - below) < 1.0:
            return x
        state = _mix(state + _GOLDEN)


@numba.njit(nogil=True, cache=True)
def _normal_tail(state: np.uint64) -> float:
    """A standard normal given that it exceeds the widest layer (Marsaglia 1964)."""
    while True:
        state = _mix(state + _GOLDEN)
        x = -math.log(_open_uniform(state)) / _TAIL
        state = _mix(state + _GOLDEN)
        if -2.0 * math.log(_open_uniform(state)) > x * x:
            return _TAIL + x
