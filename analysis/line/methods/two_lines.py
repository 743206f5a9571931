"""Two lines of one width, fitted where one does not fit: a line and its neighbour, a groove's two reflections.

    mu_i = A g(i - c, s) + A' g(i - c', s) + b        maximum likelihood by Fisher scoring, as `gaussian_fit`

Two starts on either side of the single line; the better one goes on. Which of the two is meant nobody knows: the
brighter one is returned.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from analysis.line.methods.fisher_scoring import deviance
from analysis.line.methods.line_profile import ELECTRONS, FLOOR, POSITION, profile
from analysis.line.methods.narrow_line import NARROWEST
from analysis.line.methods.seed_loop import Array

UNKNOWNS = 6
"""Amplitude, centre, width, background; amplitude and centre of the other line."""
ITERATIONS = 40
STARTS = (1.5, 2.5, 3.5)
"""Distances in sigmas of the single line."""
SMALL = 1e-4
"""Squared standard deviations: a smaller step ends the iteration."""


@njit(nogil=True, cache=True, error_model="numpy")
def _cost(pixel: Array, n: int, p: Array, integrated: bool, one: Array, other: Array) -> float:
    """Twice the negative log likelihood up to a constant; fills the profiles (3, n) of both lines."""
    profile(pixel[POSITION], n, p[1], p[2], integrated, one)
    profile(pixel[POSITION], n, p[5], p[2], integrated, other)
    total = 0.0
    for i in range(n):
        floor, mu = pixel[FLOOR, i], p[0] * one[0, i] + p[4] * other[0, i] + p[3]
        total += deviance(pixel[ELECTRONS, i], mu, floor, max(0.1 * abs(floor), 1e-9))
    return total


@njit(nogil=True, cache=True, error_model="numpy")
def _jacobian(p: Array, one: Array, other: Array, i: int, out: Array) -> None:
    out[0], out[1], out[2] = one[0, i], p[0] * one[1, i], p[0] * one[2, i] + p[4] * other[2, i]
    out[3], out[4], out[5] = 1.0, other[0, i], p[4] * other[1, i]


@njit(nogil=True, cache=True, error_model="numpy")
def _normal(pixel: Array, n: int, p: Array, held: bool, one: Array, other: Array, hessian: Array, score: Array) -> None:
    """Fisher information (6, 6) and score (6,); held: the width is known."""
    row = np.empty(UNKNOWNS)
    hessian[:], score[:] = 0.0, 0.0
    for i in range(n):
        _jacobian(p, one, other, i, row)
        mu, floor = p[0] * one[0, i] + p[4] * other[0, i] + p[3], pixel[FLOOR, i]
        weight = 1.0 / max(mu + floor, 0.1 * abs(floor), 1e-9)
        for j in range(UNKNOWNS):
            score[j] += weight * row[j] * (pixel[ELECTRONS, i] - mu)
            for k in range(UNKNOWNS):
                hessian[j, k] += weight * row[j] * row[k]
    if held or (p[2] <= NARROWEST and score[2] < 0.0):
        hessian[2, :], hessian[:, 2], score[2] = 0.0, 0.0, 0.0
        hessian[2, 2] = 1.0


@njit(nogil=True, cache=True, error_model="numpy")
def solve(hessian: Array, damping: float, right: Array, out: Array) -> bool:
    """(H + damping diag H) out = right by elimination; False where a pivot is lost to rounding."""
    n = right.shape[0]
    a = hessian.copy()
    out[:] = right
    for i in range(n):
        a[i, i] *= 1.0 + damping
    for i in range(n):
        if not a[i, i] > 1e-12 * hessian[i, i]:
            return False
        for j in range(i + 1, n):
            factor = a[j, i] / a[i, i]
            for k in range(i, n):
                a[j, k] -= factor * a[i, k]
            out[j] -= factor * out[i]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            out[i] -= a[i, k] * out[k]
        out[i] /= a[i, i]
    return True


@njit(nogil=True, cache=True, error_model="numpy")
def _start(pixel: Array, n: int, single: Array, integrated: bool, one: Array, other: Array, p: Array) -> float:
    """The best of two lines in place of a single one (4,) -> p (6,); returns its cost."""
    trial, best = np.empty(UNKNOWNS), np.inf
    for side in (-1.0, 1.0):
        for distance in STARTS:
            apart = side * max(distance * single[2], 1.5)
            trial[0], trial[2], trial[3], trial[4] = 0.8 * single[0], 0.8 * single[2], single[3], 0.3 * single[0]
            trial[1], trial[5] = single[1] - 0.25 * apart, single[1] + 0.75 * apart
            trial[2] = max(trial[2], NARROWEST)
            cost = _cost(pixel, n, trial, integrated, one, other)
            if cost < best:
                best = cost
                p[:] = trial
    return best


@njit(nogil=True, cache=True, error_model="numpy")
def fit_two_lines(
    pixel: Array, n: int, single: Array, held: bool, integrated: bool, room: Array, p: Array, influence: Array
) -> float:
    """Pixels (4, n), of which position, electrons and floor, and the single line (4,) that does not fit -> p (6,), the
    brighter line first, and how far it moves for one electron more in each pixel, influence (n,).

    room (6, n). Returns chi-square, or infinity where there is no second line.
    """
    one, other = room[:3], room[3:6]
    hessian, score = np.empty((UNKNOWNS, UNKNOWNS)), np.empty(UNKNOWNS)
    step, trial = np.empty(UNKNOWNS), np.empty(UNKNOWNS)
    cost = _start(pixel, n, single, integrated, one, other, p)
    if held:
        p[2] = single[2]
        cost = _cost(pixel, n, p, integrated, one, other)
    damping, converged, low, high = 1e-2, False, pixel[POSITION, 0], pixel[POSITION, n - 1]
    for _ in range(ITERATIONS):
        _cost(pixel, n, p, integrated, one, other)
        _normal(pixel, n, p, held, one, other, hessian, score)
        if not solve(hessian, damping, score, step):
            damping = max(10.0 * damping, 1e-3)
            continue
        trial[:] = p + step
        trial[2] = p[2] if held else max(trial[2], NARROWEST)
        inside = (
            min(trial[1], trial[5]) > pixel[POSITION, 0] - 1.0
            and max(trial[1], trial[5]) < pixel[POSITION, n - 1] + 1.0
        )
        following = np.inf
        if inside and trial[0] > 0.0 and trial[4] > 0.0 and trial[2] < high - low:
            following = _cost(pixel, n, trial, integrated, one, other)
        small = bool(np.sum(step * score) < SMALL)
        if following <= cost or (small and following < np.inf):
            p[:] = trial
            cost = following
            converged = small and damping < 1e-2
            damping = max(0.1 * damping, 1e-9)
        else:
            damping = max(10.0 * damping, 1e-3)
        if converged or damping > 1e8:
            break
    if not converged:
        return np.inf
    if p[4] > p[0]:
        p[0], p[1], p[4], p[5] = p[4], p[5], p[0], p[1]
    _cost(pixel, n, p, integrated, one, other)
    _normal(pixel, n, p, held, one, other, hessian, score)
    score[:] = 0.0
    score[1] = 1.0
    if not solve(hessian, 0.0, score, step):
        return np.inf
    chi2 = 0.0
    for i in range(n):
        _jacobian(p, one, other, i, trial)
        mu, floor = p[0] * one[0, i] + p[4] * other[0, i] + p[3], pixel[FLOOR, i]
        variance = max(mu + floor, 0.1 * abs(floor), 1e-9)
        influence[i] = np.sum(step * trial) / variance
        chi2 += (pixel[ELECTRONS, i] - mu) ** 2 / variance
    return chi2
