"""Centre of mass in a symmetric window of 3 sigma, put back on its own result until it stays there.

Free of systematic error for a symmetric window and a band-limited line (Alexander and Ng, Opt. Eng. 30, 1991); what is
left is the truncated tail, 0.01 px. Clipped pixels count as they are.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from analysis.line.detection.channel import MISSING
from analysis.line.detection.detect import AMPLITUDE, BACKGROUND, CENTRE, PLATEAU, REACH, WIDTH
from analysis.line.methods.line_profile import linear_variance
from analysis.line.result import Flag

Float32 = NDArray[np.float32]
Array = NDArray[np.float64]
Mask = NDArray[np.uint8]

WINDOW = 3.0
CLIPPED = 0.07
"""px^2; clipping breaks the band limit: an error up to 0.1 px at s = 1, rms CLIPPED / s (1x to 100x full well)."""
NARROWEST = 0.5
"""px; narrower lines, whose width is not well known from a look, claim no sigma."""
LOCKED = 0.5
"""Of sigma: where the pixels decide more than the noise, none is claimed."""

_SATURATED, _AT_BORDER, _TOO_FEW = int(Flag.SATURATED), int(Flag.AT_BORDER), int(Flag.TOO_FEW_PIXELS)
_NOT_CONVERGED, _OUT_OF_WINDOW = int(Flag.NOT_CONVERGED), int(Flag.OUT_OF_WINDOW)


@njit(nogil=True, cache=True, error_model="numpy")
def weigh_seeds(
    signal: Float32, mask: Mask, floor: Float32, seeds: Array, flags: Mask, correlation: Array, out: Array
) -> None:
    """Scan lines (n, w) and seeds (n, k, 6) -> out (n, k, 6): u, sigma_u, width, amplitude, background, NaN.

    flags (n, k) is updated: only OK and SATURATED seeds are measured. The width is that of the seed.
    """
    n, w = signal.shape
    x, weight, variance = np.empty(w), np.empty(w), np.empty(w)
    for row in range(n):
        for k in range(seeds.shape[1]):
            for j in range(6):
                out[row, k, j] = np.nan
            if flags[row, k] > _SATURATED:
                continue
            seed = seeds[row, k]
            base = seed[BACKGROUND]
            half = max(1, math.ceil(min(max(WINDOW * seed[WIDTH], seed[PLATEAU] + 2.5 * seed[WIDTH]), seed[REACH])))
            middle = round(seed[CENTRE])
            u, mass, previous = np.nan, 0.0, -1
            reason = _NOT_CONVERGED
            for _ in range(8):
                if middle - half < 0 or middle + half > w - 1:
                    reason = _AT_BORDER
                    break
                count, mass, moment = 0, 0.0, 0.0
                for i in range(middle - half, middle + half + 1):
                    if mask[row, i] & MISSING == 0:
                        value = signal[row, i] - base
                        mass += value
                        moment += value * (i - middle)
                        count += 1
                if count < 2:
                    reason = _TOO_FEW
                    break
                if mass <= 0.0:
                    break
                u = middle + moment / mass
                if abs(u - seed[CENTRE]) > half:
                    reason = _OUT_OF_WINDOW
                    break
                following = round(u)
                if following in (middle, previous):  # at rest, or astride two pixels
                    reason = flags[row, k]
                    break
                previous, middle = middle, following
            flags[row, k] = reason
            if reason > _SATURATED:
                continue
            count = 0
            for i in range(middle - half, middle + half + 1):
                if mask[row, i] & MISSING == 0:
                    x[count] = i
                    weight[count] = (i - u) / mass
                    still = float(floor[row, min(i, floor.shape[1] - 1)])
                    variance[count] = max(signal[row, i] + still, 0.1 * abs(still))
                    count += 1
            out[row, k, 0] = u
            clipped = CLIPPED / seed[WIDTH] if reason == _SATURATED else 0.0
            sigma = math.sqrt(linear_variance(weight, variance, x, count, correlation) + clipped * clipped)
            # sampling locks narrow lines to the pixels by exp(-2 pi^2 s^2) / pi px at most
            locked = math.exp(-2.0 * (math.pi * seed[WIDTH]) ** 2) / math.pi
            if seed[WIDTH] > NARROWEST and locked < LOCKED * sigma:
                out[row, k, 1] = sigma
            out[row, k, 2], out[row, k, 3], out[row, k, 4] = seed[WIDTH], seed[AMPLITUDE], base
