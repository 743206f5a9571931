"""The position of a line that is too narrow for its pixels: mean and standard deviation of the posterior.

    p(c, s | y)  ~  L(y | A(c, s), c, s, b) / sqrt(I_AA)  exp(k s + q s^2)    c within a pixel of the fit, s from 0.2 px

A line that hardly reaches the pixels beside its own leaves the likelihood flat over a part of the pixel, and its width
decides how far: no Gaussian about the maximum describes that (Winick, JOSA A 3, 1986: the bound diverges below 0.3 px).
The amplitude is profiled out, Laplace's factor standing for its share of the volume. The prior is even in c; in s it is
even on the first look (k = q = 0), and on the second what the neighbouring scan lines say of the width that they share
(`shared_width`).
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from analysis.line.methods.line_profile import ELECTRONS, FLOOR, POSITION, ROOT_HALF, ROOT_HALF_PI, profile
from analysis.line.methods.seed_loop import Array

NARROWEST = 0.2
"""px; no lens draws a narrower line: that is Airy's disc of f/2.8 on pixels of 3 um."""
COARSE = 0.5
"""px; a narrower line may not let a fit say how wide it is."""
CENTRES, WIDTHS = 13, 7
"""Points of the grid; 41 x 13 change sigma by less than 2 %."""
FIRST_CENTRES, FIRST_WIDTHS = 13, 3
"""Of the first, wide grid, which only finds where the second one belongs."""
LOOKS, RESOLVED = 4, 0.5
"""Grids at most, and variance over squared step from which one resolves the posterior."""
FARTHEST = 0.8
"""px on either side of where the fit, or the seed, has the centre."""
WIDEST = 0.8
"""px; a wider line is resolved."""
STEEP = 5.5
"""Sigmas from which on the error function is 1 to 4e-8."""


@njit(nogil=True, cache=True, error_model="numpy")
def _light(x: Array, n: int, centre: float, sigma: float, integrated: bool, out: Array) -> tuple[int, int]:
    """As `profile`, the profile alone -> out (n,), and the first and last but one pixel that it reaches."""
    first, last = n, 0
    before, edge_before = -1e300, 0.0
    for i in range(n):
        left, right = (x[i] - 0.5 - centre) / sigma, (x[i] + 0.5 - centre) / sigma
        if left > STEEP or right < -STEEP:
            out[i] = 0.0
            continue
        if not integrated:
            z = (x[i] - centre) / sigma
            out[i] = math.exp(-0.5 * z * z)
        else:
            edge_left = edge_before if x[i] - before == 1.0 else math.erf(left * ROOT_HALF)
            edge_before, before = math.erf(right * ROOT_HALF), x[i]
            out[i] = sigma * ROOT_HALF_PI * (edge_before - edge_left)
        first, last = min(first, i), i + 1
    return first, last


@njit(nogil=True, cache=True, error_model="numpy")
def _log_likelihood(x: Array, y: Array, floor: Array, n: int, p: Array, integrated: bool, room: Array) -> float:
    """Of the centre and width in p (4,), with the amplitude that fits best; p[0] is that amplitude on return.

    room (2, n): the profile, and in the second row what a pixel without light gives.
    """
    shape, dark = room[0], room[1]
    first, last = _light(x, n, p[1], p[2], integrated, shape)
    if last == 0:
        return -np.inf
    information = 0.0
    for _ in range(2):  # the weights of the second are those of the amplitude of the first
        moment = information = 0.0
        for i in range(first, last):
            g = shape[i]
            weight = 1.0 / max(p[0] * g + p[3] + floor[i], 0.1 * floor[i])
            moment += weight * g * (y[i] - p[3])
            information += weight * g * g
        p[0] = max(moment / max(information, 1e-300), 0.0)
    total = -0.5 * math.log(max(information, 1e-300))
    for i in range(first, last):
        m = max(p[0] * shape[i] + p[3] + floor[i], 0.1 * floor[i])
        total += (y[i] + floor[i]) * math.log(m) - m - dark[i]
    return total


@njit(nogil=True, cache=True, error_model="numpy")
def _parabola(s: Array, mass: Array, n: int, told: Array) -> None:
    """The logarithm of mass (n,) at widths s (n,) as k s + q s^2 and a constant, by weighted least squares -> told."""
    told[:] = 0.0
    total = mean = 0.0
    for j in range(n):
        total += mass[j]
        mean += mass[j] * s[j]
    mean /= total
    moments, right = np.zeros(5), np.zeros(3)
    for j in range(n):
        weight, t = mass[j] / total, (s[j] - mean) / (s[n - 1] - s[0])
        if weight < 1e-9:
            continue
        value, power = math.log(weight), 1.0
        for k in range(5):
            moments[k] += weight * power
            if k < 3:
                right[k] += weight * power * value
            power *= t
    a, b, c, d, e = moments[0], moments[1], moments[2], moments[3], moments[4]
    determinant = a * (c * e - d * d) - b * (b * e - c * d) + c * (b * d - c * c)
    if not determinant > 1e-12:
        return
    slope = a * (right[1] * e - d * right[2]) - right[0] * (b * e - c * d) + c * (b * right[2] - right[1] * c)
    bend = a * (c * right[2] - right[1] * d) - b * (b * right[2] - right[1] * c) + right[0] * (b * d - c * c)
    scale = s[n - 1] - s[0]
    slope, bend = slope / determinant / scale, bend / determinant / (scale * scale)
    told[0], told[1] = slope - 2.0 * bend * mean, bend


