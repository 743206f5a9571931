"""The phase of the window's first Fourier bin, the window put back on its own result.

    u = m + L / 2 pi arg sum y(x) exp(2 pi i (x - m) / L),   L = 6 s + 3 pixels around m

One pass, blind to a constant background, and 96 % efficient, since its sine weighs the flanks and not the far wings. A
neighbour inside the window or a sloping background drags it along, as they do the centre of mass.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from analysis.line.detection.detect import BACKGROUND, CENTRE, PLATEAU, REACH, WIDTH
from analysis.line.methods.window import any_saturated, brightest, load_window, position_sigma, write_peak
from analysis.line.result import Flag

Float32 = NDArray[np.float32]
Array = NDArray[np.float64]
Mask = NDArray[np.uint8]

NARROWEST = 0.5
"""px; narrower lines are not band-limited (0.02 px at 0.4), and no sigma is claimed."""

_SATURATED, _AT_BORDER = int(Flag.SATURATED), int(Flag.AT_BORDER)
_NOT_CONVERGED, _OUT_OF_WINDOW = int(Flag.NOT_CONVERGED), int(Flag.OUT_OF_WINDOW)


@njit(nogil=True, cache=True, error_model="numpy")
def turn_seeds(
    signal: Float32, mask: Mask, floor: Float32, seeds: Array, flags: Mask, correlation: Array, out: Array
) -> None:
    """Scan lines (n, w) and seeds (n, k, 6) -> out (n, k, 6): u, sigma_u, width, amplitude, background, NaN."""
    w = signal.shape[1]
    y, weight, sines, cosines = np.empty(w), np.empty(w), np.empty(w), np.empty(w)
    known = -1
    for row in range(signal.shape[0]):
        for k in range(seeds.shape[1]):
            for j in range(6):
                out[row, k, j] = np.nan
            if flags[row, k] > _SATURATED:
                continue
            seed = seeds[row, k]
            middle = brightest(signal[row], mask[row], seed)
            half = max(2, math.ceil(min(3.0 * seed[WIDTH] + 1.0 + seed[PLATEAU], seed[REACH])))
            n = 2 * half + 1
            step = 2.0 * math.pi / n
            if half != known and n <= w:
                for i in range(n):
                    sines[i], cosines[i] = math.sin(step * (i - half)), math.cos(step * (i - half))
                known = half
            reason, u, real, imaginary, previous = _NOT_CONVERGED, np.nan, 0.0, 0.0, -1
            for _ in range(8):
                if load_window(signal[row], mask[row], middle - half, middle + half, seed[BACKGROUND], y) < 0:
                    reason = _AT_BORDER
                    break
                real = imaginary = 0.0
                for i in range(n):
                    real += y[i] * cosines[i]
                    imaginary += y[i] * sines[i]
                if real <= 0.0 and abs(imaginary) <= 0.0:
                    break
                u = middle + math.atan2(imaginary, real) / step
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
            sigma, first = np.nan, middle - half
            if seed[WIDTH] >= NARROWEST and not any_saturated(mask[row], first, middle + half):
                power = real * real + imaginary * imaginary
                for i in range(n):
                    weight[i] = (sines[i] * real - cosines[i] * imaginary) / (step * power)
                sigma = position_sigma(signal[row], mask[row], floor[row], first, n, weight, correlation)
            write_peak(seed, u, sigma, out[row, k])
