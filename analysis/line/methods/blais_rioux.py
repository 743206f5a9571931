"""Blais and Rioux's FIR derivative of 2, 4 or 8 taps and its zero crossing, linear between two pixels.

    g2(x) = f(x-1) - f(x+1)
    g4(x) = f(x-2) + f(x-1) - f(x+1) - f(x+2),   g8 likewise with four on either side

Blais and Rioux, Signal Processing 11 (1986). The number of taps should be 5 to 6 sigmas of the line. Sums only, so that
a constant background does not matter; locked to the pixels by 0.01 to 0.02 px, so that it claims no sigma.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from analysis.line.detection.detect import PLATEAU, WIDTH
from analysis.line.methods.window import brightest, load_window, write_peak
from analysis.line.result import Flag

Float32 = NDArray[np.float32]
Array = NDArray[np.float64]
Mask = NDArray[np.uint8]

_SATURATED, _AT_BORDER, _NOT_CONVERGED = int(Flag.SATURATED), int(Flag.AT_BORDER), int(Flag.NOT_CONVERGED)


@njit(nogil=True, cache=True, error_model="numpy")
def _slope(y: Array, middle: int, arm: int) -> float:
    """Left sum less right sum: rises through zero at a peak."""
    total = 0.0
    for j in range(1, arm + 1):
        total += y[middle - j] - y[middle + j]
    return total


@njit(nogil=True, cache=True, error_model="numpy")
def cross_seeds(signal: Float32, mask: Mask, seeds: Array, flags: Mask, arm: int, out: Array) -> None:
    """Scan lines (n, w) and seeds (n, k, 6) -> out (n, k, 6): u, NaN, width, amplitude, background, NaN.

    arm: taps on either side, 1, 2 or 4. The crossing is the one nearest to the brightest pixel.
    """
    y = np.empty(signal.shape[1])
    for row in range(signal.shape[0]):
        for k in range(seeds.shape[1]):
            for j in range(6):
                out[row, k, j] = np.nan
            if flags[row, k] > _SATURATED:
                continue
            seed = seeds[row, k]
            top = brightest(signal[row], mask[row], seed)
            search = 2 + math.ceil(seed[WIDTH] + seed[PLATEAU])
            while search > 1 and (top - search - arm < 0 or top + search + arm > signal.shape[1] - 1):
                search -= 1
            half = search + arm
            if load_window(signal[row], mask[row], top - half, top + half, 0.0, y) < 0:
                flags[row, k] = _AT_BORDER
                continue
            flags[row, k] = max(flags[row, k], _NOT_CONVERGED)
            for distance in range(search):
                found = False
                for side in (-1, 1):
                    left = half + (distance if side > 0 else -distance - 1)
                    before, after = _slope(y, left, arm), _slope(y, left + 1, arm)
                    if before <= 0.0 < after or before < 0.0 <= after:
                        u = top - half + left + before / (before - after)
                        write_peak(seed, u, np.nan, out[row, k])
                        flags[row, k] = _SATURATED if seed[PLATEAU] > 0.0 else 0
                        found = True
                        break
                if found:
                    break
