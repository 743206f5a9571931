"""Whether a narrow line is all that its pixels hold: by what it leaves over, and by other light to one side of it.

Three pixels hold all of its light, and its width and its place explain nearly anything in them: what tells is the light
that other pixels have, or lack.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from analysis.line.methods.fisher_scoring import solve
from analysis.line.methods.line_profile import ELECTRONS, FLOOR, POSITION, VARIANCE
from analysis.line.methods.misfit import deviate
from analysis.line.methods.seed_loop import Array, Pixels

UNEXPLAINED = 6.0
"""Standard normal deviate from which no narrow line explains its pixels: a chi-square of 50 at three degrees of
freedom, of which the deviate is known less well than of many."""
JUDGED = 0.01
"""Relative variance of the light from which no fit is judged: what scintillates strongly keeps to no profile."""
GROUND = 5.0
"""Widths of the line, and half a pixel more, beside which pixels hold none of its light, by which it is judged where
it scintillates."""
BESIDE = 1.5
"""px; other light is looked for at about this distance: farther off it is a peak by itself, nearer it is width."""
ROUNDING = 1e-9
"""Relative; where a line is within one pixel, its place and its width do the same to the pixels."""


@njit(nogil=True, cache=True, error_model="numpy")
def fill_variances(pixel: Array, n: int, p: Array, light: Array, scattered: float) -> float:
    """Variances of pixels (4, n) by the light (n,) of a line p (4,) -> pixel; returns chi-square.

    scattered: variance of the light over its squared mean.
    """
    chi2 = 0.0
    for i in range(n):
        mu, floor = light[i] + p[3], pixel[FLOOR, i]
        pixel[VARIANCE, i] = max(mu + floor, 0.1 * abs(floor)) + scattered * light[i] * light[i]
        chi2 += (pixel[ELECTRONS, i] - mu) ** 2 / pixel[VARIANCE, i]
    return chi2


@njit(nogil=True, cache=True, error_model="numpy")
def unexplained(pixels: Pixels, pixel: Array, n: int, p: Array, light: Array, chi2: float) -> float:
    """Reduced chi-square of a narrow line p whose pixels (4, n) it does not explain, with its light (n,); else 1.

    Where the light scintillates, as grains of speckle smaller than a pixel do, only the ground beside it is judged.
    """
    freedom = n - 4
    if pixels.covariances.shape[1] > 0 and pixels.covariances[0, 0] >= JUDGED:
        chi2, freedom = 0.0, -1
        for i in range(n):
            if abs(pixel[POSITION, i] - p[1]) > GROUND * p[2] + 0.5:
                mu, floor = light[i] + p[3], pixel[FLOOR, i]
                chi2 += (pixel[ELECTRONS, i] - mu) ** 2 / max(mu + floor, 0.1 * abs(floor))
                freedom += 1
    if freedom < 1 or deviate(chi2, freedom) < UNEXPLAINED:
        return 1.0
    return max(chi2 / freedom, 1.0)


@njit(nogil=True, cache=True, error_model="numpy")
def light_beside(pixel: Array, n: int, p: Array, held: bool, shape: Array) -> float:
    """Score test for light to the right of a narrow line p (4,) rather than to its left: a normal deviate where it is
    alone.

    Of pixels (4, n) with their variances and the profile shape (3, n). What amplitude, place, width, unless held, and
    background may explain is taken off, so that they need not be those of a maximum.
    """
    hessian, score, cross = np.zeros((4, 4)), np.zeros(4), np.zeros(4)
    row, solved = np.empty(4), np.empty(4)
    moment = square = 0.0
    for i in range(n):
        x = pixel[POSITION, i] - p[1]
        row[0], row[1], row[2], row[3] = shape[0, i], p[0] * shape[1, i], 0.0 if held else p[0] * shape[2, i], 1.0
        left, weight = pixel[ELECTRONS, i] - p[0] * shape[0, i] - p[3], 1.0 / pixel[VARIANCE, i]
        side = x * math.exp(-0.5 * (x / BESIDE) ** 2)
        moment += weight * side * left
        square += weight * side * side
        for j in range(4):
            cross[j] += weight * side * row[j]
            score[j] += weight * left * row[j]
            for k in range(4):
                hessian[j, k] += weight * row[j] * row[k]
    if held:
        hessian[2, 2] = 1.0
    if not solve(hessian, ROUNDING, cross, np.zeros((4, 4)), solved):
        return 0.0
    for j in range(4):
        moment -= solved[j] * score[j]
        square -= solved[j] * cross[j]
    return moment / math.sqrt(square) if square > 0.0 else 0.0
