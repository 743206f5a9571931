"""A Gaussian fitted to each seed, saturated pixels left out: least squares or maximum likelihood, by Fisher scoring.

The likelihood is the shifted Poisson of shot plus read noise: y + r^2 ~ Poisson(mu + r^2), whose score is that of
weights 1 / (mu + r^2) (Snyder et al., JOSA A 10, 1014, 1993). Least squares gives every pixel the same weight.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from analysis.line.detection.detect import (
    AMPLITUDE,
    BACKGROUND,
    CENTRE,
    PLATEAU,
    PRIOR,
    PRIOR_WIDTHS,
    REACH,
    SLOPE,
    WIDTH,
)
from analysis.line.methods.line_profile import ELECTRONS, FLOOR, POSITION, VARIANCE, profile
from analysis.line.methods.misfit import UNLIKELY, deviate, measure_misfit
from analysis.line.methods.narrow_line import COARSE, NARROWEST, WIDEST, posterior, weigh_of_known_width
from analysis.line.methods.saturated_line import AROUND, NARROWEST_SATURATED, measure_with_glow, widen_saturated
from analysis.line.methods.scintillation import position_variance, shared_variance
from analysis.line.methods.seed_loop import (
    CORRELATION_LENGTH,
    TOLD,
    Array,
    Options,
    Pixels,
    peak_kernel,
)
from analysis.line.methods.two_lines import UNKNOWNS
from analysis.line.methods.window import slope_variance
from analysis.line.result import Flag

LEAST_SQUARES, LIKELIHOOD = range(2)
"""Variants."""
ITERATIONS = 30
SMALL_STEP, ACCEPTED_STEP = 1e-5, 1e-3
"""Squared standard deviations: stop at the first; out of iterations the second will do (scoring is linear at worst)."""
RESOLVED, FINE = 0.3, 0.35
"""px; a line that is narrower than COARSE, and whose width may as well be below the first (4 sigma), is not a matter of
a fit; if it is also narrower than the second on average over what its width may be, it is flagged."""
SPECKLED = 0.06
"""px; variance by scintillation over the line's width from which few grains make up a line: an expansion in their
contrast no longer holds. By seeded trials of f/5.6 to f/11 on lines of 0.8 to 4 px."""
JUDGED = 0.01
"""Relative variance of the light from which no fit is judged: what scintillates strongly keeps to no profile."""


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
def _optimise(
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
        _normal(y, floor, shape, n, p, likelihood, hessian, score)
        if options.known_width or (p[2] <= narrowest and score[2] < 0.0):
            _hold_sigma(hessian, score)
        scale = 1.0 if likelihood else max(cost / n, 1e-12 * p[0] * p[0])
        improved = False
        while damping < 1e8:
            if _solve(hessian, damping, score, factor, step):
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
    _normal(y, floor, shape, n, p, likelihood, hessian, score)
    if options.known_width or (p[2] <= narrowest and score[2] < 0.0):
        _hold_sigma(hessian, score)
    return converged or (improved and decrement <= ACCEPTED_STEP * scale)


@njit(nogil=True, cache=True, error_model="numpy")
def _gather(pixels: Pixels, y: int, seed: Array, middle: float, half: float, pixel: Array) -> int:
    """Usable pixels of line y within `half` of `middle` -> positions, electrons and floors (4, n); returns n.

    What the background's slope adds is taken off, and still is noise.
    """
    signal, mask, floor, count = pixels.signal[y], pixels.mask[y], pixels.floor[y], 0
    for i in range(max(0, math.ceil(middle - half)), min(signal.shape[0] - 1, math.floor(middle + half)) + 1):
        if mask[i] == 0:
            rise = seed[SLOPE] * (i - seed[CENTRE])
            pixel[POSITION, count], pixel[ELECTRONS, count] = i, signal[i] - rise
            pixel[FLOOR, count] = floor[min(i, floor.shape[0] - 1)] + rise
            count += 1
    return count


@njit(nogil=True, cache=True, error_model="numpy")
def _chi2_and_influence(
    pixel: Array, n: int, p: Array, likelihood: bool, shape: Array, row: Array, scattered: float, weight: Array
) -> float:
    """Sum of squared residuals over their variance; fills the variances of pixels (4, n) and weight (n,).

    scattered: variance of the light over its squared mean, which counts for chi2 and not for the pixels' own noise.

    row (4,): the centre's row of the inverse Hessian. weight: how far the centre moves for one electron more.
    """
    chi2 = 0.0
    for i in range(n):
        mu, floor = p[0] * shape[0, i] + p[3], pixel[FLOOR, i]
        variance = max(mu + floor, 0.1 * abs(floor))
        weight[i] = row[0] * shape[0, i] + row[3]
        weight[i] += p[0] * (row[1] * shape[1, i] + row[2] * shape[2, i])
        if likelihood:
            weight[i] /= variance
        chi2 += (pixel[ELECTRONS, i] - mu) ** 2 / (variance + scattered * (p[0] * shape[0, i]) ** 2)
        pixel[VARIANCE, i] = variance
    return chi2


@njit(nogil=True, cache=True, error_model="numpy")
def _is_coarse(pixel: Array, n: int, p: Array, options: Options, hessian: Array) -> bool:
    """Whether the pixels (4, n) are too coarse for the line p: its width may be anything below RESOLVED."""
    if p[2] >= COARSE:
        return False
    if options.known_width or p[2] <= NARROWEST:
        return bool(p[2] < RESOLVED)
    row, unit = np.empty(4), np.zeros(4)
    unit[2] = 1.0
    if not _solve(hessian, 0.0, unit, np.zeros((4, 4)), row):
        return True
    # of least squares the Hessian is that of pixels of unit variance
    variance = 1.0 if options.variant == LIKELIHOOD else 0.5 * p[0] + max(p[3], 0.0) + pixel[FLOOR, n // 2]
    return bool(p[2] - 4.0 * math.sqrt(row[2] * variance) < RESOLVED)


@njit(nogil=True, cache=True, error_model="numpy")
def _measure_narrow(
    pixels: Pixels, pixel: Array, n: int, p: Array, seed: Array, options: Options, shape: Array, out: Array
) -> int:
    """The posterior of a line that may be too narrow for its pixels (4, n) -> out; returns UNRESOLVED if it is."""
    x, y, floor = pixel[POSITION], pixel[ELECTRONS], pixel[FLOOR]
    told = np.empty((2, PRIOR_WIDTHS.shape[0]))
    told[:] = np.nan
    out[1] = posterior(pixel, n, p, options.known_width, options.integrated, shape, seed[PRIOR:], told)
    if not math.isfinite(p[1]) or not math.isfinite(out[1]):
        out[:] = np.nan
        return Flag.NOT_CONVERGED.value
    out[0], out[2], out[3], out[4] = p[1], p[2], p[0], p[3]
    out[TOLD:] = told.ravel()
    chi2 = mass = 0.0
    light, weight = np.empty(n), np.empty(n)
    for i in range(n):
        light[i] = p[0] * shape[0, i]
        mu = light[i] + p[3]
        chi2 += (y[i] - mu) ** 2 / max(mu + floor[i], 0.1 * abs(floor[i]))
        mass += light[i]
    out[5], out[CORRELATION_LENGTH] = chi2 / (n - 4), 1.0
    if pixels.covariances.shape[1] > 0 and mass > 0.0:
        # the position takes the centre of mass of so few pixels as their width lets it, or better
        weigh_of_known_width(pixel, n, p, shape, weight)
        own, all_lines = shared_variance(weight, light, x, n, pixels.covariances, pixels.fineness, p[2], False)
        for i in range(n):
            weight[i] = (x[i] - p[1]) / mass
        shared, mean = shared_variance(weight, light, x, n, pixels.covariances, pixels.fineness, p[2], False)
        if own < shared:
            shared, mean = own, all_lines
        count = out[1] * out[1]
        out[1] = math.sqrt(count + shared)
        out[CORRELATION_LENGTH] = (count + mean) / max(count + shared, 1e-300)
    return Flag.UNRESOLVED.value if p[2] < FINE else Flag.OK.value


@njit(nogil=True, cache=True, error_model="numpy")
def _measure_saturated(
    pixels: Pixels, y: int, seed: Array, n: int, p: Array, chi2: float, options: Options, out: Array
) -> None:
    """What glow there may be beside a saturated line p (4,), fitted alone to n pixels of pixels.room -> out."""
    pixel = pixels.room[:4]
    widen_saturated(pixel[POSITION], n, p, pixels.room[4], chi2 / max(n - 4, 1), seed[PLATEAU], out)
    if options.variant == LIKELIHOOD and pixels.correlation.shape[0] == 1 and p[2] >= COARSE:
        half = math.ceil(min(seed[PLATEAU] + AROUND * p[2] + 1.5, seed[REACH], 6.0 * options.max_width))
        measure_with_glow(pixels, seed, _gather(pixels, y, seed, seed[CENTRE], half, pixel), p, options, out)


@njit(nogil=True, cache=True, error_model="numpy")
def _tell_width(width: float, variance: float, out: Array) -> None:
    """What a fit says of a line's width, for its neighbours."""
    count = PRIOR_WIDTHS.shape[0]
    for j in range(count):
        out[TOLD + j] = out[TOLD + count + j] = -0.5 * (PRIOR_WIDTHS[j] - width) ** 2 / variance


