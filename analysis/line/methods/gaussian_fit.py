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
from analysis.line.methods.fisher_scoring import LIKELIHOOD, optimise, solve
from analysis.line.methods.line_profile import ELECTRONS, FLOOR, POSITION, VARIANCE
from analysis.line.methods.misfit import centroid, deviate, measure_misfit
from analysis.line.methods.narrow_line import COARSE, NARROWEST, WIDEST, posterior, weigh_of_known_width, width_spread
from analysis.line.methods.narrow_misfit import JUDGED, fill_variances, light_beside, unexplained
from analysis.line.methods.saturated_line import AROUND, NARROWEST_SATURATED, measure_with_glow, widen_saturated
from analysis.line.methods.scintillation import position_variance, second_order, shared_variance
from analysis.line.methods.seed_loop import (
    CORRELATION_LENGTH,
    FIT,
    LEAN,
    SHARED,
    TOLD,
    Array,
    Options,
    Pixels,
    peak_kernel,
)
from analysis.line.methods.two_lines import UNKNOWNS
from analysis.line.methods.window import slope_variance
from analysis.line.result import Flag

RESOLVED, FINE = 0.3, 0.35
"""px; a line that is narrower than COARSE, and whose width may as well be below the first (4 sigma), is not a matter of
a fit; if it is also narrower than the second on average over what its width may be, it is flagged, and so it is where
that is what its neighbours say, and by itself it may be below the first (1 sigma): what light beside it they have in
common looks like width."""
SPECKLED = 0.06
"""px; variance by scintillation over the line's width from which few grains make up a line: an expansion in their
contrast no longer holds. By seeded trials of f/5.6 to f/11 on lines of 0.8 to 4 px."""


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
    if not solve(hessian, 0.0, unit, np.zeros((4, 4)), row):
        return True
    # of least squares the Hessian is that of pixels of unit variance
    variance = 1.0 if options.variant == LIKELIHOOD else 0.5 * p[0] + max(p[3], 0.0) + pixel[FLOOR, n // 2]
    return bool(p[2] - 4.0 * math.sqrt(row[2] * variance) < RESOLVED)


@njit(nogil=True, cache=True, error_model="numpy")
def _measure_narrow(
    pixels: Pixels, pixel: Array, n: int, p: Array, seed: Array, options: Options, shape: Array, out: Array
) -> int:
    """The posterior of a line that may be too narrow for its pixels (4, n) -> out; returns UNRESOLVED if it is.

    MISFIT where no narrow line explains the pixels: sigma is that of the posterior times the root of chi-square.
    """
    x, told = pixel[POSITION], np.empty((2, PRIOR_WIDTHS.shape[0]))
    told[:] = np.nan
    out[1], out[SHARED] = posterior(pixel, n, p, options.known_width, options.integrated, shape, seed[PRIOR:], told)
    if not math.isfinite(p[1]) or not math.isfinite(out[1]):
        out[:] = np.nan
        return Flag.NOT_CONVERGED.value
    out[0], out[2], out[3], out[4] = p[1], p[2], p[0], p[3]
    if out.shape[0] > TOLD:
        out[TOLD:] = told.ravel()
    mass, light, weight = 0.0, np.empty(n), np.empty(n)
    for i in range(n):
        light[i] = p[0] * shape[0, i]
        mass += light[i]
    chi2 = fill_variances(pixel, n, p, light, 0.0)
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
        grown, count = second_order(shared, p[2], False), out[1] * out[1]
        shared, mean = shared * grown, mean * grown
        out[1] = math.sqrt(count + shared)
        out[CORRELATION_LENGTH] = (count + mean) / max(count + shared, 1e-300)
    by_others = options.judge < math.inf and seed[PRIOR] != 0.0
    fine = p[2] < FINE or (by_others and p[2] - width_spread(told[1]) < RESOLVED)
    flag = Flag.UNRESOLVED.value if fine else Flag.OK.value
    return _judge_narrow(pixels, n, p, seed, options, shape, flag, out)


@njit(nogil=True, cache=True, error_model="numpy")
def _judge_narrow(
    pixels: Pixels, n: int, p: Array, seed: Array, options: Options, shape: Array, flag: int, out: Array
) -> int:
    """Whether a narrow line (`narrow_misfit`) is all that n pixels of pixels.room hold -> flag, or what it is instead.

    Measured as two where it is not, or where its neighbours say so; light that scintillates fits no two lines either:
    sigma is told larger by the root of chi-square. out holds the line; its column LEAN is written. shape (3, n).
    """
    if options.judge == math.inf:
        return flag
    pixel, light = pixels.room[:4], p[0] * shape[0, :n]
    scattered = pixels.covariances[0, 0] if pixels.covariances.shape[1] > 0 else 0.0
    odd = unexplained(pixels, pixel, n, p, light, fill_variances(pixel, n, p, light, 0.0))
    fill_variances(pixel, n, p, light, scattered)
    out[LEAN] = light_beside(pixel, n, p, options.known_width, shape)
    if odd == 1.0 and options.judge > 0.0:
        return flag
    out[LEAN] = math.copysign(math.inf, out[LEAN])
    if scattered < JUDGED and pixels.correlation.shape[0] == 1 and n > UNKNOWNS:
        return measure_misfit(pixels, seed, n, p, options, out)
    out[SHARED] = math.copysign(out[1] * math.sqrt(odd - 1.0), centroid(pixel, n, p) - p[1])
    out[1] *= math.sqrt(odd)
    return Flag.MISFIT.value


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
def _tell_width(p: Array, hessian: Array, out: Array) -> None:
    """What a fit p (4,) says of its line's width, for its neighbours; hessian (4, 4)."""
    unit, row, count = np.zeros(4), np.empty(4), PRIOR_WIDTHS.shape[0]
    unit[2] = 1.0
    if not solve(hessian, 0.0, unit, np.zeros((4, 4)), row):
        return
    for j in range(count):
        out[TOLD + j] = out[TOLD + count + j] = -0.5 * (PRIOR_WIDTHS[j] - p[2]) ** 2 / row[2]


@njit(nogil=True, cache=True, error_model="numpy")
def _asymmetry(
    pixel: Array, n: int, p: Array, held: bool, shape: Array, hessian: Array, factor: Array, projected: Array
) -> float:
    """Score test for a third Hermite term in the profile: a normal deviate where the line is a Gaussian.

    A neighbour leans a line to one side long before chi-square, which looks in every direction, sees it. held: the
    width is known. factor (4, 4), projected (4,): scratch.
    """
    cross = np.zeros(4)
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
    if not solve(hessian, 0.0, cross, factor, projected):
        return 0.0
    for j in range(4):
        square -= cross[j] * projected[j]
    return float(moment / math.sqrt(square)) if square > 0.0 else 0.0


@njit(nogil=True, cache=True, error_model="numpy")
def _tell_enough(pixel: Array, n: int) -> bool:
    """Whether pixels (4, n) are enough for two lines, or tell that one does not fit: those of a mosaic, few before the
    next peak, are wide apart."""
    return bool(n > UNKNOWNS or pixel[POSITION, n - 1] - pixel[POSITION, 0] >= n)


@peak_kernel
def measure_gaussian(pixels: Pixels, y: int, seed: Array, flag: int, options: Options, out: Array) -> int:
    """Peak kernel (`seed_loop`). options.variant: LEAST_SQUARES or LIKELIHOOD. chi2 only for independent pixels."""
    w, likelihood, p, hessian = pixels.signal.shape[1], options.variant == LIKELIHOOD, np.empty(4), np.empty((4, 4))
    pixel, weight, shape, trial_shape = pixels.room[:4], pixels.room[4], pixels.room[5:8], pixels.room[8:11]
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
        converged = optimise(pixel, count, p, narrowest, options, shape, trial_shape, hessian)
        if not converged:
            break
    if min(p[1], seed[CENTRE]) < 0.5 or max(p[1], seed[CENTRE]) > w - 1.5:
        return Flag.AT_BORDER.value  # less than half of it is seen: any slope would fit
    scattered = pixels.covariances[0, 0] if pixels.covariances.shape[1] > 0 else 0.0
    # who asks how well lines fit (`estimate.py`) wants those that noise has widened as they are
    alike = seed[PRIOR] != 0.0 and options.judge < math.inf and scattered < JUDGED
    if flag == Flag.OK.value and (min(p[2], seed[WIDTH]) < COARSE or alike):
        if not converged:
            p[0], p[1], p[2], p[3] = seed[AMPLITUDE], seed[CENTRE], seed[WIDTH], seed[BACKGROUND]
        if not converged or seed[PRIOR] != 0.0 or _is_coarse(pixel, count, p, options, hessian):
            return _measure_narrow(pixels, pixel, count, p, seed, options, shape, out)
    independent, asked = pixels.correlation.shape[0] == 1, options.judge < math.inf and likelihood
    # what least squares leave over is more than chi-square expects, since they do not weigh
    leans = asked and independent and flag == Flag.OK.value and _tell_enough(pixel, count) and p[2] >= COARSE
    judged = leans and (scattered < JUDGED or options.judge == 0.0)
    if not converged and judged:
        p[0], p[1], p[2], p[3] = seed[AMPLITUDE], seed[CENTRE], seed[WIDTH], seed[BACKGROUND]
        for i in range(count):  # no model has told the variance yet: it is that of the pixels themselves
            floor, light = pixel[FLOOR, i], pixel[ELECTRONS, i] - p[3]
            pixel[VARIANCE, i] = max(pixel[ELECTRONS, i] + floor, 0.1 * abs(floor)) + scattered * light * light
        reason = measure_misfit(pixels, seed, count, p, options, out)
        out[LEAN] = math.copysign(math.inf, centroid(pixel, count, p) - p[1])
        if reason != Flag.MISFIT.value:
            return reason
        out[:] = np.nan
    if not converged:
        return Flag.NOT_CONVERGED.value
    if p[2] > options.max_width:
        return Flag.TOO_WIDE.value
    if max(abs(p[1] - seed[CENTRE]), p[2]) > max(half, 1.0):  # wider than the window, a line may be anything
        return Flag.OUT_OF_WINDOW.value
    factor, row, unit = np.zeros((4, 4)), np.empty(4), np.array([0.0, 1.0, 0.0, 0.0])
    if not solve(hessian, 0.0, unit, factor, row):
        return Flag.NOT_CONVERGED.value
    chi2 = _chi2_and_influence(pixel, count, p, likelihood, shape, row, scattered, weight)
    out[0], out[2], out[3], out[4] = p[1], p[2], p[0], p[3]
    light = trial_shape[0]
    light[:count] = p[0] * shape[0, :count]
    noise, out[CORRELATION_LENGTH], speckled = position_variance(
        pixels, weight, pixel[VARIANCE], light, pixel[POSITION], count, p[2], False
    )
    out[1] = math.sqrt(noise + slope_variance(seed, weight, pixel[POSITION], count))
    if independent:
        out[5] = chi2 / (count - 4)
    if flag == Flag.SATURATED.value:
        _measure_saturated(pixels, y, seed, count, p, chi2, options, out)
    elif likelihood and not options.known_width and p[2] < WIDEST:
        _tell_width(p, hessian, out)
    if flag == Flag.OK.value and speckled > SPECKLED * p[2]:
        return Flag.SPECKLED.value
    if p[2] < COARSE and flag == Flag.OK.value and asked and independent:
        return _judge_narrow(pixels, count, p, seed, options, shape, flag, out)
    if not leans:
        return flag
    pixel[VARIANCE, :count] += scattered * light[:count] * light[:count]
    out[FIT] = deviate(chi2, count - 4)
    asymmetry = _asymmetry(pixel, count, p, options.known_width, shape, hessian, factor, row)
    odd = judged and max(out[FIT], abs(asymmetry)) >= options.judge
    out[LEAN] = math.copysign(math.inf, asymmetry) if odd else asymmetry
    return measure_misfit(pixels, seed, count, p, options, out) if odd else flag
