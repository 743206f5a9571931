"""Positions from the brightest pixel and its two neighbours: the maximum itself, linear, parabola, Gaussian.

    linear    d = (c - a) / 2 (b - min(a, c))                                  (Fisher and Naidu, 1996)
    parabola  d = (a - c) / 2 (a - 2 b + c)
    gauss_3   d = (ln a - ln c) / 2 (ln a - 2 ln b + ln c)

a, b, c are the pixels above the background. All but gauss_3 are locked to the pixels (0.3, 0.1, 0.1 px at s = 0.6), so
that they report no sigma. A saturated plateau holds no more than its centre.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from analysis.line.detection.detect import AMPLITUDE, BACKGROUND, CENTRE, PLATEAU, WIDTH
from analysis.line.methods.seed_loop import Array, Options, Pixels, peak_kernel
from analysis.line.methods.window import any_saturated, brightest, load_window, position_sigma, write_peak
from analysis.line.result import Flag
from render.base.arrays import Float32

MAXIMUM, LINEAR, PARABOLA, GAUSS = range(4)
NARROWEST = 0.55
"""px; gauss_3 reports no sigma for narrower lines, where sampled logarithms bend (0.01 px at 0.4)."""
STEADY = 0.05
"""px; where the sigma to be expected is larger, logarithms are no longer linear in the noise, and none is reported."""


@njit(nogil=True, cache=True, error_model="numpy")
def _is_steady(seed: Array, floor: Float32) -> bool:
    """Whether gauss_3 has an honest sigma on this line: judged from the seed, since the three pixels are the noise."""
    if seed[WIDTH] < NARROWEST:
        return False
    square = seed[WIDTH] * seed[WIDTH]
    flank = seed[AMPLITUDE] * math.exp(-0.5 / square)
    dark = seed[BACKGROUND] + floor[min(round(seed[CENTRE]), floor.shape[0] - 1)]
    return bool(square * math.sqrt(0.5 * (flank + max(dark, 0.0))) < STEADY * flank)


@peak_kernel
def measure_three_pixels(pixels: Pixels, y: int, seed: Array, flag: int, options: Options, out: Array) -> int:
    """Peak kernel (`seed_loop`). options.variant: MAXIMUM, LINEAR, PARABOLA or GAUSS."""
    signal, mask, window, kind = pixels.signal[y], pixels.mask[y], pixels.room[0], options.variant
    top = brightest(signal, mask, seed)
    if seed[PLATEAU] > 0.0:
        write_peak(seed, seed[CENTRE], np.nan, out)
        return flag
    if load_window(signal, mask, top - 1, top + 1, seed, window) < 0:
        return Flag.AT_BORDER.value
    if kind == MAXIMUM:
        write_peak(seed, float(top), np.nan, out)
        return flag
    a, b, c = window[0], window[1], window[2]
    offset, sigma = 0.0, np.nan
    if kind == LINEAR:
        rise = b - min(a, c)
        offset = 0.5 * (c - a) / rise if rise > 0.0 else 0.0
    elif kind == PARABOLA:
        bend = a - 2.0 * b + c
        offset = 0.5 * (a - c) / bend if bend < 0.0 else 0.0
    else:
        if min(a, b, c) <= 0.0:
            return Flag.NOT_POSITIVE.value
        la, lb, lc = math.log(a), math.log(b), math.log(c)
        bend = la - 2.0 * lb + lc
        if bend >= 0.0:
            return Flag.NOT_CONVERGED.value
        offset = 0.5 * (la - lc) / bend
        weight = pixels.room[1]
        weight[0] = (0.5 - offset) / (bend * a)
        weight[1] = 2.0 * offset / (bend * b)
        weight[2] = (-0.5 - offset) / (bend * c)
        if _is_steady(seed, pixels.floor[y]) and not any_saturated(mask, top - 1, top + 1):
            sigma = position_sigma(pixels, y, seed, top - 1, 3, weight, out)
    write_peak(seed, top + min(max(offset, -1.0), 1.0), sigma, out)
    return flag
