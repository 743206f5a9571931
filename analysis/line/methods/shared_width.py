"""The width that a narrow line has in common with its neighbours, as a prior for those that hardly tell it.

The pixels of scan line j tell how likely the width s is at the place c that suits it best, P_j(s), and over all places
in the pixel, M_j(s) (`narrow_line.py`). Where neighbours hold the same width the product over them says it best, the
line's own part left out. Places that are as many as the lines tell the width by how often the line is split between
two pixels, as in M; at one place that all have in common this would be counted over and over, and only P is each
line's own:

    log p(s)  =  sum_j  log P_j + t (log M_j - log P_j)        t: places among the lines over their number

How much better that is than one line alone depends on how well they agree (the same in Bayesian terms: Gelman et al.,
Bayesian Data Analysis, 5.4, with the spread as given).
"""

from __future__ import annotations

from functools import cache

import numba
import numpy as np

from analysis.line.detection.detect import PRIOR_WIDTHS
from analysis.line.result import NEIGHBOURS
from render.base.arrays import Float

FEWEST = 8
STRANGE = 3.0, 5.0
"""Standard deviations up to which a scan line wholly shares its neighbours' width, and from which it does not at all:
a sharp limit between them let a little noise in one line move all of its neighbours."""
SPREAD = 0.015
"""px; neighbours differ by as much."""
SURE = 0.02
"""px; a line that tells its own width better needs no neighbours."""
WIDEST = 0.5
"""px; a wider line is resolved by itself."""
FINE_STEP = 0.005
FINE_WIDTHS = np.arange(PRIOR_WIDTHS[0], PRIOR_WIDTHS[-1], FINE_STEP)
"""px; many lines tell their width better than to a step of PRIOR_WIDTHS."""
STEP = 3.0
"""Standard deviations from which a line is at another place in its pixel than the one before."""
LEAST = 1e-30
"""Relative density of a width that the neighbours rule out."""


@cache
def between() -> Float:
    """(f, m): from a smooth function at PRIOR_WIDTHS to FINE_WIDTHS."""
    from scipy.interpolate import CubicSpline  # a tenth of the window's start, and needed by narrow lines alone

    return np.asarray(CubicSpline(PRIOR_WIDTHS, np.eye(len(PRIOR_WIDTHS)))(FINE_WIDTHS))


def width_priors(told: Float, u: Float, sigma_u: Float) -> tuple[Float, Float] | None:
    """What scan lines tell of their width (n, 2 m), the first NaN where nothing, their positions and sigmas (n,), px ->
    the logarithm of the density of each of the m PRIOR_WIDTHS by a line's neighbours, all 0 where a line
    needs none or does not share theirs; and what makes of the covariance of place and width the error that a line has
    in common with its neighbours, 1/px, 0 where nothing is shared. None: none needs any.

    By the delta method: the neighbours' width is uncertain by V, and one line's by V + SPREAD^2, so that a position
    moves by cov(c, s) sqrt(V) / (V + SPREAD^2) for one standard deviation of what all of them are wrong by together.
    """
    known = np.isfinite(told[:, 0]) & np.isfinite(u) & np.isfinite(sigma_u)
    known[known] = np.isfinite(told[known]).all(axis=1)
    if known.sum() < FEWEST:
        return None
    best, mass = np.split(np.where(known[:, None], told, 0.0), 2, axis=1)
    _, variance = _moments(mass, PRIOR_WIDTHS)
    moved = _new_places(np.where(known, u, np.nan), sigma_u)
    alike = known.astype(np.float64)
    for _ in range(2):
        at_best, places = (_of_neighbours(alike[:, None] * part) for part in (best, mass - best))
        count = _of_neighbours(alike)
        independent = 1.0 + _of_neighbours(moved)
        total = at_best + np.minimum(independent / np.maximum(count, 1.0), 1.0)[:, None] * places
        log = _weighed(total, between())
        shared, _ = _moments(log, FINE_WIDTHS)
        enough = known & (count >= FEWEST)
        apart = _deviance(mass, shared)
        # those that scatter more than their pixels say, by speckle, say less
        usual = apart[enough]
        scatter = max(float(np.median(usual)) / 0.455, 1.0) if len(usual) else 1.0
        alike = known * _alike(np.sqrt(apart / scatter))
    needed = enough & (alike > 0.0) & (shared < WIDEST) & (variance * scatter > SURE**2)
    if not needed.any():
        return None
    log = (log - log.max(axis=1, keepdims=True)) / scatter
    _, variance = _moments(log, FINE_WIDTHS)
    variance += FINE_STEP**2 / 12.0
    density = np.exp(log)
    apart = (PRIOR_WIDTHS[:, None] - FINE_WIDTHS) / SPREAD
    density = _weighed(density / density.sum(axis=1, keepdims=True), np.exp(-0.5 * apart**2))
    shared = np.where(needed, alike * np.sqrt(variance) / (variance + SPREAD**2), 0.0)
    return np.where(needed[:, None], alike[:, None] * np.log(density + LEAST), 0.0), shared


