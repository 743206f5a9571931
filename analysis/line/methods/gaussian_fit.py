"""A Gaussian fitted to each seed, saturated pixels left out: least squares or maximum likelihood, by Fisher scoring.

The likelihood is the shifted Poisson of shot plus read noise: y + r^2 ~ Poisson(mu + r^2), whose score is that of
weights 1 / (mu + r^2) (Snyder et al., JOSA A 10, 1014, 1993). Least squares gives every pixel the same weight.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from analysis.line.detection.detect import AMPLITUDE, BACKGROUND, CENTRE, PLATEAU, REACH, WIDTH
from analysis.line.methods.line_profile import linear_variance, profile
from analysis.line.result import Flag

Float32 = NDArray[np.float32]
Array = NDArray[np.float64]
Mask = NDArray[np.uint8]

ITERATIONS = 30
SMALL_STEP, ACCEPTED_STEP = 1e-5, 1e-3
"""Squared standard deviations: stop at the first; out of iterations the second will do (scoring is linear at worst)."""
NARROWEST = 0.35
"""px; a narrower line falls into one pixel, where its width leaves no trace and drags the centre along."""

_OK, _SATURATED, _AT_BORDER = int(Flag.OK), int(Flag.SATURATED), int(Flag.AT_BORDER)
_TOO_FEW, _NOT_CONVERGED = int(Flag.TOO_FEW_PIXELS), int(Flag.NOT_CONVERGED)
_OUT_OF_WINDOW, _TOO_WIDE = int(Flag.OUT_OF_WINDOW), int(Flag.TOO_WIDE)


@njit(nogil=True, cache=True, error_model="numpy")
def _cost(y: Array, floor: Array, g: Array, n: int, p: Array, likelihood: bool) -> float:
    """Twice the negative log likelihood up to a constant, or the sum of squares."""
    total = 0.0
    for i in range(n):
        mu = p[0] * g[i] + p[3]
        if likelihood:
            m = max(mu + floor[i], 0.1 * floor[i])
            total += 2.0 * (m - (y[i] + floor[i]) * math.log(m))
        else:
            total += (y[i] - mu) ** 2
    return total


@njit(nogil=True, cache=True, error_model="numpy")
def _normal(
    y: Array, floor: Array, shape: Array, n: int, p: Array, likelihood: bool, hessian: Array, score: Array
) -> None:
    """Fisher information (4, 4) and score (4,) for p = amplitude, centre, sigma, background."""
    for j in range(4):
        score[j] = 0.0
        for k in range(4):
            hessian[j, k] = 0.0
    for i in range(n):
        g = shape[0, i]
        mu = p[0] * g + p[3]
        weight = 1.0 / max(mu + floor[i], 0.1 * floor[i]) if likelihood else 1.0
        d1, d2 = p[0] * shape[1, i], p[0] * shape[2, i]
        w0, w1, w2 = weight * g, weight * d1, weight * d2
        hessian[0, 0] += w0 * g
        hessian[1, 0] += w1 * g
        hessian[1, 1] += w1 * d1
        hessian[2, 0] += w2 * g
        hessian[2, 1] += w2 * d1
        hessian[2, 2] += w2 * d2
        hessian[3, 0] += w0
        hessian[3, 1] += w1
        hessian[3, 2] += w2
        hessian[3, 3] += weight
        rest = y[i] - mu
        score[0] += w0 * rest
        score[1] += w1 * rest
        score[2] += w2 * rest
        score[3] += weight * rest


@njit(nogil=True, cache=True, error_model="numpy")
def _solve(hessian: Array, damping: float, right: Array, factor: Array, out: Array) -> bool:
    """(H + damping diag H) out = right by Cholesky on the lower triangle; False where H is not positive definite."""
    for i in range(4):
        for j in range(i + 1):
            total = hessian[i, j] * (1.0 + damping) if i == j else hessian[i, j]
            for k in range(j):
                total -= factor[i, k] * factor[j, k]
            if i == j:
                if not total > 1e-14 * hessian[i, i]:
                    return False
                factor[i, i] = math.sqrt(total)
            else:
                factor[i, j] = total / factor[j, j]
    for i in range(4):
        total = right[i]
        for k in range(i):
            total -= factor[i, k] * out[k]
        out[i] = total / factor[i, i]
    for i in range(3, -1, -1):
        total = out[i]
        for k in range(i + 1, 4):
            total -= factor[k, i] * out[k]
        out[i] = total / factor[i, i]
    return True


@njit(nogil=True, cache=True, error_model="numpy")
def _hold_sigma(hessian: Array, score: Array) -> None:
    """Take sigma out of the unknowns."""
    for j in range(4):
        if j < 2:
            hessian[2, j] = 0.0
        elif j == 3:
            hessian[3, 2] = 0.0
    hessian[2, 2] = 1.0
    score[2] = 0.0


@njit(nogil=True, cache=True, error_model="numpy")
def _optimise(  # noqa: PLR0913
    x: Array, y: Array, floor: Array, n: int, p: Array, likelihood: bool, integrated: bool, shape: Array, hessian: Array
) -> bool:
    """Refine p in place; on return `shape` and `hessian` belong to p. True if converged."""
    score, step, trial, factor = np.zeros(4), np.zeros(4), np.empty(4), np.zeros((4, 4))
    trial_shape = np.empty_like(shape)
    profile(x, n, p[1], p[2], integrated, shape)
    cost = _cost(y, floor, shape[0], n, p, likelihood)
    damping, decrement, scale = 1e-4, np.inf, 1.0
    converged = improved = False
    for _ in range(ITERATIONS):
        _normal(y, floor, shape, n, p, likelihood, hessian, score)
        if p[2] <= NARROWEST and score[2] < 0.0:
            _hold_sigma(hessian, score)
        scale = 1.0 if likelihood else max(cost / n, 1e-12 * p[0] * p[0])
        improved = False
        while damping < 1e8:
            if _solve(hessian, damping, score, factor, step):
                decrement = 0.0
                for j in range(4):
                    trial[j] = p[j] + step[j]
                    decrement += step[j] * score[j]
                trial[2] = max(trial[2], NARROWEST)
                if trial[0] > 0.0 and x[0] - 1.0 <= trial[1] <= x[n - 1] + 1.0 and trial[2] < 3.0 * (x[n - 1] - x[0]):
                    profile(x, n, trial[1], trial[2], integrated, trial_shape)
                    trial_cost = _cost(y, floor, trial_shape[0], n, trial, likelihood)
                    small = decrement <= SMALL_STEP * scale
                    if trial_cost <= cost or small:
                        improved = True
                        converged = small and damping < 1e-2
                        for j in range(4):
                            p[j] = trial[j]
                        for j in range(n):
                            for m in range(3):
                                shape[m, j] = trial_shape[m, j]
                        cost = trial_cost
                        damping = max(0.1 * damping, 1e-9)
                        break
            damping = max(10.0 * damping, 1e-3)
        if converged or not improved:
            break
    _normal(y, floor, shape, n, p, likelihood, hessian, score)
    if p[2] <= NARROWEST and score[2] < 0.0:
        _hold_sigma(hessian, score)
    return converged or (improved and decrement <= ACCEPTED_STEP * scale)


@njit(nogil=True, cache=True, error_model="numpy")
def _gather(
    signal: Float32, mask: Mask, floor: Float32, middle: float, half: float, x: Array, y: Array, base: Array
) -> int:
    """Usable pixels within `half` of `middle` -> positions, electrons, variances; returns how many."""
    count = 0
    for i in range(max(0, math.ceil(middle - half)), min(signal.shape[0] - 1, math.floor(middle + half)) + 1):
        if mask[i] == 0:
            x[count], y[count], base[count] = i, signal[i], floor[min(i, floor.shape[0] - 1)]
            count += 1
    return count


@njit(nogil=True, cache=True, error_model="numpy")
def fit_seeds(  # noqa: PLR0913
    signal: Float32,
    mask: Mask,
    floor: Float32,
    seeds: Array,
    flags: Mask,
    likelihood: bool,
    integrated: bool,
    correlation: Array,
    known_width: bool,
    max_width: float,
    out: Array,
) -> None:
    """Scan lines (n, w) and seeds (n, k, 6) -> out (n, k, 6): u, sigma_u, width, amplitude, background, chi2.

    flags (n, k) is updated: only OK and SATURATED seeds are fitted. floor (n, w) or (n, 1), e-^2.
    correlation: of neighbouring pixels after smoothing, [1] without; chi2 is then NaN.
    """
    n, w = signal.shape
    x, y, variance, weight = np.empty(w), np.empty(w), np.empty(w), np.empty(w)
    base, shape, p, hessian = np.empty(w), np.empty((3, w)), np.empty(4), np.empty((4, 4))
    factor, influence, unit = np.zeros((4, 4)), np.empty(4), np.zeros(4)
    unit[1] = 1.0
    for row in range(n):
        for k in range(seeds.shape[1]):
            for j in range(6):
                out[row, k, j] = np.nan
            if flags[row, k] > _SATURATED:
                continue
            seed = seeds[row, k]
            p[0], p[1], p[2], p[3] = seed[AMPLITUDE], seed[CENTRE], seed[WIDTH], seed[BACKGROUND]
            half, converged = 0.0, False
            for attempt in range(3):
                # 4 sigma hold the line, the rest its background; a saturated plateau pushes the wings outwards
                wanted = max(4.0 * p[2] + 1.5, seed[PLATEAU] + 2.5 * p[2] + 1.5)
                wanted = math.ceil(min(wanted, seed[REACH], 6.0 * max_width))
                if attempt > 0 and (known_width or 0.5 * half <= wanted <= 1.15 * half + 1.0):
                    break
                half = wanted
                middle = seed[CENTRE] if attempt == 0 else p[1]
                count = _gather(signal[row], mask[row], floor[row], middle, half, x, y, base)
                if count < 5:
                    break
                converged = _optimise(x, y, base, count, p, likelihood, integrated, shape, hessian)
                if not converged:
                    break
            if count < 5:
                flags[row, k] = _TOO_FEW
            elif min(p[1], seed[CENTRE]) < 0.5 or max(p[1], seed[CENTRE]) > w - 1.5:
                flags[row, k] = _AT_BORDER  # less than half of it is seen: any slope would fit
            elif not converged:
                flags[row, k] = _NOT_CONVERGED
            elif p[2] > max_width:
                flags[row, k] = _TOO_WIDE
            elif abs(p[1] - seed[CENTRE]) > max(half, 1.0):
                flags[row, k] = _OUT_OF_WINDOW
            elif not _solve(hessian, 0.0, unit, factor, influence):
                flags[row, k] = _NOT_CONVERGED
            if flags[row, k] > _SATURATED:
                continue
            chi2 = 0.0
            for i in range(count):
                mu = p[0] * shape[0, i] + p[3]
                variance[i] = max(mu + base[i], 0.1 * abs(base[i]))
                # how much the centre moves for one electron more in this pixel
                weight[i] = influence[0] * shape[0, i] + influence[3]
                weight[i] += p[0] * (influence[1] * shape[1, i] + influence[2] * shape[2, i])
                if likelihood:
                    weight[i] /= variance[i]
                chi2 += (y[i] - mu) ** 2 / variance[i]
            out[row, k, 0] = p[1]
            out[row, k, 1] = math.sqrt(linear_variance(weight, variance, x, count, correlation))
            out[row, k, 2], out[row, k, 3], out[row, k, 4] = p[2], p[0], p[3]
            if correlation.shape[0] == 1:
                out[row, k, 5] = chi2 / (count - 4)
