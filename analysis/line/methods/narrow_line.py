"""The position of a line that is too narrow for its pixels: mean and standard deviation of the posterior.

    p(c, s | y)  ~  L(y | A(c, s), c, s, b) s / sqrt(I_AA)  p(s)    c within a pixel of the fit, s from 0.02 px

A line that hardly reaches the pixels beside its own leaves the likelihood flat over a part of the pixel, and its width
decides how far: no Gaussian about the maximum describes that (Winick, JOSA A 3, 1986: the bound diverges below 0.3 px).
The light, A s, is profiled out, Laplace's factor standing for its share of the volume. The prior is even in the light
and in c; in s it is even on the first look, and on the second what the neighbouring scan lines say of the width that
they share (`shared_width`).
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from analysis.line.detection.detect import PRIOR_WIDTHS
from analysis.line.methods.line_profile import ELECTRONS, FLOOR, POSITION, ROOT_HALF, ROOT_HALF_PI, profile
from analysis.line.methods.seed_loop import Array

NARROWEST = 0.2
"""px; the narrowest line that is fitted: of a narrower one hardly a pixel tells where it is."""
COARSE = 0.5
"""px; a narrower line may not let a fit say how wide it is."""
CENTRES, WIDTHS = 13, 9
"""Points of a grid."""
LOOKS, RESOLVED, RESOLVED_PLACE = 4, 0.5, 2.0
"""Grids at most, and variance over squared step from which one resolves the posterior of the width and of the place."""
FARTHEST = 0.8
"""px on either side of where the fit, or the seed, has the centre."""
BESIDE = 0.1
"""px; a line of the next width on the grid is no farther off."""
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
    total = math.log(p[2]) - 0.5 * math.log(max(information, 1e-300))
    for i in range(first, last):
        m = max(p[0] * shape[i] + p[3] + floor[i], 0.1 * floor[i])
        total += (y[i] + floor[i]) * math.log(m) - m - dark[i]
    return total


@njit(nogil=True, cache=True, error_model="numpy")
def _over_places(
    pixel: Array, n: int, p: Array, low: float, high: float, integrated: bool, room: Array
) -> tuple[float, float, float, float]:
    """Of a line as wide as p[2] between two places: logarithm of the likelihood at the best place and over all of them,
    mean and variance of the place. p (4,), amplitude and background, is changed; room as in `_log_likelihood`."""
    x, y, floor, log = pixel[POSITION], pixel[ELECTRONS], pixel[FLOOR], np.empty(CENTRES)
    amplitude, first, last = p[0], low, high
    best = total = mean = variance = step = 0.0
    for attempt in range(LOOKS):  # over all that is possible, then over where it is likely
        step, best = (high - low) / (CENTRES - 1), -np.inf
        for i in range(CENTRES):
            p[0], p[1] = amplitude, low + i * step
            log[i] = _log_likelihood(x, y, floor, n, p, integrated, room)
            best = max(best, log[i])
        total = mean = variance = 0.0
        for i in range(CENTRES):
            weight, apart = math.exp(log[i] - best), low + i * step - first
            total += weight
            mean += weight * apart
            variance += weight * apart * apart
        mean /= total
        # a cell of the grid is as wide as its step: its own variance keeps a narrow peak from vanishing
        variance = max(variance / total - mean * mean, 0.0) + step * step / 12.0
        if attempt == LOOKS - 1 or variance > RESOLVED_PLACE * step * step:
            break
        reach = 4.0 * math.sqrt(variance)
        low, high = max(first + mean - reach, first), min(first + mean + reach, last)
    return best, best + math.log(total * step), first + mean, variance


@njit(nogil=True, cache=True, error_model="numpy")
def _prior_at(prior: Array, s: float) -> float:
    """The prior (m,) of PRIOR_WIDTHS at a width between two of them, by the parabola through the nearest three: a
    straight line would prefer the steps."""
    j = 1
    while j < prior.shape[0] - 2 and PRIOR_WIDTHS[j] + PRIOR_WIDTHS[j + 1] < 2.0 * s:
        j += 1
    left, middle, right = PRIOR_WIDTHS[j - 1], PRIOR_WIDTHS[j], PRIOR_WIDTHS[j + 1]
    below, above = (prior[j] - prior[j - 1]) / (middle - left), (prior[j + 1] - prior[j]) / (right - middle)
    return float(prior[j] + (s - middle) * (below + (s - left) * (above - below) / (right - left)))


@njit(nogil=True, cache=True, error_model="numpy")
def _over_widths(
    pixel: Array, n: int, p: Array, widths: Array, prior: Array, integrated: bool, room: Array, told: Array
) -> tuple[float, float, float, float, float]:
    """Mean and variance of the place, and of the width, and their covariance, over some widths (m,); told (2, m):
    `_over_places` of each."""
    m, centre = widths.shape[0], p[1]
    place, spread, log = np.empty(m), np.empty(m), np.empty(m)
    trial = p.copy()
    best = -np.inf
    low, high = centre - FARTHEST, centre + FARTHEST
    for j in range(m - 1, -1, -1):  # a narrower line is near where the wider one is, at a place that is more exact
        trial[0], trial[2] = p[0], widths[j]
        told[0, j], told[1, j], place[j], spread[j] = _over_places(pixel, n, trial, low, high, integrated, room)
        reach = 4.0 * math.sqrt(spread[j]) + BESIDE
        low, high = max(place[j] - reach, centre - FARTHEST), min(place[j] + reach, centre + FARTHEST)
        left, right = widths[max(j - 1, 0)], widths[min(j + 1, m - 1)]
        log[j] = told[1, j] + _prior_at(prior, widths[j]) + math.log(right - left)
        best = max(best, log[j])
    total = mean = square = mean_s = square_s = both = 0.0
    for j in range(m):
        weight, apart = math.exp(log[j] - best), place[j] - centre
        total += weight
        mean += weight * apart
        square += weight * (apart * apart + spread[j])
        mean_s += weight * widths[j]
        square_s += weight * widths[j] * widths[j]
        both += weight * apart * widths[j]
    mean, mean_s = mean / total, mean_s / total
    variance, variance_s = square / total - mean * mean, square_s / total - mean_s * mean_s
    return centre + mean, max(variance, 0.0), mean_s, max(variance_s, 0.0), both / total - mean * mean_s


@njit(nogil=True, cache=True, error_model="numpy")
def posterior(
    pixel: Array, n: int, p: Array, known_width: bool, integrated: bool, shape: Array, prior: Array, told: Array
) -> tuple[float, float]:
    """Pixels (4, n) of a fit p (4,), amplitude, centre, width, background -> sigma_u, covariance of centre and width.

    p becomes the posterior's mean; the background stays. known_width: p[2] is held. shape (3, n): the profile on
    return. prior (m,): logarithm of the prior at PRIOR_WIDTHS. told (2, m): what the pixels say of each, at the best
    place and over all.
    """
    floor = pixel[FLOOR]
    for i in range(n):
        m = max(p[3] + floor[i], 0.1 * floor[i])
        shape[1, i] = (pixel[ELECTRONS, i] + floor[i]) * math.log(m) - m
    trial = p.copy()
    both = 0.0
    if known_width:
        _, _, p[1], variance = _over_places(pixel, n, trial, p[1] - FARTHEST, p[1] + FARTHEST, integrated, shape)
    else:
        mean, variance, width, spread, both = _over_widths(pixel, n, p, PRIOR_WIDTHS, prior, integrated, shape, told)
        highest = 0.0
        for j in range(PRIOR_WIDTHS.shape[0]):
            highest = max(highest, told[0, j]) if j > 0 else told[0, j]
        for j in range(PRIOR_WIDTHS.shape[0]):
            told[0, j], told[1, j] = told[0, j] - highest, told[1, j] - highest
        step, fine, unused = PRIOR_WIDTHS[1] - PRIOR_WIDTHS[0], np.empty(WIDTHS), np.empty((2, WIDTHS))
        for _ in range(LOOKS):
            if spread > RESOLVED * step * step:
                break
            reach = 4.0 * math.sqrt(spread + step * step / 12.0)
            low = max(width - reach, PRIOR_WIDTHS[0])
            step = (width + reach - low) / (WIDTHS - 1)
            for j in range(WIDTHS):
                fine[j] = low + j * step
            mean, variance, width, spread, both = _over_widths(pixel, n, p, fine, prior, integrated, shape, unused)
        p[1], p[2] = mean, width
    trial[0], trial[1], trial[2] = p[0], p[1], p[2]
    _log_likelihood(pixel[POSITION], pixel[ELECTRONS], floor, n, trial, integrated, shape)
    p[0] = trial[0]
    profile(pixel[POSITION], n, p[1], p[2], integrated, shape)
    return math.sqrt(variance), both


@njit(nogil=True, cache=True, error_model="numpy")
def width_spread(told: Array) -> float:
    """Standard deviation, px, of a width whose likelihood at PRIOR_WIDTHS has the logarithm told (m,)."""
    m, total, mean, square = told.shape[0], 0.0, 0.0, 0.0
    for j in range(m):
        weight = math.exp(told[j]) * (PRIOR_WIDTHS[min(j + 1, m - 1)] - PRIOR_WIDTHS[max(j - 1, 0)])
        total += weight
        mean += weight * PRIOR_WIDTHS[j]
        square += weight * PRIOR_WIDTHS[j] ** 2
    return math.sqrt(max(square / total - (mean / total) ** 2, 0.0))


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
