"""Centre of mass of the pixels above a fraction of the peak: of their whole height, or of what is above the threshold.

Both are locked to the pixels, since the set of pixels flips (0.1 px; Fisher and Naidu, 1996), and report no sigma.
"""

from __future__ import annotations

import numpy as np

from analysis.line.detection.channel import MISSING
from analysis.line.detection.detect import BACKGROUND
from analysis.line.methods.seed_loop import Array, Options, Pixels, peak_kernel
from analysis.line.methods.window import brightest, write_peak
from analysis.line.result import Flag

FRACTION = 0.2
"""Of the brightest pixel above the background."""
WHOLE, SUBTRACTED = range(2)
"""Variants: what is above the background counts, or above the threshold."""


@peak_kernel
def measure_above_threshold(pixels: Pixels, y: int, seed: Array, flag: int, options: Options, out: Array) -> int:
    """Peak kernel (`seed_loop`), without a sigma.

    Only the run of pixels that holds the brightest counts; missing pixels do not end it.
    """
    signal, mask, base = pixels.signal[y], pixels.mask[y], seed[BACKGROUND]
    top = brightest(signal, mask, seed)
    height = signal[top] - base
    if height <= 0.0:
        return Flag.NOT_POSITIVE.value
    level = FRACTION * height
    first = last = top
    while first >= 0 and (mask[first] & MISSING or signal[first] - base > level):
        first -= 1
    while last < signal.shape[0] and (mask[last] & MISSING or signal[last] - base > level):
        last += 1
    if first < 0 or last >= signal.shape[0]:
        return Flag.AT_BORDER.value
    mass, moment = 0.0, 0.0
    for i in range(first + 1, last):
        if mask[i] & MISSING == 0:
            value = signal[i] - base - (level if options.variant == SUBTRACTED else 0.0)
            mass += value
            moment += value * (i - top)
    write_peak(seed, top + moment / mass, np.nan, out)
    return flag
