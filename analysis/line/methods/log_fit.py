"""A parabola fitted to the logarithm of the line: Caruana's unweighted fit and Guo's iterated weights.

    minimise  sum w^2 (ln y - (a + b x + c x^2))^2,   u = -b / 2c,   sigma^2 = -1 / 2c

Caruana, Searle, Heller & Shupack, Anal. Chem. 58 (1986): w = 1. Guo, IEEE Signal Process. Mag. 28 (2011), eq. 9 to 12:
w = y at first, then the fitted model, which makes it equal to least squares on y itself. Both need pixels above the
background; saturated ones are left out.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from analysis.line.detection.detect import AMPLITUDE, BACKGROUND, PLATEAU, REACH, WIDTH
from analysis.line.methods.scintillation import write_sigma
from analysis.line.methods.seed_loop import Array, Mask, Options, Pixels, peak_kernel
from analysis.line.methods.window import brightest, ground, pixel_variance, slope_variance
from analysis.line.result import Flag
from render.base.arrays import Float32

CARUANA, GUO = range(2)
"""Variants."""
FRACTION = 0.2
"""Caruana takes the pixels above this part of the brightest, and its two neighbours in any case."""
WINDOW = 3.0
"""Guo takes the pixels within so many sigmas that are above the background."""
ITERATIONS = 12
STEADY = 0.3
"""Relative noise of a pixel at Caruana's level above which its logarithm leans, and no sigma is reported."""
NARROWEST = 0.55
"""px; for narrower lines sampled logarithms bend, and no sigma is reported."""


@njit(nogil=True, cache=True, error_model="numpy")
def _parabola(x: Array, z: Array, weight: Array, n: int, p: Array, inverse: Array) -> bool:
    """Weighted fit of z (n,) by p[0] + p[1] x + p[2] x^2, with the inverse (3, 3) of the normal matrix."""
    m0 = m1 = m2 = m3 = m4 = r0 = r1 = r2 = 0.0
    for i in range(n):
        w = weight[i]
        x2 = x[i] * x[i]
        m0 += w
        m1 += w * x[i]
        m2 += w * x2
        m3 += w * x2 * x[i]
        m4 += w * x2 * x2
        r0 += w * z[i]
        r1 += w * z[i] * x[i]
        r2 += w * z[i] * x2
    c00, c01, c02 = m2 * m4 - m3 * m3, m2 * m3 - m1 * m4, m1 * m3 - m2 * m2
    determinant = m0 * c00 + m1 * c01 + m2 * c02
    if not abs(determinant) > 1e-12 * m0 * m2 * m4:
        return False
    c11, c12, c22 = m0 * m4 - m2 * m2, m1 * m2 - m0 * m3, m0 * m2 - m1 * m1
    inverse[0, 0], inverse[0, 1], inverse[0, 2] = c00 / determinant, c01 / determinant, c02 / determinant
    inverse[1, 0], inverse[1, 1], inverse[1, 2] = c01 / determinant, c11 / determinant, c12 / determinant
    inverse[2, 0], inverse[2, 1], inverse[2, 2] = c02 / determinant, c12 / determinant, c22 / determinant
    for j in range(3):
        p[j] = inverse[j, 0] * r0 + inverse[j, 1] * r1 + inverse[j, 2] * r2
    return True


@njit(nogil=True, cache=True, error_model="numpy")
def _run(signal: Float32, mask: Mask, top: int, half: int, seed: Array, level: float) -> tuple[int, int]:
    """First and last pixel of the run around `top` that is a level above the background, one at least either side."""
    first, last, w = top, top, signal.shape[0]
    while first > max(0, top - half) and (mask[first - 1] or signal[first - 1] - ground(seed, first - 1) > level):
        first -= 1
    while last < min(w - 1, top + half) and (mask[last + 1] or signal[last + 1] - ground(seed, last + 1) > level):
        last += 1
    return min(first, top - 1), max(last, top + 1)


