"""What is done with a peak that is no single Gaussian: two lines, or one whose sigma holds the misfit."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from analysis.line.methods.line_profile import ELECTRONS, POSITION, VARIANCE, linear_variance
from analysis.line.methods.narrow_line import COARSE
from analysis.line.methods.seed_loop import LEAN, SHARED, Array, Options, Pixels
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
def measure_misfit(pixels: Pixels, seed: Array, n: int, p: Array, options: Options, out: Array) -> int:
    """A line that is no single Gaussian -> out (7,): as two, or as it is with a sigma that holds the misfit.

    pixels.room: what the fit of p (4,) left there. Returns OK for two lines that part. BLENDED for two that do not:
    sigma holds how far the brighter one is from the single line. MISFIT for neither, or one with a flat top: sigma is
    that of the fit times the root of chi-square (Birge, Phys. Rev. 40, 1932), and holds the distance to the centre of
    mass of the same pixels, by which another estimator differs. What neighbours have in common is to the side of the
    other light. A line below COARSE parts from none, is no other line where the pixels do not tell that one to the
    distance between both, and as a MISFIT holds how far the brighter of two lines is.
    """
    pixel, weight, both, chi2 = pixels.room[:4], pixels.room[4], np.zeros(UNKNOWNS), math.inf
    shift = centroid(pixel, n, p) - p[1]
    if n > UNKNOWNS:
        chi2 = fit_two_lines(pixel, n, p, options.known_width, options.integrated, pixels.room[5:11], both, weight)
    distance, narrow = abs(both[5] - both[1]), p[2] < COARSE
    flat = both[4] > EQUAL * both[0] and distance < DIP * both[2]
    if not flat and deviate(chi2, n - UNKNOWNS) < UNLIKELY:
        noise = linear_variance(weight, pixel[VARIANCE], pixel[POSITION], n, pixels.correlation)
        sigma = math.sqrt(noise + slope_variance(seed, weight, pixel[POSITION], n))
        parted = sigma < PARTED * distance and distance > APART * both[2]
        parted = parted and not narrow and (options.known_width or both[2] > FINEST)
        if not narrow or sigma < distance:
            out[0], out[2], out[3], out[4], out[5] = both[1], both[2], both[0], both[3], chi2 / max(n - UNKNOWNS, 1)
            if parted:
                out[1] = sigma
                return Flag.OK.value
            out[SHARED] = p[1] - both[1]
            out[1] = math.hypot(sigma, out[SHARED])
            return Flag.BLENDED.value
    side = shift if math.isnan(out[LEAN]) else out[LEAN]
    if narrow and chi2 < math.inf:
        shift = math.hypot(shift, both[1] - p[1])
    out[SHARED] = math.copysign(math.sqrt(out[1] * out[1] * max(out[5] - 1.0, 0.0) + shift * shift), side)
    out[1] = math.hypot(out[1], out[SHARED])
    return Flag.MISFIT.value
