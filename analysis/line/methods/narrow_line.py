"""The position of a line that is too narrow for its pixels: mean and standard deviation of the posterior.

    p(c, s | y)  ~  L(y | A(c, s), c, s, b) / sqrt(I_AA)        c within a pixel of the fit, s from 0.2 px on

A line that hardly reaches the pixels beside its own leaves the likelihood flat over a part of the pixel, and its width
decides how far: no Gaussian about the maximum describes that (Winick, JOSA A 3, 1986: the bound diverges below 0.3 px).
Prior: even in c and s. The amplitude is profiled out, Laplace's factor standing for its share of the volume.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from analysis.line.methods.line_profile import profile
from analysis.line.methods.seed_loop import Array

NARROWEST = 0.2
"""px; no lens draws a narrower line: that is Airy's disc of f/2.8 on pixels of 3 um."""
CENTRES, WIDTHS = 21, 7
"""Points of the grid; 41 x 13 change sigma by less than 2 %."""
FARTHEST = 0.8
"""px on either side of where the fit, or the seed, has the centre."""
WIDEST = 0.8
"""px; a wider line is resolved."""


@njit(nogil=True, cache=True, error_model="numpy")
def _log_likelihood(x: Array, y: Array, floor: Array, n: int, p: Array, integrated: bool, shape: Array) -> float:
    """Of the centre and width in p (4,), with the amplitude that fits best; p[0] is that amplitude on return."""
    profile(x, n, p[1], p[2], integrated, shape)
    information = 0.0
    for _ in range(2):  # the weights of the second are those of the amplitude of the first
        moment = information = 0.0
        for i in range(n):
            g = shape[0, i]
            weight = 1.0 / max(p[0] * g + p[3] + floor[i], 0.1 * floor[i])
            moment += weight * g * (y[i] - p[3])
            information += weight * g * g
        p[0] = max(moment / max(information, 1e-300), 0.0)
    total = -0.5 * math.log(max(information, 1e-300))
    for i in range(n):
        m = max(p[0] * shape[0, i] + p[3] + floor[i], 0.1 * floor[i])
        total += (y[i] + floor[i]) * math.log(m) - m
    return total


@njit(nogil=True, cache=True, error_model="numpy")
def posterior(
    x: Array, y: Array, floor: Array, n: int, p: Array, known_width: bool, integrated: bool, shape: Array
) -> float:
    """Pixels (n,) and a fit p (4,), amplitude, centre, width, background -> sigma_u.

    p becomes the posterior's mean; the background stays. known_width: p[2] is held.
    """
    amplitude, middle = p[0], p[1]
    trial, log = np.empty(4), np.empty((WIDTHS, CENTRES))
    rows = 1 if known_width else WIDTHS
    best = -np.inf
    reach, span = FARTHEST, WIDEST - NARROWEST
    low_width, low = p[2] if known_width else NARROWEST, middle - reach
    mean_c = mean_s = var_c = var_s = 0.0
    for attempt in range(2):  # over all that is possible, then over where it is likely
        step = 2.0 * reach / (CENTRES - 1)
        best = -np.inf
        for j in range(rows):
            for i in range(CENTRES):
                trial[0], trial[3] = amplitude, p[3]
                trial[1], trial[2] = low + i * step, low_width + (j * span / (WIDTHS - 1) if rows > 1 else 0.0)
                log[j, i] = _log_likelihood(x, y, floor, n, trial, integrated, shape)
                best = max(best, log[j, i])
        total = mean_c = mean_s = var_c = var_s = 0.0
        for j in range(rows):
            for i in range(CENTRES):
                weight = math.exp(log[j, i] - best)
                c, s = low + i * step, low_width + (j * span / (WIDTHS - 1) if rows > 1 else 0.0)
                total += weight
                mean_c += weight * c
                mean_s += weight * s
                var_c += weight * c * c
                var_s += weight * s * s
        mean_c, mean_s = mean_c / total, mean_s / total
        # a cell of the grid is as wide as its step: its own variance keeps a narrow peak from vanishing
        var_c = max(var_c / total - mean_c * mean_c, 0.0) + step * step / 12.0
        var_s = max(var_s / total - mean_s * mean_s, 0.0)
        if attempt == 0:
            reach = min(4.0 * math.sqrt(var_c), FARTHEST)
            low = mean_c - reach
            if rows > 1:
                spread = math.sqrt(var_s) + span / (WIDTHS - 1) / math.sqrt(12.0)
                high = min(mean_s + 3.0 * spread, WIDEST)
                low_width = max(mean_s - 3.0 * spread, NARROWEST)
                span = high - low_width
    p[1], p[2] = mean_c, mean_s
    trial[0], trial[1], trial[2], trial[3] = amplitude, mean_c, mean_s, p[3]
    _log_likelihood(x, y, floor, n, trial, integrated, shape)
    p[0] = trial[0]
    return math.sqrt(var_c)
