"""Centre of mass of the pixels above a fraction of the peak: of their whole height, or of what is above the threshold.

Both are locked to the pixels, since the set of pixels flips (0.1 px; Fisher and Naidu, 1996), and claim no sigma.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from analysis.line.detection.channel import MISSING
from analysis.line.detection.detect import BACKGROUND
from analysis.line.methods.window import brightest, write_peak
from analysis.line.result import Flag

Float32 = NDArray[np.float32]
Array = NDArray[np.float64]
Mask = NDArray[np.uint8]

FRACTION = 0.2
"""Of the brightest pixel above the background."""

_SATURATED, _AT_BORDER, _NOT_POSITIVE = int(Flag.SATURATED), int(Flag.AT_BORDER), int(Flag.NOT_POSITIVE)


@njit(nogil=True, cache=True, error_model="numpy")
def weigh_above(
    signal: Float32, mask: Mask, seeds: Array, flags: Mask, fraction: float, subtract: bool, out: Array
) -> None:
    """Scan lines (n, w) and seeds (n, k, 6) -> out (n, k, 6): u, NaN, width, amplitude, background, NaN.

    Only the run of pixels that holds the brightest counts; missing pixels do not end it.
    """
    w = signal.shape[1]
    for row in range(signal.shape[0]):
        for k in range(seeds.shape[1]):
            for j in range(6):
                out[row, k, j] = np.nan
            if flags[row, k] > _SATURATED:
                continue
            seed = seeds[row, k]
            base = seed[BACKGROUND]
            top = brightest(signal[row], mask[row], seed)
            height = signal[row, top] - base
            if height <= 0.0:
                flags[row, k] = _NOT_POSITIVE
                continue
            level = fraction * height
            first = last = top
            while first >= 0 and (mask[row, first] & MISSING or signal[row, first] - base > level):
                first -= 1
            while last < w and (mask[row, last] & MISSING or signal[row, last] - base > level):
                last += 1
            if first < 0 or last >= w:
                flags[row, k] = _AT_BORDER
                continue
            mass, moment = 0.0, 0.0
            for i in range(first + 1, last):
                if mask[row, i] & MISSING == 0:
                    value = signal[row, i] - base - (level if subtract else 0.0)
                    mass += value
                    moment += value * (i - top)
            write_peak(seed, top + moment / mass, np.nan, out[row, k])
