"""An image with noise, and with its opposite: what jumps by it does not go as far one way as the other."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from render.base.arrays import Float32
from render.sampling.random import bits

WORD = 64
"""Bits of a random number, each the sign of one pixel's noise."""


@njit(nogil=True, cache=True, error_model="numpy")
def opposite_images(
    electrons: Float32,
    first: int,
    noise: tuple[float, float, int],
    numbers: tuple[float, float, float],
    images: tuple[Float32, Float32],
) -> None:
    """Mean electrons of scan lines (n, w), the first of which has a number -> two images (n, w) of opposite noise.

    Each pixel differs by as much as a share of its own noise's standard deviation, to either side by chance. noise:
    floor, e-^2, share, seed; numbers: DN an electron, black level, saturation, DN.
    """
    (floor, share, seed), (gain, black, most), (one, other) = noise, numbers, images
    for y in range(electrons.shape[0]):
        for start in range(0, electrons.shape[1], WORD):
            signs = bits(seed, first + y, start, 0)
            for x in range(start, min(start + WORD, electrons.shape[1])):
                deviation = share * math.sqrt(max(electrons[y, x] + floor, 1e-2))
                if signs & np.uint64(1):
                    deviation = -deviation
                signs >>= np.uint64(1)
                one[y, x] = np.float32(min(gain * (electrons[y, x] + deviation) + black, most))
                other[y, x] = np.float32(min(gain * (electrons[y, x] - deviation) + black, most))