@njit(nogil=True, cache=True, error_model="numpy")
def posterior(pixel: Array, n: int, p: Array, known_width: bool, integrated: bool, shape: Array, told: Array) -> float:
    """Pixels (4, n) of a fit p (4,), amplitude, centre, width, background -> sigma_u.

    p becomes the posterior's mean; the background stays. known_width: p[2] is held. shape (3, n): the profile on
    return. told (2,): k and q of the prior; of an even one, what the pixels say instead on return.
    """
    x, y, floor = pixel[POSITION], pixel[ELECTRONS], pixel[FLOOR]
    amplitude, middle, even = p[0], p[1], told[0] == 0.0 and told[1] == 0.0
    trial, log, widths, mass = np.empty(4), np.empty((WIDTHS, CENTRES)), np.empty(WIDTHS), np.empty(WIDTHS)
    for i in range(n):
        m = max(p[3] + floor[i], 0.1 * floor[i])
        shape[1, i] = (y[i] + floor[i]) * math.log(m) - m
    low_width, high = p[2], WIDEST
    if not known_width:
        low_width = NARROWEST
        if told[1] < 0.0:
            spread = math.sqrt(-0.5 / told[1])
            low_width = min(max(-0.5 * told[0] / told[1] - 3.0 * spread, NARROWEST), WIDEST - 0.1)
            high = min(max(-0.5 * told[0] / told[1] + 3.0 * spread, low_width + 0.02), WIDEST)
    reach, span, low = FARTHEST, high - low_width, middle - FARTHEST
    columns, rows = FIRST_CENTRES, 1 if known_width else FIRST_WIDTHS
    mean_c = mean_s = var_c = var_s = 0.0
    for attempt in range(LOOKS):  # over all that is possible, then over where it is likely
        step, step_s = 2.0 * reach / (columns - 1), span / (rows - 1) if rows > 1 else 0.0
        best = -np.inf
        for j in range(rows):
            widths[j] = low_width + j * step_s
            for i in range(columns):
                trial[0], trial[1], trial[2], trial[3] = amplitude, low + i * step, widths[j], p[3]
                log[j, i] = _log_likelihood(x, y, floor, n, trial, integrated, shape)
                log[j, i] += (told[0] + told[1] * widths[j]) * widths[j]
                best = max(best, log[j, i])
        total = mean_c = mean_s = var_c = var_s = 0.0
        for j in range(rows):
            mass[j] = 0.0
            for i in range(columns):
                weight = math.exp(log[j, i] - best)
                c = low + i * step
                mass[j] += weight
                mean_c += weight * c
                var_c += weight * c * c
            total += mass[j]
            mean_s += mass[j] * widths[j]
            var_s += mass[j] * widths[j] * widths[j]
        mean_c, mean_s = mean_c / total, mean_s / total
        # a cell of the grid is as wide as its step: its own variance keeps a narrow peak from vanishing
        var_c = max(var_c / total - mean_c * mean_c, 0.0) + step * step / 12.0
        var_s = max(var_s / total - mean_s * mean_s, 0.0)
        fine = var_c > RESOLVED * step * step and (rows == 1 or var_s > RESOLVED * step_s * step_s)
        if attempt == LOOKS - 1 or (attempt > 0 and fine):
            break
        reach = min(4.0 * math.sqrt(var_c), reach)
        low = mean_c - reach
        if rows > 1:
            spread = math.sqrt(var_s) + step_s / math.sqrt(12.0)
            high = min(mean_s + 3.0 * spread, high)
            low_width = max(mean_s - 3.0 * spread, low_width)
            span, rows = high - low_width, WIDTHS
        columns = CENTRES
    if even and rows > 1:
        _parabola(widths, mass, rows, told)
    p[1], p[2] = mean_c, mean_s
    trial[0], trial[1], trial[2], trial[3] = amplitude, mean_c, mean_s, p[3]
    _log_likelihood(x, y, floor, n, trial, integrated, shape)
    p[0] = trial[0]
    profile(x, n, mean_c, mean_s, integrated, shape)
    return math.sqrt(var_c)


@njit(nogil=True, cache=True, error_model="numpy")
def weigh_of_known_width(pixel: Array, n: int, p: Array, shape: Array, weight: Array) -> None:
    """How far the centre of a line p (4,) of known width moves for one electron more in each pixel -> weight (n,)."""
    height, cross, place = 0.0, 0.0, 0.0
    for i in range(n):
        variance = max(p[0] * shape[0, i] + p[3] + pixel[FLOOR, i], 0.1 * pixel[FLOOR, i])
        height += shape[0, i] * shape[0, i] / variance
        cross += shape[0, i] * p[0] * shape[1, i] / variance
        place += (p[0] * shape[1, i]) ** 2 / variance
    determinant = max(height * place - cross * cross, 1e-300)
    for i in range(n):
        variance = max(p[0] * shape[0, i] + p[3] + pixel[FLOOR, i], 0.1 * pixel[FLOOR, i])
        weight[i] = (height * p[0] * shape[1, i] - cross * shape[0, i]) / variance / determinant
