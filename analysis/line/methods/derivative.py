"""Zeros of the line's derivative under a Gaussian: the sampled zero crossing (DoG), and Steger's Newton steps.

    r'(x) = sum f(i) g'(x - i),   r''(x) = sum f(i) g''(x - i),   g a Gaussian of sigma_f

DoG: linear between the two pixels where r' changes sign. Steger, PAMI 20 (1998), section 2: t = -r'/r'' from a pixel;
one step leaves a bias locked to the pixels (0.07 px at s = 1), so that the steps go on, on the convolution between the
pixels, until they rest. The iterated zero is that of the continuous convolution, and has an honest sigma.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from analysis.line.detection.detect import CENTRE, PLATEAU, WIDTH
from analysis.line.methods.seed_loop import Array, Options, Pixels, peak_kernel
from analysis.line.methods.window import any_saturated, brightest, load_window, position_sigma, write_peak
from analysis.line.result import Flag

CUT = 4.0
"""The kernel ends at so many of its sigmas."""
NARROWEST = 1.2
"""px; the least sigma of the iterated filter: between the pixels a narrower one sees them one by one."""
HONEST = 0.7
"""px; narrower lines are sampled too coarsely for the filter's zero to follow them, and no sigma is reported."""
REST = 1e-6
"""px; a shorter step ends the iteration."""
ZERO_CROSSING, STEGER = 0, 50
"""Variants: Newton steps at most on the continuous convolution; none, for the zero between two pixels."""


@njit(nogil=True, cache=True, error_model="numpy")
def _derivatives(y: Array, n: int, x: float, spread: float, weight: Array) -> tuple[float, float]:
    """r' and r'' at x of pixels 0..n-1, with the taps of r' -> weight (n,)."""
    first, second = 0.0, 0.0
    inverse = 1.0 / (spread * spread)
    for i in range(n):
        d = x - i
        g = math.exp(-0.5 * d * d * inverse)
        weight[i] = -d * inverse * g
        first += y[i] * weight[i]
        second += y[i] * (d * d * inverse - 1.0) * inverse * g
    return first, second


@njit(nogil=True, cache=True, error_model="numpy")
def _cross(y: Array, n: int, x: float, reach: float, spread: float, weight: Array) -> tuple[float, float, bool]:
    """From pixel x uphill to where r' changes sign -> the zero, linear between two pixels, r'' there, whether found."""
    value, slope = _derivatives(y, n, x, spread, weight)
    side = 1.0 if value > 0.0 else -1.0
    for _ in range(math.ceil(reach) + 1):
        following, slope = _derivatives(y, n, x + side, spread, weight)
        if following * side <= 0.0:
            x += side * value / (value - following) if value != following else 0.0
            return x, slope, True
        value = following
        x += side
    return x, slope, False


@njit(nogil=True, cache=True, error_model="numpy")
def _iterate(y: Array, n: int, x: float, spread: float, steps: int, weight: Array) -> tuple[float, float, bool]:
    """Newton steps from x to the zero of r' -> the zero, r'' there, whether they came to rest; a single one does."""
    slope = 0.0
    for _ in range(steps):
        value, slope = _derivatives(y, n, x, spread, weight)
        if slope >= 0.0:
            break
        x -= min(max(value / slope, -spread), spread)
        if abs(value / slope) < REST or steps == 1:
            return x, slope, True
    return x, slope, False


@peak_kernel
def measure_derivative_zero(pixels: Pixels, y: int, seed: Array, flag: int, options: Options, out: Array) -> int:
    """Peak kernel (`seed_loop`). options.variant: ZERO_CROSSING, STEGER or 1, Steger's single step.

    A sigma only of the iterated zero.
    """
    signal, mask, window, weight = pixels.signal[y], pixels.mask[y], pixels.room[0], pixels.room[1]
    steps = options.variant
    spread = max(options.filter_scale * seed[WIDTH], NARROWEST if steps > 1 else 0.3, 0.5 * seed[PLATEAU])
    top = brightest(signal, mask, seed)
    half = math.ceil(CUT * spread + 1.5 + seed[PLATEAU])
    first, last = max(0, top - half), min(signal.shape[0] - 1, top + half)
    reach = spread + seed[WIDTH] + seed[PLATEAU] + 1.0
    if min(top - first, last - top) < 2.0 * spread:
        return Flag.AT_BORDER.value
    n = last - first + 1
    load_window(signal, mask, first, last, seed, window)
    x, slope, found = _cross(window, n, float(top - first), reach, spread, weight)
    if found and steps > 0:
        x, slope, found = _iterate(window, n, float(round(x)), spread, steps, weight)
    if not found:
        return Flag.NOT_CONVERGED.value
    if abs(first + x - seed[CENTRE]) > reach or (steps > 0 and slope >= 0.0):
        return Flag.OUT_OF_WINDOW.value
    sigma = np.nan
    if steps > 1 and seed[WIDTH] >= HONEST and not any_saturated(mask, first, last):
        for i in range(n):
            weight[i] /= -slope
        sigma = position_sigma(pixels, y, seed, first, n, weight, out)
    write_peak(seed, first + x, sigma, out)
    return flag
