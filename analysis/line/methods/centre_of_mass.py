"""Centre of mass in a symmetric window of 3 sigma, put back on its own result until it stays there.

Free of systematic error for a symmetric window and a band-limited line (Alexander and Ng, Opt. Eng. 30, 1991); what is
left is the truncated tail, 0.01 px. Clipped pixels count as they are.
"""

from __future__ import annotations

import math

import numpy as np

from analysis.line.detection.channel import MISSING
from analysis.line.detection.detect import CENTRE, PLATEAU, REACH, WIDTH
from analysis.line.methods.scintillation import write_sigma
from analysis.line.methods.seed_loop import Array, Options, Pixels, peak_kernel
from analysis.line.methods.window import ground, pixel_variance, slope_variance, write_peak
from analysis.line.result import Flag

WINDOW = 3.0
CLIPPED = 0.07
"""px^2; clipping breaks the band limit: an error up to 0.1 px at s = 1, rms CLIPPED / s (1x to 100x full well)."""
NARROWEST = 0.5
"""px; narrower lines, whose width is not well known from a look, report no sigma."""
LOCKED = 0.5
"""Of sigma: where the pixels decide more than the noise, none is reported."""


@peak_kernel
def measure_centroid(pixels: Pixels, y: int, seed: Array, flag: int, options: Options, out: Array) -> int:
    """Peak kernel (`seed_loop`). The width is that of the seed."""
    signal, mask, floor, w = pixels.signal[y], pixels.mask[y], pixels.floor[y], pixels.signal.shape[1]
    half = max(1, math.ceil(min(max(WINDOW * seed[WIDTH], seed[PLATEAU] + 2.5 * seed[WIDTH]), seed[REACH])))
    middle = round(seed[CENTRE])
    u, mass, previous = np.nan, 0.0, -1
    reason = Flag.NOT_CONVERGED.value
    for _ in range(8):
        if middle - half < 0 or middle + half > w - 1:
            return Flag.AT_BORDER.value
        count, mass, moment = 0, 0.0, 0.0
        for i in range(middle - half, middle + half + 1):
            if mask[i] & MISSING == 0:
                value = signal[i] - ground(seed, i)
                mass += value
                moment += value * (i - middle)
                count += 1
        if count < 2:
            return Flag.TOO_FEW_PIXELS.value
        if mass <= 0.0:
            break
        u = middle + moment / mass
        if abs(u - seed[CENTRE]) > half:
            return Flag.OUT_OF_WINDOW.value
        following = round(u)
        if following in (middle, previous):  # at rest, or astride two pixels
            reason = flag
            break
        previous, middle = middle, following
    if reason > Flag.SATURATED.value:
        return reason
    x, weight, variance, count = pixels.room[0], pixels.room[1], pixels.room[2], 0
    for i in range(middle - half, middle + half + 1):
        if mask[i] & MISSING == 0:
            x[count], weight[count], variance[count] = i, (i - u) / mass, pixel_variance(signal, floor, i)
            count += 1
    clipped = CLIPPED / seed[WIDTH] if reason == Flag.SATURATED.value else 0.0
    unknown = clipped * clipped + slope_variance(seed, weight, x, count)
    sigma = math.hypot(write_sigma(pixels, y, seed, x, weight, variance, count, out), math.sqrt(unknown))
    # sampling locks narrow lines to the pixels by exp(-2 pi^2 s^2) / pi px at most
    locked = math.exp(-2.0 * (math.pi * seed[WIDTH]) ** 2) / math.pi
    write_peak(seed, u, sigma if seed[WIDTH] > NARROWEST and locked < LOCKED * sigma else np.nan, out)
    return reason
