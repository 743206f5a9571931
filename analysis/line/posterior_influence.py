"""How far each pixel moves a line that is too narrow for its pixels, whose position is a posterior's mean.

The mean c of a density p(c, s) L(y | c, s) moves with a pixel y_i by its covariance with the score (of an exponential
family: Brown, Fundamentals of Statistical Exponential Families, 1986, 2.3),

    dc / dy_i  =  Cov(c, d log L / dy_i)  +  Cov(c, d log L / db)  db / dy_i,      d log L / dy_i = log m_i(c, s),

with m_i the mean of the pixel. The light is the one that fits best, so that its own change adds nothing; the background
b is the fit's. What neighbours tell of the width stays as it is; what the pixels tell of the width themselves follows
likewise, with s in place of c.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.special import erf

from analysis.line.detection.detect import PRIOR_WIDTHS
from analysis.line.methods.narrow_line import BESIDE, CENTRES, FARTHEST, LOOKS, RESOLVED, RESOLVED_PLACE, WIDTHS
from analysis.line.methods.shared_width import width_priors
from render.base.arrays import Float

Pixels = tuple[Float, Float, Float, Float, Float]
"""Of n scan lines: positions, electrons, floor and 1 where a pixel is used, else 0 (n, m); background (n, 1)."""
Told = tuple[Float, Float, Float, Float, Float]
"""Of n scan lines and k widths: logarithm of the likelihood at the best place and over all, mean and variance of the
place (n, k); mean of the m + 1 scores, and their covariance with the place (n, k, 2, m + 1)."""


def posterior_influence(
    pixels: Pixels, u: Float, sigma_u: Float, by_background: Float, width: float | None, integrated: bool
) -> tuple[Float, Float]:
    """Neighbouring scan lines (n, m) -> weights (n, m) of the place and of the width, px / e-.

    u, sigma_u (n,) px as measured; by_background (n, m): how far each pixel moves the background; width: px, if known.
    """
    widths: Float = PRIOR_WIDTHS if width is None else np.array([width])
    look = _each_width(pixels, np.broadcast_to(widths, (len(u), len(widths))), u, integrated)
    if width is None:
        told = np.hstack([log - log.max(axis=1, keepdims=True) for log in look[:2]])
        shared = width_priors(told, u, sigma_u)
        prior = np.zeros((len(u), len(widths))) if shared is None else shared[0]
        both = _over_widths(pixels, look, u, prior, integrated)
    else:
        both = np.stack((look[4][:, 0, 1], np.zeros_like(look[4][:, 0, 1])))
    place, wide = (both[..., :-1] + both[..., -1:] * by_background) * pixels[3]
    return place, wide


def _each_width(pixels: Pixels, widths: Float, u: Float, integrated: bool) -> Told:
    """Of lines of some widths (n, k). A narrower line is near where the wider one is, at a place that is more exact."""
    first, last = u[:, None] - FARTHEST, u[:, None] + FARTHEST
    low, high, found = first, last, []
    for j in range(widths.shape[1] - 1, -1, -1):
        found.append(_over_places(pixels, widths[:, j : j + 1], low, high, integrated))
        _, _, place, variance, _ = found[-1]
        reach = 4.0 * np.sqrt(variance) + BESIDE
        low, high = np.maximum(place - reach, first), np.minimum(place + reach, last)
    best, total, place, variance, scores = (np.concatenate(one[::-1], axis=1) for one in zip(*found, strict=True))
    return best, total, place, variance, scores


def _over_widths(pixels: Pixels, look: Told, u: Float, prior: Float, integrated: bool) -> Float:
    """Covariance (2, n, m + 1) of place and width with scores over all widths, of a look at PRIOR_WIDTHS; the prior's
    logarithm (n, len(PRIOR_WIDTHS))."""
    widths: Float = np.broadcast_to(PRIOR_WIDTHS, prior.shape)
    step = np.full(len(u), PRIOR_WIDTHS[1] - PRIOR_WIDTHS[0])
    weight = _weights(look[1] + prior, widths)
    moved = _covariance(look, weight, u, widths)
    left = np.arange(len(u))
    for _ in range(LOOKS):
        mean = (weight * widths).sum(axis=1)
        spread = np.maximum((weight * widths**2).sum(axis=1) - mean**2, 0.0)
        unresolved = spread <= RESOLVED * step**2
        if not unresolved.any():
            break
        left, mean, step, spread = (array[unresolved] for array in (left, mean, step, spread))
        reach = 4.0 * np.sqrt(spread + step**2 / 12.0)
        low = np.maximum(mean - reach, PRIOR_WIDTHS[0])
        step = (mean + reach - low) / (WIDTHS - 1)
        widths = low[:, None] + step[:, None] * np.arange(WIDTHS)
        some = tuple(array[left] for array in pixels)
        assert len(some) == 5
        look = _each_width(some, widths, u[left], integrated)
        weight = _weights(look[1] + _prior_at(prior[left], widths), widths)
        moved[:, left] = _covariance(look, weight, u[left], widths)
    return moved


def _weights(log: Float, widths: Float) -> Float:
    """(n, k), summing to 1."""
    ends = np.pad(widths, ((0, 0), (1, 1)), mode="edge")
    weight = np.exp(log - log.max(axis=1, keepdims=True)) * (ends[:, 2:] - ends[:, :-2])
    return np.asarray(weight / weight.sum(axis=1, keepdims=True))


def _covariance(look: Told, weight: Float, u: Float, widths: Float) -> Float:
    """By the law of total covariance, (2, n, m + 1)."""
    _, _, place, _, scores = look
    # (2, n, k): place and width, from their means
    apart = np.stack((place - u[:, None], widths))
    apart -= np.einsum("nk,ank->an", weight, apart)[..., None]
    found = np.einsum("nk,ank,nki->ani", weight, apart, scores[:, :, 0])
    found[0] += np.einsum("nk,nki->ni", weight, scores[:, :, 1])
    return np.asarray(found)


def _prior_at(prior: Float, widths: Float) -> Float:
    """(n, k): the prior of PRIOR_WIDTHS by the parabola through the nearest three, as in `narrow_line`."""
    middles = 0.5 * (PRIOR_WIDTHS[1:-2] + PRIOR_WIDTHS[2:-1])
    j = 1 + np.searchsorted(middles, widths)
    left, middle, right = PRIOR_WIDTHS[j - 1], PRIOR_WIDTHS[j], PRIOR_WIDTHS[j + 1]
    first, second, third = (np.take_along_axis(prior, j + k, axis=1) for k in (-1, 0, 1))
    below, above = (second - first) / (middle - left), (third - second) / (right - middle)
    return np.asarray(second + (widths - middle) * (below + (widths - left) * (above - below) / (right - left)))


def _over_places(pixels: Pixels, widths: Float, first: Float, last: Float, integrated: bool) -> Told:
    """Of lines of some widths (n, k) between two places (n, 1)."""
    low, high = (np.broadcast_to(end, widths.shape).copy() for end in (first, last))
    for look in range(LOOKS):
        step = (high - low) / (CENTRES - 1)
        places = low[..., None] + step[..., None] * np.arange(CENTRES)
        log, mean = _log_likelihood(pixels, widths, places, integrated)
        best = log.max(axis=2)
        weight = np.exp(log - best[..., None])
        total = weight.sum(axis=2)
        weight /= total[..., None]
        apart = places - first[..., None]
        place = (weight * apart).sum(axis=2)
        variance = np.maximum((weight * apart**2).sum(axis=2) - place**2, 0.0) + step**2 / 12.0
        near = variance <= RESOLVED_PLACE * step**2
        if look == LOOKS - 1 or not near.any():
            break
        reach = 4.0 * np.sqrt(variance)
        low = np.where(near, np.maximum(first + place - reach, first), low)
        high = np.where(near, np.minimum(first + place + reach, last), high)
    _, electrons, floor, used, _ = pixels
    by_background = ((electrons + floor)[:, None, None] / mean * used[:, None, None]).sum(axis=3, keepdims=True)
    scores = np.concatenate((np.log(mean), by_background), axis=3)
    of_place = weight * (apart - place[..., None])
    found = np.einsum("bnkc,nkci->nkbi", np.stack((weight, of_place)), scores)
    return best, best + np.log(total * step), first + place, variance, found


def _log_likelihood(pixels: Pixels, widths: Float, places: Float, integrated: bool) -> tuple[Float, Float]:
    """Logarithm of the likelihood (n, k, c) of lines at some places, as in `narrow_line`, and the pixels' means."""
    x, electrons, floor, used, background = (array[:, None, None] for array in pixels)
    sigma = widths[..., None, None]
    apart = (x - places[..., None]) / sigma
    if integrated:
        edges = erf(np.concatenate((apart - 0.5 / sigma, apart[..., -1:] + 0.5 / sigma), axis=3) * math.sqrt(0.5))
        shape = sigma * math.sqrt(0.5 * math.pi) * np.diff(edges, axis=3)
    else:
        shape = np.exp(-0.5 * apart**2)
    least = 0.1 * floor
    amplitude: Float = np.maximum(((electrons - background) * used).max(axis=3, keepdims=True), 0.0)
    for _ in range(2):  # the weights of the second are those of the amplitude of the first
        weighed = shape * used / np.maximum(amplitude * shape + background + floor, least)
        information = np.maximum((weighed * shape).sum(axis=3, keepdims=True), 1e-300)
        moment = (weighed * (electrons - background)).sum(axis=3, keepdims=True)
        amplitude = np.maximum(moment / information, 0.0)
    mean = np.maximum(amplitude * shape + background + floor, least)
    log = (((electrons + floor) * np.log(mean) - mean) * used).sum(axis=3)
    return log + np.log(widths)[..., None] - 0.5 * np.log(information[..., 0]), mean