@njit(nogil=True, cache=True, error_model="numpy")
def _asymmetry(pixel: Array, n: int, p: Array, held: bool, shape: Array, hessian: Array) -> float:
    """Score test for a third Hermite term in the profile: a normal deviate where the line is a Gaussian.

    A neighbour leans a line to one side long before chi-square, which looks in every direction, sees it. held: the
    width is known.
    """
    cross, projected = np.zeros(4), np.empty(4)
    moment = square = 0.0
    for i in range(n):
        z = (pixel[POSITION, i] - p[1]) / p[2]
        lean = (z * z - 3.0) * z * shape[0, i]
        weight = lean / pixel[VARIANCE, i]
        moment += weight * (pixel[ELECTRONS, i] - p[0] * shape[0, i] - p[3])
        square += weight * lean
        cross[0] += weight * shape[0, i]
        cross[1] += weight * p[0] * shape[1, i]
        cross[2] += 0.0 if held else weight * p[0] * shape[2, i]
        cross[3] += weight
    if not _solve(hessian, 0.0, cross, np.zeros((4, 4)), projected):
        return 0.0
    for j in range(4):
        square -= cross[j] * projected[j]
    return float(moment / math.sqrt(square)) if square > 0.0 else 0.0


@peak_kernel
def measure_gaussian(pixels: Pixels, y: int, seed: Array, flag: int, options: Options, out: Array) -> int:
    """Peak kernel (`seed_loop`). options.variant: LEAST_SQUARES or LIKELIHOOD. chi2 only for independent pixels."""
    w, likelihood = pixels.signal.shape[1], options.variant == LIKELIHOOD
    pixel, weight, shape, trial_shape = pixels.room[:4], pixels.room[4], pixels.room[5:8], pixels.room[8:11]
    p, hessian = np.empty(4), np.empty((4, 4))
    p[0], p[1], p[2], p[3] = seed[AMPLITUDE], seed[CENTRE], seed[WIDTH], seed[BACKGROUND]
    narrowest = NARROWEST if flag == Flag.OK.value else NARROWEST_SATURATED
    half, count, converged = 0.0, 0, False
    for attempt in range(3):
        # 4 sigma hold the line, the rest its background; a saturated plateau pushes the wings outwards
        wanted = max(4.0 * p[2] + 1.5, seed[PLATEAU] + 2.5 * p[2] + 1.5)
        wanted = math.ceil(min(wanted, seed[REACH], 6.0 * options.max_width))
        if attempt > 0 and (options.known_width or 0.5 * half <= wanted <= 1.15 * half + 1.0):
            break
        half = wanted
        middle = seed[CENTRE] if attempt == 0 else p[1]
        count = _gather(pixels, y, seed, middle, half, pixel)
        if count < 5:
            return Flag.TOO_FEW_PIXELS.value
        converged = _optimise(pixel, count, p, narrowest, options, shape, trial_shape, hessian)
        if not converged:
            break
    if min(p[1], seed[CENTRE]) < 0.5 or max(p[1], seed[CENTRE]) > w - 1.5:
        return Flag.AT_BORDER.value  # less than half of it is seen: any slope would fit
    if flag == Flag.OK.value and min(p[2], seed[WIDTH]) < COARSE:
        if not converged:
            p[0], p[1], p[2], p[3] = seed[AMPLITUDE], seed[CENTRE], seed[WIDTH], seed[BACKGROUND]
        if not converged or seed[PRIOR] != 0.0 or _is_coarse(pixel, count, p, options, hessian):
            return _measure_narrow(pixels, pixel, count, p, seed, options, shape, out)
    independent = pixels.correlation.shape[0] == 1
    scattered = pixels.covariances[0, 0] if pixels.covariances.shape[1] > 0 else 0.0
    # of a line below half a pixel three pixels hold all the light, which two lines would explain as well; and what
    # least squares leave over is more than chi-square expects, since they do not weigh
    judged = options.judge and likelihood and independent and flag == Flag.OK.value
    judged = judged and count > UNKNOWNS and p[2] >= COARSE and scattered < JUDGED
    if not converged and judged:
        p[0], p[1], p[2], p[3] = seed[AMPLITUDE], seed[CENTRE], seed[WIDTH], seed[BACKGROUND]
        for i in range(count):  # no model has told the variance yet: it is that of the pixels themselves
            floor, light = pixel[FLOOR, i], pixel[ELECTRONS, i] - p[3]
            pixel[VARIANCE, i] = max(pixel[ELECTRONS, i] + floor, 0.1 * abs(floor)) + scattered * light * light
        reason = measure_misfit(pixels, seed, count, p, options, out)
        if reason != Flag.MISFIT.value:
            return reason
        out[:] = np.nan
    if not converged:
        return Flag.NOT_CONVERGED.value
    if p[2] > options.max_width:
        return Flag.TOO_WIDE.value
    if abs(p[1] - seed[CENTRE]) > max(half, 1.0):
        return Flag.OUT_OF_WINDOW.value
    factor, row, unit = np.zeros((4, 4)), np.empty(4), np.zeros(4)
    unit[1] = 1.0
    if not _solve(hessian, 0.0, unit, factor, row):
        return Flag.NOT_CONVERGED.value
    chi2 = _chi2_and_influence(pixel, count, p, likelihood, shape, row, scattered, weight)
    out[0], out[2], out[3], out[4] = p[1], p[2], p[0], p[3]
    light = trial_shape[0]
    for i in range(count):
        light[i] = p[0] * shape[0, i]
    noise, out[CORRELATION_LENGTH], speckled = position_variance(
        pixels, weight, pixel[VARIANCE], light, pixel[POSITION], count, p[2], False
    )
    out[1] = math.sqrt(noise + slope_variance(seed, weight, pixel[POSITION], count))
    if independent:
        out[5] = chi2 / (count - 4)
    if flag == Flag.SATURATED.value:
        _measure_saturated(pixels, y, seed, count, p, chi2, options, out)
    elif likelihood and not options.known_width and p[2] < WIDEST:
        unit[1], unit[2] = 0.0, 1.0
        if _solve(hessian, 0.0, unit, factor, row):
            _tell_width(p[2], row[2], out)
    if flag == Flag.OK.value and speckled > SPECKLED * p[2]:
        return Flag.SPECKLED.value
    if not judged:
        return flag
    for i in range(count):
        pixel[VARIANCE, i] += scattered * light[i] * light[i]
    asymmetry = _asymmetry(pixel, count, p, options.known_width, shape, hessian)
    if max(deviate(chi2, count - 4), abs(asymmetry)) < UNLIKELY:
        return flag
    return measure_misfit(pixels, seed, count, p, options, out)
