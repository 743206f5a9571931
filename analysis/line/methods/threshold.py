"""Centre of mass of the pixels above a fraction of the peak: of their whole height, or of what is above the threshold.

Both are locked to the pixels, since the set of pixels flips (0.1 px; Fisher and Naidu, 1996), and report no sigma.
"""

from __future__ import annotations

import numpy as np

from analysis.line.detection.channel import MISSING
from analysis.line.methods.seed_loop import Array, Options, Pixels, peak_kernel
from analysis.line.methods.window import brightest, ground, write_peak
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
    signal, mask = pixels.signal[y], pixels.mask[y]
    top = brightest(signal, mask, seed)
    height = signal[top] - ground(seed, top)
    if height <= 0.0:
        return Flag.NOT_POSITIVE.value
    level = FRACTION * height
    first = last = top
    while first >= 0 and (mask[first] & MISSING or signal[first] - ground(seed, first) > level):
        first -= 1
    while last < signal.shape[0] and (mask[last] & MISSING or signal[last] - ground(seed, last) > level):
        last += 1
    if first < 0 or last >= signal.shape[0]:
        return Flag.AT_BORDER.value
    mass, moment = 0.0, 0.0
    for i in range(first + 1, last):
        if mask[i] & MISSING == 0:
            value = signal[i] - ground(seed, i) - (level if options.variant == SUBTRACTED else 0.0)
            mass += value
            moment += value * (i - top)
    if mass <= 0.0:  # the brightest is itself a gap, between pixels that are not above the threshold
        return Flag.NOT_POSITIVE.value
    write_peak(seed, top + moment / mass, np.nan, out)
    return flag