@njit(nogil=True, cache=True, error_model="numpy")
def _reweight(x: Array, z: Array, weight: Array, n: int, p: Array, inverse: Array) -> bool:
    """Guo's iteration: fit again with the square of the fitted model as weight, until the centre rests."""
    last = np.inf
    for _ in range(ITERATIONS):
        u = -0.5 * p[1] / p[2]
        if abs(u - last) < 1e-5:
            break
        last = u
        highest = p[0] - 0.25 * p[1] * p[1] / p[2]
        for i in range(n):
            weight[i] = math.exp(2.0 * (p[0] + (p[1] + p[2] * x[i]) * x[i] - highest))
        if not (_parabola(x, z, weight, n, p, inverse) and p[2] < 0.0):
            return False
    return True


@njit(nogil=True, cache=True, error_model="numpy")
def _influence(x: Array, y: Array, n: int, p: Array, inverse: Array, guo: bool, weight: Array) -> None:
    """weight (n,) of the fit -> how far the centre moves for one electron more in each pixel."""
    u = -0.5 * p[1] / p[2]
    for i in range(n):
        d1 = inverse[1, 0] + (inverse[1, 1] + inverse[1, 2] * x[i]) * x[i]
        d2 = inverse[2, 0] + (inverse[2, 1] + inverse[2, 2] * x[i]) * x[i]
        # du = -(db + 2 u dc) / 2c, and ln y moves by 1 / y (by 1 / model where the weights are its square)
        model = math.exp(p[0] + (p[1] + p[2] * x[i]) * x[i]) if guo else y[i]
        weight[i] *= -(d1 + 2.0 * u * d2) / (2.0 * p[2] * model)


@peak_kernel
def measure_log_parabola(pixels: Pixels, row: int, seed: Array, flag: int, options: Options, out: Array) -> int:
    """Peak kernel (`seed_loop`). options.variant: CARUANA or GUO."""
    signal, mask, floor, w = pixels.signal[row], pixels.mask[row], pixels.floor[row], pixels.signal.shape[1]
    x, y, z, weight, variance = pixels.room[0], pixels.room[1], pixels.room[2], pixels.room[3], pixels.room[4]
    p, inverse, guo, base = np.empty(3), np.empty((3, 3)), options.variant == GUO, seed[BACKGROUND]
    top = brightest(signal, mask, seed)
    if top < 1 or top > w - 2:
        return Flag.AT_BORDER.value
    half = max(1, math.ceil(min(WINDOW * seed[WIDTH] + seed[PLATEAU], seed[REACH])))
    level = 0.0 if guo else FRACTION * max(signal[top] - ground(seed, top), 0.0)
    first, last = (top - half, top + half) if guo else _run(signal, mask, top, half, seed, level)
    count = 0
    for i in range(max(0, first), min(w - 1, last) + 1):
        value = signal[i] - ground(seed, i)
        if mask[i] == 0 and (value > level or (value > 0.0 and abs(i - top) < 2)):
            x[count], y[count], z[count] = i - top, value, math.log(value)
            variance[count] = pixel_variance(signal, floor, i)
            weight[count] = value * value if guo else 1.0
            count += 1
    if count < 3:
        return Flag.TOO_FEW_PIXELS.value
    if not (_parabola(x, z, weight, count, p, inverse) and p[2] < 0.0):
        return Flag.NOT_CONVERGED.value
    if guo and not _reweight(x, z, weight, count, p, inverse):
        return Flag.NOT_CONVERGED.value
    u = -0.5 * p[1] / p[2]
    if abs(u) > half:
        return Flag.OUT_OF_WINDOW.value
    sigma = np.nan
    weakest = FRACTION * seed[AMPLITUDE]
    dark = max(base + float(floor[min(top, floor.shape[0] - 1)]), 0.0)
    if seed[WIDTH] >= NARROWEST and (guo or math.sqrt(weakest + dark) < STEADY * weakest):
        _influence(x, y, count, p, inverse, guo, weight)
        for i in range(count):
            x[i] += top
        noise = write_sigma(pixels, row, seed, x, weight, variance, count, out)
        sigma = math.sqrt(noise * noise + slope_variance(seed, weight, x, count))
    out[0], out[1] = top + u, sigma
    out[2], out[3], out[4] = math.sqrt(-0.5 / p[2]), math.exp(p[0] - 0.25 * p[1] * p[1] / p[2]), base
    return flag
