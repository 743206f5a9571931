"""Positions from the brightest pixel and its two neighbours: the maximum itself, linear, parabola, Gaussian.

    linear    d = (c - a) / 2 (b - min(a, c))                                  (Fisher and Naidu, 1996)
    parabola  d = (a - c) / 2 (a - 2 b + c)
    gauss_3   d = (ln a - ln c) / 2 (ln a - 2 ln b + ln c)

a, b, c are the pixels above the background. All but gauss_3 are locked to the pixels (0.3, 0.1, 0.1 px at s = 0.6), so
that they claim no sigma. A saturated plateau holds no more than its centre.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from analysis.line.detection.detect import AMPLITUDE, BACKGROUND, CENTRE, PLATEAU, WIDTH
from analysis.line.methods.window import any_saturated, brightest, load_window, position_sigma, write_peak
from analysis.line.result import Flag

Float32 = NDArray[np.float32]
Array = NDArray[np.float64]
Mask = NDArray[np.uint8]

MAXIMUM, LINEAR, PARABOLA, GAUSS = range(4)
NARROWEST = 0.55
"""px; gauss_3 claims no sigma for narrower lines, where sampled logarithms bend (0.01 px at 0.4)."""
STEADY = 0.05
"""px; where the sigma to be expected is larger, logarithms are no longer linear in the noise, and none is claimed."""

_SATURATED, _AT_BORDER, _NOT_POSITIVE = int(Flag.SATURATED), int(Flag.AT_BORDER), int(Flag.NOT_POSITIVE)
_NOT_CONVERGED = int(Flag.NOT_CONVERGED)


@njit(nogil=True, cache=True, error_model="numpy")
def _is_steady(seed: Array, floor: Float32) -> bool:
    """Whether gauss_3 has an honest sigma on this line: judged from the seed, since the three pixels are the noise."""
    if seed[WIDTH] < NARROWEST:
        return False
    square = seed[WIDTH] * seed[WIDTH]
    flank = seed[AMPLITUDE] * math.exp(-0.5 / square)
    still = seed[BACKGROUND] + floor[min(round(seed[CENTRE]), floor.shape[0] - 1)]
    return bool(square * math.sqrt(0.5 * (flank + max(still, 0.0))) < STEADY * flank)


@njit(nogil=True, cache=True, error_model="numpy")
def interpolate_seeds(
    signal: Float32,
    mask: Mask,
    floor: Float32,
    seeds: Array,
    flags: Mask,
    kind: int,
    correlation: Array,
    out: Array,
) -> None:
    """Scan lines (n, w) and seeds (n, k, 6) -> out (n, k, 6): u, sigma_u, width, amplitude, background, NaN."""
    y, weight = np.empty(3), np.empty(3)
    for row in range(signal.shape[0]):
        for k in range(seeds.shape[1]):
            for j in range(6):
                out[row, k, j] = np.nan
            if flags[row, k] > _SATURATED:
                continue
            seed = seeds[row, k]
            top = brightest(signal[row], mask[row], seed)
            if seed[PLATEAU] > 0.0:
                write_peak(seed, seed[CENTRE], np.nan, out[row, k])
                continue
            if load_window(signal[row], mask[row], top - 1, top + 1, seed[BACKGROUND], y) < 0:
                flags[row, k] = _AT_BORDER
                continue
            if kind == MAXIMUM:
                write_peak(seed, float(top), np.nan, out[row, k])
                continue
            a, b, c = y[0], y[1], y[2]
            offset, sigma = 0.0, np.nan
            if kind == LINEAR:
                rise = b - min(a, c)
                offset = 0.5 * (c - a) / rise if rise > 0.0 else 0.0
            elif kind == PARABOLA:
                bend = a - 2.0 * b + c
                offset = 0.5 * (a - c) / bend if bend < 0.0 else 0.0
            else:
                if min(a, b, c) <= 0.0:
                    flags[row, k] = _NOT_POSITIVE
                    continue
                la, lb, lc = math.log(a), math.log(b), math.log(c)
                bend = la - 2.0 * lb + lc
                if bend >= 0.0:
                    flags[row, k] = _NOT_CONVERGED
                    continue
                offset = 0.5 * (la - lc) / bend
                weight[0] = (0.5 - offset) / (bend * a)
                weight[1] = 2.0 * offset / (bend * b)
                weight[2] = (-0.5 - offset) / (bend * c)
                if _is_steady(seed, floor[row]) and not any_saturated(mask[row], top - 1, top + 1):
                    sigma = position_sigma(signal[row], mask[row], floor[row], top - 1, 3, weight, correlation)
            write_peak(seed, top + min(max(offset, -1.0), 1.0), sigma, out[row, k])
