"""Fisher scoring of a Gaussian on a flat background: amplitude, position, width and background of one line.

Damped as by Levenberg and Marquardt; the likelihood is `gaussian_fit`'s, least squares gives every pixel one weight.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from analysis.line.methods.line_profile import ELECTRONS, FLOOR, POSITION, profile
from analysis.line.methods.seed_loop import Array, Options

LEAST_SQUARES, LIKELIHOOD = range(2)
"""Variants."""
ITERATIONS = 30
SMALL_STEP, ACCEPTED_STEP = 1e-5, 1e-3
"""Squared standard deviations: stop at the first; out of iterations the second will do (scoring is linear at worst)."""


@njit(nogil=True, cache=True, error_model="numpy")
def _cost(y: Array, floor: Array, g: Array, n: int, p: Array, likelihood: bool) -> float:
    """Twice the negative log likelihood up to a constant, or the sum of squares."""
    total = 0.0
    for i in range(n):
        mu = p[0] * g[i] + p[3]
        if likelihood:
            total += deviance(y[i], mu, floor[i], 0.1 * floor[i])
        else:
            total += (y[i] - mu) ** 2
    return total


@njit(nogil=True, cache=True, error_model="numpy")
def deviance(y: float, mu: float, floor: float, least: float) -> float:
    """Twice the negative log likelihood of y where mu is expected, up to a constant.

    Where the variance mu + floor would fall below the `least` it is held there, as in the score: a sum of squares,
    without which a background far below 0, beside a second line, stops the descent.
    """
    m = mu + floor
    if m >= least:
        return 2.0 * (m - (y + floor) * math.log(m))
    held = 2.0 * (least - (y + floor) * math.log(least))
    return held + ((y - mu) ** 2 - (y + floor - least) ** 2) / least


@njit(nogil=True, cache=True, error_model="numpy")
def normal_equations(
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
def solve(hessian: Array, damping: float, right: Array, factor: Array, out: Array) -> bool:
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
def optimise(
    pixel: Array, n: int, p: Array, narrowest: float, options: Options, shape: Array, trial_shape: Array, hessian: Array
) -> bool:
    """Refine p in place on pixels (4, n); on return `shape` and `hessian` belong to p. True if converged.

    A known width is held, and one at the lower bound that would go below it.
    """
    likelihood, integrated = options.variant == LIKELIHOOD, options.integrated
    x, y, floor = pixel[POSITION], pixel[ELECTRONS], pixel[FLOOR]
    score, step, trial, factor = np.zeros(4), np.zeros(4), np.empty(4), np.zeros((4, 4))
    profile(x, n, p[1], p[2], integrated, shape)
    cost = _cost(y, floor, shape[0], n, p, likelihood)
    damping, decrement, scale = 1e-4, np.inf, 1.0
    converged = improved = False
    for _ in range(ITERATIONS):
        normal_equations(y, floor, shape, n, p, likelihood, hessian, score)
        if options.known_width or (p[2] <= narrowest and score[2] < 0.0):
            _hold_sigma(hessian, score)
        scale = 1.0 if likelihood else max(cost / n, 1e-12 * p[0] * p[0])
        improved = False
        while damping < 1e8:
            if solve(hessian, damping, score, factor, step):
                decrement = 0.0
                for j in range(4):
                    trial[j] = p[j] + step[j]
                    decrement += step[j] * score[j]
                trial[2] = p[2] if options.known_width else max(trial[2], narrowest)
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
    normal_equations(y, floor, shape, n, p, likelihood, hessian, score)
    if options.known_width or (p[2] <= narrowest and score[2] < 0.0):
        _hold_sigma(hessian, score)
    return converged or (improved and decrement <= ACCEPTED_STEP * scale)
