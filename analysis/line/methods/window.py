"""The pixels around a seed as one piece without gaps, and the noise of whatever is computed from them."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from analysis.line.detection.channel import MISSING, SATURATED
from analysis.line.detection.detect import AMPLITUDE, BACKGROUND, CENTRE, PLATEAU, SLOPE, SLOPE_SIGMA, WIDTH
from analysis.line.methods.scintillation import write_sigma
from analysis.line.methods.seed_loop import Array, Mask, Pixels
from render.base.arrays import Float32


@njit(nogil=True, cache=True, error_model="numpy")
def brightest(signal: Float32, mask: Mask, seed: Array) -> int:
    """The brightest usable pixel of a scan line (w,) within a sigma of the seed; a plateau's middle."""
    w = signal.shape[0]
    middle = round(seed[CENTRE])
    if seed[PLATEAU] > 0.0:
        return middle
    reach = max(2, math.ceil(seed[WIDTH]))
    best, top = middle, -np.inf
    for i in range(max(0, middle - reach), min(w, middle + reach + 1)):
        if mask[i] & MISSING == 0 and signal[i] > top:
            best, top = i, signal[i]
    return best


@njit(nogil=True, cache=True, error_model="numpy")
def ground(seed: Array, i: float) -> float:
    """Background under a peak at pixel i of its scan line, e-."""
    return float(seed[BACKGROUND] + seed[SLOPE] * (i - seed[CENTRE]))


@njit(nogil=True, cache=True, error_model="numpy")
def load_window(signal: Float32, mask: Mask, first: int, last: int, seed: Array, y: Array) -> int:
    """Pixels first..last less the background -> y; gaps filled linearly. Returns how many were there, -1 off the image.

    The pixels at either side of a gap that reaches the window's end are looked for outside it.
    """
    w = signal.shape[0]
    if first < 0 or last > w - 1:
        return -1
    usable, base, slope, centre = 0, seed[BACKGROUND], seed[SLOPE], seed[CENTRE]
    for i in range(first, last + 1):
        if mask[i] & MISSING == 0:
            y[i - first] = signal[i] - (base + slope * (i - centre))  # `ground`, which would be read each time
            usable += 1
        else:
            left, right, t = _neighbours(mask, i)
            filled = (1.0 - t) * signal[left] + t * signal[right]
            y[i - first] = filled - ground(seed, (1.0 - t) * left + t * right) if left >= 0 else 0.0
    return usable


@njit(nogil=True, cache=True, error_model="numpy")
def _neighbours(mask: Mask, i: int) -> tuple[int, int, float]:
    """The usable pixels left and right of a gap and where i lies between them, 0 to 1; left -1: there are none."""
    w = mask.shape[0]
    left, right = i - 1, i + 1
    while left >= 0 and mask[left] & MISSING:
        left -= 1
    while right < w and mask[right] & MISSING:
        right += 1
    if left < 0 and right >= w:
        return -1, -1, 0.0
    if left < 0:
        return right, right, 0.0
    if right >= w:
        return left, left, 0.0
    return left, right, (i - left) / (right - left)


@njit(nogil=True, cache=True, error_model="numpy")
def pixel_variance(signal: Float32, floor: Float32, i: int) -> float:
    """Variance of a pixel of a scan line (w,), e-^2: its count and the floor (w,) or (1,)."""
    noise_variance = float(floor[min(i, floor.shape[0] - 1)])
    return float(max(signal[i] + noise_variance, 0.1 * abs(noise_variance)))


@njit(nogil=True, cache=True, error_model="numpy")
def any_saturated(mask: Mask, first: int, last: int) -> bool:
    """Whether a pixel of first..last only says "at least this much"."""
    found = np.uint8(0)
    for i in range(max(first, 0), min(last, mask.shape[0] - 1) + 1):
        found |= mask[i] & np.uint8(SATURATED)
    return bool(found > 0)


@njit(nogil=True, cache=True, error_model="numpy")
def slope_variance(seed: Array, weight: Array, x: Array, n: int) -> float:
    """Variance, by what is unknown of the background's slope, of a position that moves by weight (n,) px/e-."""
    if seed[SLOPE_SIGMA] == 0.0:
        return 0.0
    moment = 0.0
    for i in range(n):
        moment += weight[i] * (x[i] - seed[CENTRE])
    return float((moment * seed[SLOPE_SIGMA]) ** 2)


@njit(nogil=True, cache=True, error_model="numpy")
def position_sigma(pixels: Pixels, y: int, seed: Array, first: int, n: int, weight: Array, out: Array) -> float:
    """Standard deviation of a position that moves by weight[i] px for one electron more in pixel first + i.

    Gaps hand their weight on to the pixels they were filled from. weight (n,) is changed, the correlation length is
    written to out.
    """
    signal, mask, floor = pixels.signal[y], pixels.mask[y], pixels.floor[y]
    x, variance = np.empty(n), np.empty(n)
    for i in range(n):
        pixel = first + i
        if mask[pixel] & MISSING:
            left, right, t = _neighbours(mask, pixel)
            if first <= left < first + n:
                weight[left - first] += (1.0 - t) * weight[i]
            if first <= right < first + n:
                weight[right - first] += t * weight[i]
            weight[i] = 0.0
    for i in range(n):
        pixel = first + i
        x[i], variance[i] = pixel, pixel_variance(signal, floor, pixel)
    noise = write_sigma(pixels, y, seed, x, weight, variance, n, out)
    return math.sqrt(noise * noise + slope_variance(seed, weight, x, n))


@njit(nogil=True, cache=True, error_model="numpy")
def write_peak(seed: Array, u: float, sigma_u: float, out: Array) -> None:
    """A position with the seed's width, amplitude and background -> out (6,)."""
    out[0], out[1] = u, sigma_u
    out[2], out[3], out[4], out[5] = seed[WIDTH], seed[AMPLITUDE], seed[BACKGROUND], np.nan
