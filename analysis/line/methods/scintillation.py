"""What light that scintillates adds to the variance of a position, and how much of it the scan lines have in common.

    sum_ij w_i w_j L_i L_j C(|x_i - x_j|)     w_i: px for one electron more in pixel i, L_i: the line's light in it

over C on one scan line, and over C summed along all of them: what is left of it in the mean of many.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]

STEEPEST = 4.0
"""Half the largest slope of the logarithm of the light, per pixel."""


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

    weight, light, x (n,): px of the position for one e- more, e-, pixels; covariances (2, m), fineness: of `NoiseModel`;
    width: the line's sigma, px. measured: the light is that of the pixels themselves, whose products scintillate too.
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
