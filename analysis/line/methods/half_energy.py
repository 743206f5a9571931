"""The position that halves the line's energy: where the running sum of a symmetric window crosses a half.

A median of the light rather than its mean (Ivasiv, 2021). Linear within the pixel, which locks it to the pixels by
0.04 px at s = 0.6 and 0.008 px at s = 1.5, so that it reports no sigma.
"""

from __future__ import annotations

import math

import numpy as np

from analysis.line.detection.detect import PLATEAU, REACH, WIDTH
from analysis.line.methods.seed_loop import Array, Options, Pixels, peak_kernel
from analysis.line.methods.window import brightest, load_window, write_peak
from analysis.line.result import Flag

WINDOW = 3.0
"""Half the window in sigmas of the line."""


@peak_kernel
def measure_half_energy(pixels: Pixels, y: int, seed: Array, flag: int, options: Options, out: Array) -> int:
    """Peak kernel (`seed_loop`), without a sigma."""
    signal, mask, window = pixels.signal[y], pixels.mask[y], pixels.room[0]
    top = brightest(signal, mask, seed)
    half = max(1, math.ceil(min(WINDOW * seed[WIDTH] + seed[PLATEAU], seed[REACH])))
    if load_window(signal, mask, top - half, top + half, seed, window) < 0:
        return Flag.AT_BORDER.value
    total = 0.0
    for i in range(2 * half + 1):
        total += window[i]
    if total <= 0.0:
        return Flag.NOT_POSITIVE.value
    before, i = 0.0, 0
    while i < 2 * half and before + window[i] < 0.5 * total:
        before += window[i]
        i += 1
    inside = (0.5 * total - before) / window[i] if window[i] > 0.0 else 0.5
    write_peak(seed, top - half + i - 0.5 + min(max(inside, 0.0), 1.0), np.nan, out)
    return flag
