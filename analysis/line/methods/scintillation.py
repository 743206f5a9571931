"""What light that scintillates adds to the variance of a position, and how much of it the scan lines have in common.

    sum_ij w_i w_j L_i L_j C(|x_i - x_j|)     w_i: px for one electron more in pixel i, L_i: the line's light in it

over C on one scan line, and over C summed along all of them: what is left of it in the mean of many.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from analysis.line.detection.detect import BACKGROUND, CENTRE, SLOPE, WIDTH
from analysis.line.methods.line_profile import linear_variance
from analysis.line.methods.seed_loop import CORRELATION_LENGTH, Array, Pixels

STEEPEST = 2.0
"""Half the largest slope of the logarithm of the light, per pixel."""
SECOND_ORDER, SECOND_ORDER_MEASURED, PIXEL = 5.0, 10.0, 0.35
"""Strong scintillation moves a position by more than to first order: its variance grows by k times itself over the
line's width squared, and that of a pixel, px^2. k by seeded trials of contrast 0.1 to 0.6 on lines of 0.5 to 2.5 px, of
fits and of pixels that are weighed as they are."""


@njit(nogil=True, cache=True, error_model="numpy")
def unevenness(steep: float) -> float:
    """Mean square over squared mean of light that runs as exp(2 steep x) over a pixel."""
    half = min(abs(steep), STEEPEST)
    return 1.0 if half < 1e-3 else half / math.tanh(half)


@njit(nogil=True, cache=True, error_model="numpy")
def shared_variance(
    weight: Array, light: Array, x: Array, n: int, covariances: Array, fineness: float, width: float, measured: bool
) -> tuple[float, float]:
    """px^2 of a position on its own scan line, and of the mean of many such times their number.

    weight, light, x (n,): px for one e- more, e-, pixels; covariances (2, m), fineness: as in `NoiseModel`; width: the
    line's sigma, px. measured: the light is that of the pixels themselves, whose products scintillate as well.
    """
    own, all_lines = 0.0, 0.0
    total, moment = 1e-300, 0.0
    for i in range(n):
        total += max(light[i], 0.0)
        moment += max(light[i], 0.0) * x[i]
    centre = moment / total
    for i in range(n):
        moved = weight[i] * max(light[i], 0.0)
        if moved == 0.0:
            continue
        for j in range(i, n):
            distance = int(x[j] - x[i])
            if distance >= covariances.shape[1]:
                break
            product = moved * weight[j] * max(light[j], 0.0)
            if distance > 0:
                product *= 2.0
            elif fineness > 0.0:
                product *= 1.0 + fineness * (unevenness(0.5 * (x[i] - centre) / (width * width)) - 1.0)
            if measured:  # E[L_i L_j] is larger than the product of the means by 1 + C
                product /= 1.0 + covariances[0, distance]
            own += product * covariances[0, distance]
            all_lines += product * covariances[1, distance]
    return max(own, 0.0), max(all_lines, 0.0)


@njit(nogil=True, cache=True, error_model="numpy")
def second_order(shared: float, width: float, measured: bool) -> float:
    """What makes of px^2 by scintillation, to first order, that to second order."""
    return 1.0 + (SECOND_ORDER_MEASURED if measured else SECOND_ORDER) * shared / (width * width + PIXEL)


@njit(nogil=True, cache=True, error_model="numpy")
def position_variance(
    pixels: Pixels, weight: Array, variance: Array, light: Array, x: Array, n: int, width: float, measured: bool
) -> tuple[float, float, float]:
    """px^2 of a position by all noise, the scan lines that err alike, and px^2 by scintillation alone.

    Arguments as in `shared_variance`.
    """
    count = linear_variance(weight, variance, x, n, pixels.correlation)
    if pixels.covariances.shape[1] == 0:
        return count, pixels.alike, 0.0
    shared, all_lines = shared_variance(weight, light, x, n, pixels.covariances, pixels.fineness, width, measured)
    grown = second_order(shared, width, measured)
    shared, all_lines = shared * grown, all_lines * grown
    return count + shared, (count * pixels.alike + all_lines) / max(count + shared, 1e-300), shared


@njit(nogil=True, cache=True, error_model="numpy")
def write_sigma(
    pixels: Pixels, y: int, seed: Array, x: Array, weight: Array, variance: Array, n: int, out: Array
) -> float:
    """Sigma of a position that weighs the pixels x (n,) of scan line y themselves; their correlation length -> out."""
    if pixels.covariances.shape[1] == 0:
        out[CORRELATION_LENGTH] = pixels.alike
        return math.sqrt(linear_variance(weight, variance, x, n, pixels.correlation))
    light = np.empty(n)
    for i in range(n):
        light[i] = pixels.signal[y, int(x[i])] - seed[BACKGROUND] - seed[SLOPE] * (x[i] - seed[CENTRE])
    spread, length, _ = position_variance(pixels, weight, variance, light, x, n, seed[WIDTH], True)
    out[CORRELATION_LENGTH] = length
    return math.sqrt(spread)