def _alike(apart: Float) -> Float:
    """Standard deviations from the neighbours' width -> the weight of a line among them, 1 to 0."""
    near, far = STRANGE
    return np.clip((far - apart) / (far - near), 0.0, 1.0)


def _deviance(log: Float, width: Float) -> Float:
    """(n, m) logarithms of densities at PRIOR_WIDTHS and widths (n,) -> (n,) twice what a width is less likely than the
    likeliest: chi-square where it is the true one, also where the density is far from normal."""
    left = np.clip(np.searchsorted(PRIOR_WIDTHS, width) - 1, 0, len(PRIOR_WIDTHS) - 2)
    along = (width - PRIOR_WIDTHS[left]) / (PRIOR_WIDTHS[left + 1] - PRIOR_WIDTHS[left])
    rows = np.arange(len(log))
    there = (1.0 - along) * log[rows, left] + along * log[rows, left + 1]
    return np.asarray(2.0 * np.maximum(log.max(axis=1) - there, 0.0))  # rounding may put it above the largest


def _moments(log: Float, widths: Float) -> tuple[Float, Float]:
    """Mean and variance, px and px^2, of the width by the logarithm of its density (n, m) at widths (m,)."""
    density = np.exp(log - log.max(axis=1, keepdims=True)) * np.gradient(widths)
    density /= density.sum(axis=1, keepdims=True)
    mean = _weighed(density, widths[None])[:, 0]
    return mean, np.maximum(_weighed(density, widths[None] ** 2)[:, 0] - mean**2, 1e-12)


def _weighed(values: Float, weights: Float) -> Float:
    """(n, m), (k, m) -> (n, k): sums over m, to the bit the same wherever in an image a scan line is."""
    out = np.zeros((len(values), len(weights)))
    add_weighed(values, np.ascontiguousarray(weights.T), out)
    return out


@numba.njit(nogil=True, cache=True, error_model="numpy")
def add_weighed(values: Float, weights: Float, out: Float) -> None:
    """Add the products (n, m) times (m, k), term by term in one order, to out (n, k)."""
    for i in range(values.shape[0]):
        for j in range(values.shape[1]):
            for k in range(weights.shape[1]):
                out[i, k] += values[i, j] * weights[j, k]


def _new_places(u: Float, sigma_u: Float) -> Float:
    """How far each line's place in its pixel differs from that of the ones beside it: 1 on average if by chance.

    Twelve times the squared distance, the shorter way round, where it is no matter of noise.
    """
    step = np.diff(u, prepend=np.nan)
    apart = (step - np.rint(step)) ** 2
    noise = sigma_u**2 + np.append(np.nan, sigma_u[:-1]) ** 2
    moved = np.where(apart > STEP**2 * noise, 12.0 * apart, 0.0)
    return 0.5 * (moved + np.append(moved[1:], 0.0))


def _of_neighbours(values: Float) -> Float:
    """(n, ..) -> sums over the neighbours of each, itself left out."""
    padded = np.pad(values, [(NEIGHBOURS, NEIGHBOURS)] + [(0, 0)] * (values.ndim - 1))
    total = np.zeros_like(values)
    for distance in range(1, NEIGHBOURS + 1):  # both sides at once: upside down it is the same to the last bit
        total += padded[NEIGHBOURS - distance :][: len(values)] + padded[NEIGHBOURS + distance :][: len(values)]
    return total
