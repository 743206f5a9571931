"""Blais and Rioux's FIR derivative of 2, 4 or 8 taps and its zero crossing, linear between two pixels.

    g2(x) = f(x-1) - f(x+1)
    g4(x) = f(x-2) + f(x-1) - f(x+1) - f(x+2),   g8 likewise with four on either side

Blais and Rioux, Signal Processing 11 (1986). The number of taps should be 5 to 6 sigmas of the line. Sums only, so that
a constant background does not matter; locked to the pixels by 0.01 to 0.02 px, so that it reports no sigma.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from analysis.line.detection.detect import PLATEAU, WIDTH
from analysis.line.methods.seed_loop import Array, Options, Pixels, peak_kernel
from analysis.line.methods.window import brightest, load_window, write_peak
from analysis.line.result import Flag


@njit(nogil=True, cache=True, error_model="numpy")
def _slope(y: Array, middle: int, arm: int) -> float:
    """Left sum less right sum: rises through zero at a peak."""
    total = 0.0
    for j in range(1, arm + 1):
        total += y[middle - j] - y[middle + j]
    return total


@peak_kernel
def measure_zero_crossing(pixels: Pixels, y: int, seed: Array, flag: int, options: Options, out: Array) -> int:
    """Peak kernel (`seed_loop`): the crossing nearest to the brightest pixel, without a sigma.

    options.variant: taps on either side, 1, 2 or 4.
    """
    signal, mask, window, arm = pixels.signal[y], pixels.mask[y], pixels.room[0], options.variant
    top = brightest(signal, mask, seed)
    search = 2 + math.ceil(seed[WIDTH] + seed[PLATEAU])
    while search > 1 and (top - search - arm < 0 or top + search + arm > signal.shape[0] - 1):
        search -= 1
    half = search + arm
    if load_window(signal, mask, top - half, top + half, seed, window) < 0:
        return Flag.AT_BORDER.value
    for distance in range(search):
        for side in (-1, 1):
            left = half + (distance if side > 0 else -distance - 1)
            before, after = _slope(window, left, arm), _slope(window, left + 1, arm)
            if before <= 0.0 < after or before < 0.0 <= after:
                write_peak(seed, top - half + left + before / (before - after), np.nan, out)
                return Flag.SATURATED.value if seed[PLATEAU] > 0.0 else Flag.OK.value
    return Flag.NOT_CONVERGED.value
