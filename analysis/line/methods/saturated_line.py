"""The position of a saturated line from its wings, and what they cannot tell of it: the glow beside its hidden peak.

    mu_i = A (g(i - c, s) + h t(i - c + 3 s) + h' t(i - c - 3 s)) + b        t(x) = exp(-x^2 / 2 (4 s)^2)

Light that a lens scatters beside a bright line leans the wings to one side, which moves a fit of the line alone by up
to a sigma of the line and leaves no misfit. What tells it is the ground farther out, on both sides. So the heights h,
h' of a glow on either side are fitted with the line, by maximum a posteriori: normal about 0 with a standard deviation
of GLOW of the hidden peak. Where the pixels around tell the glow, position and sigma_u are those of the wings and of
the glow as it is; where they do not, sigma_u holds what that prior leaves open.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from analysis.line.detection.detect import AMPLITUDE, CENTRE, PLATEAU, WIDTH
from analysis.line.methods.line_profile import ELECTRONS, FLOOR, POSITION, profile
from analysis.line.methods.misfit import UNLIKELY, deviate
from analysis.line.methods.narrow_line import COARSE
from analysis.line.methods.scintillation import position_variance
from analysis.line.methods.seed_loop import CORRELATION_LENGTH, Array, Options, Pixels
from analysis.line.methods.two_lines import UNKNOWNS, solve

GLOW, GLOW_BESIDE, GLOW_WIDTH = 0.005, 3.0, 4.0
"""What a lens may put beside a saturated line: height of the peak, and in sigmas its place and width."""
AROUND = 8.0
"""Sigmas beyond the plateau whose pixels tell the glow."""
NARROWEST_SATURATED = 0.35
"""px; the wings of a narrower line are within a pixel."""
STARTS = (10.0, 100.0)
"""Hidden peaks over the full well that the fit is begun with."""
SATURATING, ITS_PLACE, ITS_WIDTH = 300.0, 0.32, 0.2
"""The same where the glow saturates too, by GLOW and its place: half the plateau from its middle, and its width."""
ITERATIONS = 40
LOOK, HOPE = 4, 4.0
"""Iterations after which a start is given up from which the best cost so far is out of reach, if all that are left
lowered the cost so many times as much as the last."""
SMALL = 1e-4
"""Squared standard deviations: a smaller step ends the iteration."""


@njit(nogil=True, cache=True, error_model="numpy")
def widen_saturated(x: Array, n: int, p: Array, weight: Array, chi2: float, plateau: float, out: Array) -> None:
    """What the wings of a line fitted alone cannot know -> sigma in out: the glow beside its hidden peak, and a misfit.

    weight (n,): how far the centre moves for one electron more in the pixels x (n,). plateau: half its width, px, which
    the line is within. That of a line that hardly reaches its neighbours is anywhere within a pixel.
    """
    moved = 0.0
    for side in (-1.0, 1.0):
        shift = 0.0
        for i in range(n):
            z = (x[i] - p[1] - side * GLOW_BESIDE * p[2]) / (GLOW_WIDTH * p[2])
            shift += weight[i] * GLOW * p[0] * math.exp(-0.5 * z * z)
        moved = max(moved, abs(shift))
    coarse = 1.0 / 12.0 if p[2] < COARSE else 0.0
    moved = min(moved, plateau / math.sqrt(3.0))
    out[1] = math.sqrt(out[1] * out[1] * max(chi2, 1.0) + moved * moved + coarse)


@njit(nogil=True, cache=True, error_model="numpy")
def _model(pixel: Array, n: int, p: Array, integrated: bool, shape: Array, jacobian: Array) -> float:
    """Twice the negative logarithm of the posterior of p = A, c, s, b, h, h' up to a constant; jacobian (7, n): the
    derivatives of the model by each, and the model itself. shape (3, n) is scratch."""
    profile(pixel[POSITION], n, p[1], p[2], integrated, shape)
    total = (p[4] * p[4] + p[5] * p[5]) / (GLOW * GLOW)
    for i in range(n):
        light, by_centre, by_width = shape[0, i], shape[1, i], shape[2, i]
        for k in range(2):
            beside = GLOW_BESIDE if k == 1 else -GLOW_BESIDE
            z = ((pixel[POSITION, i] - p[1]) / p[2] - beside) / GLOW_WIDTH
            glow = math.exp(-0.5 * z * z)
            jacobian[4 + k, i] = p[0] * glow
            light += p[4 + k] * glow
            by_centre += p[4 + k] * glow * z / (GLOW_WIDTH * p[2])
            by_width += p[4 + k] * glow * z * (z + beside / GLOW_WIDTH) / p[2]
        jacobian[0, i], jacobian[1, i], jacobian[2, i], jacobian[3, i] = light, p[0] * by_centre, p[0] * by_width, 1.0
        jacobian[6, i] = p[0] * light + p[3]
        floor = pixel[FLOOR, i]
        m = max(jacobian[6, i] + floor, 0.1 * abs(floor), 1e-9)
        total += 2.0 * (m - (pixel[ELECTRONS, i] + floor) * math.log(m))
    return total


@njit(nogil=True, cache=True, error_model="numpy")
def _normal(pixel: Array, n: int, p: Array, jacobian: Array, held: bool, hessian: Array, score: Array) -> None:
    """Information (6, 6) and score (6,) of the posterior; held: the width is known."""
    hessian[:], score[:] = 0.0, 0.0
    for i in range(n):
        floor = pixel[FLOOR, i]
        weight = 1.0 / max(jacobian[6, i] + floor, 0.1 * abs(floor), 1e-9)
        for j in range(UNKNOWNS):
            weighed = weight * jacobian[j, i]
            score[j] += weighed * (pixel[ELECTRONS, i] - jacobian[6, i])
            for k in range(j + 1):
                hessian[j, k] += weighed * jacobian[k, i]
    for j in range(UNKNOWNS):
        for k in range(j):
            hessian[k, j] = hessian[j, k]
    for j in (4, 5):
        hessian[j, j] += 1.0 / (GLOW * GLOW)
        score[j] -= p[j] / (GLOW * GLOW)
    if held:
        hessian[2, :], hessian[:, 2], score[2] = 0.0, 0.0, 0.0
        hessian[2, 2] = 1.0


@njit(nogil=True, cache=True, error_model="numpy")
def _fit(
    pixel: Array, n: int, p: Array, seed: Array, options: Options, room: tuple[Array, Array, Array], best: float
) -> float:
    """Refine p (6,) in place on pixels (4, n), its centre within the seed's plateau -> its cost, or infinity.

    room: shape (3, n), jacobian (7, n) and hessian (6, 6), scratch. best: the cost of another fit, to be undercut.
    """
    shape, jacobian, hessian = room
    low, high = seed[CENTRE] - seed[PLATEAU] - 1.0, seed[CENTRE] + seed[PLATEAU] + 1.0
    score, step, trial = np.empty(UNKNOWNS), np.empty(UNKNOWNS), np.empty(UNKNOWNS)
    held, integrated, damping = options.known_width, options.integrated, 1e-3
    cost = _model(pixel, n, p, integrated, shape, jacobian)
    _normal(pixel, n, p, jacobian, held, hessian, score)
    before = cost
    for iteration in range(ITERATIONS):
        if iteration > 0 and iteration % LOOK == 0:
            left = (ITERATIONS - iteration) / LOOK
            if cost - HOPE * left * (before - cost) > best:
                return np.inf
            before = cost
        following, small = np.inf, False
        if solve(hessian, damping, score, step):
            trial[:] = p + step
            small = bool(np.sum(step * score) < SMALL)
            if trial[0] > 0.0 and trial[2] > NARROWEST_SATURATED and low <= trial[1] <= high:
                following = _model(pixel, n, trial, integrated, shape, jacobian)
        if following <= cost or (small and following < np.inf):
            p[:] = trial
            cost = following
            _normal(pixel, n, p, jacobian, held, hessian, score)
            if small and damping < 1e-2:
                return float(cost)
            damping = max(0.1 * damping, 1e-9)
        else:
            damping = max(10.0 * damping, 1e-3)
            if damping > 1e8:
                return np.inf
    return np.inf


@njit(nogil=True, cache=True, error_model="numpy")
def _misfits(pixel: Array, n: int, p: Array, options: Options, shape: Array, jacobian: Array) -> bool:
    """Whether p (6,) leaves more over than noise does."""
    _model(pixel, n, p, options.integrated, shape, jacobian)
    chi2 = 0.0
    for i in range(n):
        variance = max(jacobian[6, i] + pixel[FLOOR, i], 0.1 * abs(pixel[FLOOR, i]), 1e-9)
        chi2 += (pixel[ELECTRONS, i] - jacobian[6, i]) ** 2 / variance
    return bool(deviate(chi2, n - UNKNOWNS) >= UNLIKELY)


@njit(nogil=True, cache=True, error_model="numpy")
def measure_with_glow(pixels: Pixels, seed: Array, n: int, single: Array, options: Options, out: Array) -> None:
    """A saturated line and the glow beside it, on pixels.room[:4] (4, n) -> out; as it is where the two do not fit.

    single (4,): the fit of the line alone. Its distance and its own sigma, and that the line may be anywhere within the
    plateau, are part of sigma_u where chi-square says that neither holds.
    """
    if n <= UNKNOWNS:
        return
    room, trial, p = pixels.room, np.zeros(UNKNOWNS), np.zeros(UNKNOWNS)
    pixel, weight, shape = room[:4], room[4], room[5:8]
    hessian, jacobian = np.empty((UNKNOWNS, UNKNOWNS)), np.empty((UNKNOWNS + 1, n))
    full = seed[AMPLITUDE] * math.exp(-min(0.5 * (seed[PLATEAU] / seed[WIDTH]) ** 2, 12.0))
    cost = np.inf
    # of the line alone, which may be the glow; of the plateau's width; and, where neither fits, on either side of a
    # glow that saturates
    for start in range(len(STARTS) + 3):
        if start == len(STARTS) + 1 and (cost == np.inf or not _misfits(pixel, n, p, options, shape, jacobian)):
            break
        trial[:4], trial[4:] = single, 0.0
        if start > len(STARTS):
            side = 1.0 if start == len(STARTS) + 1 else -1.0
            trial[0], trial[1] = full * SATURATING, seed[CENTRE] - side * ITS_PLACE * seed[PLATEAU]
            trial[4 if side < 0.0 else 5] = GLOW
            if not options.known_width:
                trial[2] = max(ITS_WIDTH * seed[PLATEAU], NARROWEST_SATURATED)
        elif start > 0:
            over = STARTS[start - 1]
            trial[0], trial[1] = full * over, seed[CENTRE]
            if not options.known_width:
                trial[2] = max(seed[PLATEAU] / math.sqrt(2.0 * math.log(over)), NARROWEST_SATURATED)
        found = _fit(pixel, n, trial, seed, options, (shape, jacobian, hessian), cost)
        if found < cost:
            cost = found
            p[:] = trial
    if cost == np.inf:
        return
    _model(pixel, n, p, options.integrated, shape, jacobian)
    unit, row = np.zeros(UNKNOWNS), np.empty(UNKNOWNS)
    _normal(pixel, n, p, jacobian, options.known_width, hessian, row)
    unit[1] = 1.0
    if not solve(hessian, 0.0, unit, row):
        return
    chi2 = 0.0
    light, variance = room[8], room[9]
    for i in range(n):
        floor = pixel[FLOOR, i]
        variance[i] = max(jacobian[6, i] + floor, 0.1 * abs(floor), 1e-9)
        weight[i] = 0.0
        for j in range(UNKNOWNS):
            weight[i] += row[j] * jacobian[j, i]
        weight[i] /= variance[i]
        light[i] = jacobian[6, i] - p[3]
        chi2 += (pixel[ELECTRONS, i] - jacobian[6, i]) ** 2 / variance[i]
    freedom = n - UNKNOWNS
    _, out[CORRELATION_LENGTH], shared = position_variance(
        pixels, weight, variance, light, pixel[POSITION], n, p[2], False
    )
    # the inverse information is that of the counts and of what the prior leaves open of the glow
    spread = row[1] * max(chi2 / freedom, 1.0) + max(shared, 0.0)
    if deviate(chi2, freedom) >= UNLIKELY:
        spread += out[1] * out[1] + (p[1] - single[1]) ** 2 + seed[PLATEAU] ** 2 / 3.0
    out[0], out[1], out[2], out[3], out[4] = p[1], math.sqrt(spread), p[2], p[0], p[3]
    out[5] = chi2 / freedom
