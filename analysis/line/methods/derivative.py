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
from numpy.typing import NDArray

from analysis.line.detection.detect import BACKGROUND, CENTRE, PLATEAU, WIDTH
from analysis.line.methods.window import any_saturated, brightest, load_window, position_sigma, write_peak
from analysis.line.result import Flag

Float32 = NDArray[np.float32]
Array = NDArray[np.float64]
Mask = NDArray[np.uint8]

CUT = 4.0
"""The kernel ends at so many of its sigmas."""
NARROWEST = 1.2
"""px; the least sigma of the iterated filter: between the pixels a narrower one sees them one by one."""
HONEST = 0.7
"""px; narrower lines are sampled too coarsely for the filter's zero to follow them, and no sigma is claimed."""
REST = 1e-6
"""px; a shorter step ends the iteration."""

_SATURATED, _AT_BORDER = int(Flag.SATURATED), int(Flag.AT_BORDER)
_NOT_CONVERGED, _OUT_OF_WINDOW = int(Flag.NOT_CONVERGED), int(Flag.OUT_OF_WINDOW)


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
def differentiate_seeds(  # noqa: PLR0913
    signal: Float32,
    mask: Mask,
    floor: Float32,
    seeds: Array,
    flags: Mask,
    scale: float,
    steps: int,
    correlation: Array,
    out: Array,
) -> None:
    """Scan lines (n, w) and seeds (n, k, 6) -> out (n, k, 6): u, sigma_u, width, amplitude, background, NaN.

    scale: sigma_f over the line's sigma. steps: 0 for the linear zero crossing (DoG), else Newton steps at most; with
    1 it is the classical single step. Only the iterated zero claims a sigma.
    """
    w = signal.shape[1]
    y, weight = np.empty(w), np.empty(w)
    for row in range(signal.shape[0]):
        for k in range(seeds.shape[1]):
            for j in range(6):
                out[row, k, j] = np.nan
            if flags[row, k] > _SATURATED:
                continue
            seed = seeds[row, k]
            spread = max(scale * seed[WIDTH], NARROWEST if steps > 1 else 0.3, 0.5 * seed[PLATEAU])
            top = brightest(signal[row], mask[row], seed)
            half = math.ceil(CUT * spread + 1.5 + seed[PLATEAU])
            first, last = max(0, top - half), min(w - 1, top + half)
            reach = spread + seed[WIDTH] + seed[PLATEAU] + 1.0
            if min(top - first, last - top) < 2.0 * spread:
                flags[row, k] = _AT_BORDER
                continue
            n = last - first + 1
            load_window(signal[row], mask[row], first, last, seed[BACKGROUND], y)
            x, rest, slope = float(top - first), False, 0.0
            value, slope = _derivatives(y, n, x, spread, weight)
            side = 1.0 if value > 0.0 else -1.0
            for _ in range(math.ceil(reach) + 1):
                following, slope = _derivatives(y, n, x + side, spread, weight)
                if following * side <= 0.0:
                    x += side * value / (value - following) if value != following else 0.0
                    rest = True
                    break
                value = following
                x += side
            if rest and steps > 0:
                x, rest = float(round(x)), False
                for _ in range(steps):
                    value, slope = _derivatives(y, n, x, spread, weight)
                    if slope >= 0.0:
                        break
                    x -= min(max(value / slope, -spread), spread)
                    rest = abs(value / slope) < REST or steps == 1
                    if rest:
                        break
            if not rest:
                flags[row, k] = _NOT_CONVERGED
                continue
            if abs(first + x - seed[CENTRE]) > reach or (steps > 0 and slope >= 0.0):
                flags[row, k] = _OUT_OF_WINDOW
                continue
            sigma = np.nan
            if steps > 1 and seed[WIDTH] >= HONEST and not any_saturated(mask[row], first, last):
                for i in range(n):
                    weight[i] /= -slope
                sigma = position_sigma(signal[row], mask[row], floor[row], first, n, weight, correlation)
            write_peak(seed, first + x, sigma, out[row, k])
