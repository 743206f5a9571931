"""What is done with a peak that is no single Gaussian: two lines, or one whose sigma holds the misfit."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from analysis.line.methods.line_profile import ELECTRONS, POSITION, VARIANCE, linear_variance, profile
from analysis.line.methods.narrow_line import COARSE
from analysis.line.methods.seed_loop import CORRELATION_LENGTH, LEAN, SHARED, Array, Options, Pixels
from analysis.line.methods.two_lines import UNKNOWNS, fit_two_lines
from analysis.line.methods.window import slope_variance
from analysis.line.result import Flag

UNLIKELY = 4.5
"""Standard normal deviates: one good line in 100,000 is measured again, by chi-square or by its asymmetry. At 3.7 it
were one in 3,000, and one of those that is taken for two lines costs as much as all the noise."""
FINEST = 0.4
"""px; narrower lines do not part: three pixels with all the light of one may be two as well."""
PARTED, APART = 0.05, 1.2
"""Two lines part where sigma is less than this of their distance, so that the fit is linear, and the distance more than
this of their own sigma: closer ones explain as well what is noise of another kind."""

ONE_PEAK, BESIDE_IT = 2.0, 0.1
"""Two lines closer than this many of their sigmas have one peak, also where both are alike. Mostly that is one line of
another shape, which the single Gaussian measures ten times as well as the brighter of two does; but where this is
known to be off the single one by less than so much of its sigma, what is beside it is faint, and the mean over lines
that all have it is better."""
EQUAL, DIP = 0.6, 3.0
"""Two lines are a single one with a flat top, out of focus, where the fainter has more than this of the other's height
and they are closer than this many of their sigmas: no dip between them tells two."""


@njit(nogil=True, cache=True, error_model="numpy")
def deviate(chi2: float, freedom: int) -> float:
    """Standard normal deviate of a chi-square (Wilson and Hilferty, PNAS 17, 1931)."""
    spread = 2.0 / (9.0 * max(freedom, 1))
    return float(((chi2 / max(freedom, 1)) ** (1.0 / 3.0) - 1.0 + spread) / math.sqrt(spread))


@njit(nogil=True, cache=True, error_model="numpy")
def centroid(pixel: Array, n: int, p: Array) -> float:
    """Centre of mass of pixels (4, n) above the background of a fit p (4,), within 3 sigmas of its centre."""
    mass = moment = 0.0
    for i in range(n):
        x = pixel[POSITION, i] - p[1]
        if abs(x) <= 3.0 * p[2] + 0.5:
            mass += pixel[ELECTRONS, i] - p[3]
            moment += (pixel[ELECTRONS, i] - p[3]) * x
    return float(p[1] + moment / mass) if mass > 0.0 else p[1]


@njit(nogil=True, cache=True, error_model="numpy")
def _distortion(residual: Array, n: int) -> float:
    """Sum of squares of residuals (n,) as far as they run smoothly over the pixels; about 0 where each is on its own.

    Less what second differences say of independent ones, of whose square their mean square is six times.
    """
    square = rough = 0.0
    for i in range(n):
        square += residual[i] * residual[i]
        if 0 < i < n - 1:
            rough += (residual[i - 1] - 2.0 * residual[i] + residual[i + 1]) ** 2
    return max(square - rough / 6.0 * n / max(n - 2, 1), 0.0)


@njit(nogil=True, cache=True, error_model="numpy")
def distortions(pixel: Array, n: int, p: Array, integrated: bool, shape: Array) -> tuple[float, float]:
    """Chi-square of what a fit p (4,) leaves over in pixels (4, n) that runs smoothly, and of its odd part, which is
    more on one side and less on the other. shape (3, n): scratch.

    By Cauchy and Schwarz a distortion of chi-square q moves the centre by up to sigma q^(1/2), an even one by nothing.
    """
    profile(pixel[POSITION], n, p[1], p[2], integrated, shape)
    residual, odd = shape[1], shape[2]
    pitch = (pixel[POSITION, n - 1] - pixel[POSITION, 0]) / (n - 1)  # of a mosaic, two pixels
    for i in range(n):
        residual[i] = (pixel[ELECTRONS, i] - p[0] * shape[0, i] - p[3]) / math.sqrt(pixel[VARIANCE, i])
    for i in range(n):
        mirrored = min(max((2.0 * p[1] - pixel[POSITION, i] - pixel[POSITION, 0]) / pitch, 0.0), n - 1.0)
        left = min(int(mirrored), n - 2)
        odd[i] = residual[i] - residual[left] - (mirrored - left) * (residual[left + 1] - residual[left])
    return _distortion(residual, n), 0.25 * _distortion(odd, n)


@njit(nogil=True, cache=True, error_model="numpy")
def measure_misfit(pixels: Pixels, seed: Array, n: int, p: Array, options: Options, out: Array) -> int:
    """A line that is no single Gaussian -> out (7,): as two, or as it is with a sigma that holds the misfit.

    pixels.room: what the fit of p (4,) left there. Returns OK for two lines that part. BLENDED for two that do not:
    where they are comparable and have one peak the single line, whose sigma holds how far the brighter one is and may
    be, up to its width; else the brighter one, whose sigma holds how far the single line is. MISFIT for neither, or one
    with a flat top: sigma is that of the fit times the root of chi-square (Birge, Phys. Rev. 40, 1932), of what runs
    smoothly over the pixels the whole and not the reduced one (`distortions`; of a flat top its odd part), and holds
    the distance to the centre of mass of the same pixels, by which another estimator differs. What neighbours have in
    common is to the side of the other light. A line below COARSE parts from none, is no other line where the pixels do
    not tell that one to the distance between both, and as a MISFIT holds how far the brighter of two lines is.
    """
    pixel, weight, both, chi2 = pixels.room[:4], pixels.room[4], np.zeros(UNKNOWNS), math.inf
    shift = centroid(pixel, n, p) - p[1]
    every, odd = distortions(pixel, n, p, options.integrated, pixels.room[5:8])
    if n > UNKNOWNS:
        chi2 = fit_two_lines(pixel, n, p, options.known_width, options.integrated, pixels.room[5:11], both, weight)
    distance, narrow = abs(both[5] - both[1]), p[2] < COARSE
    flat = both[4] > EQUAL * both[0] and distance < DIP * both[2]
    if not flat and deviate(chi2, n - UNKNOWNS) < UNLIKELY:
        noise = linear_variance(weight, pixel[VARIANCE], pixel[POSITION], n, pixels.correlation)
        sigma = math.sqrt(noise + slope_variance(seed, weight, pixel[POSITION], n))
        parted = sigma < PARTED * distance and distance > APART * both[2]
        parted = parted and not narrow and (options.known_width or both[2] > FINEST)
        converged = not math.isnan(out[CORRELATION_LENGTH])
        if not converged:  # of a single line
            out[CORRELATION_LENGTH] = pixels.alike
        if not narrow or sigma < distance:
            shift = p[1] - both[1]
            off = math.hypot(shift, sigma)
            if distance < ONE_PEAK * both[2] and off > BESIDE_IT * both[2] and converged and not parted:
                out[SHARED] = math.copysign(min(off, max(abs(shift), both[2])), shift)
                out[1] = math.hypot(out[1], out[SHARED])
                return Flag.BLENDED.value
            out[0], out[2], out[3], out[4], out[5] = both[1], both[2], both[0], both[3], chi2 / max(n - UNKNOWNS, 1)
            if parted:
                out[1] = sigma
                return Flag.OK.value
            out[SHARED], out[1] = shift, off
            return Flag.BLENDED.value
    distorted = odd if flat else every
    side = shift if math.isnan(out[LEAN]) else out[LEAN]
    if narrow and chi2 < math.inf:
        shift = math.hypot(shift, both[1] - p[1])
    out[SHARED] = math.copysign(math.sqrt(out[1] * out[1] * (max(out[5] - 1.0, 0.0) + distorted) + shift * shift), side)
    out[1] = math.hypot(out[1], out[SHARED])
    return Flag.MISFIT.value
