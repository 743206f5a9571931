"""The photon transfer of a background that is not level: its noise against its level tells the gain.

    variance  =  read noise^2  +  gain level          in DN (Janesick, Photon Transfer, 2007, eq. 5.1)

Texture is no noise and grows as the square of the level: then no straight line through a variance above 0 fits, and
nothing is told.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from render.base.arrays import Float

LEVELS = 16
"""Levels, each with as many pairs of neighbouring pixels."""
PAIRS = 500
"""Fewest of a level."""
SURE = 10.0
"""Standard errors of the gain, and times the noise that the levels must differ by."""
MISFIT, ABOVE = 3.0, 3.0
"""Largest reduced chi-square of the straight line; standard errors by which it may run below 0 without light."""
STRAY = 4.0
"""Robust sigmas of a step between neighbours beyond which it is an edge."""


def ground_transfer(ground: NDArray[np.float64], step: float) -> tuple[float, float] | None:
    """(n, w) background, DN, NaN elsewhere, in numbers of this step -> gain, DN per electron, and read noise, e-.

    None: it does not tell.
    """
    steps = np.subtract(ground[:, 1:], ground[:, :-1], dtype=np.float64)
    usual = np.isfinite(steps).any(axis=1)
    steps = steps[usual] - np.nanmedian(steps[usual], axis=1, keepdims=True)  # a slope is no noise
    level = 0.5 * (ground[usual, 1:] + ground[usual, :-1])
    both = np.isfinite(steps)
    steps, level = steps[both], level[both].astype(np.float64)
    if len(level) < LEVELS * PAIRS:
        return None
    parts = np.array_split(np.argsort(level, kind="stable"), LEVELS)
    mean = np.array([level[part].mean() for part in parts])
    variance = np.array([_variance(steps[part], step) for part in parts])
    if not np.all(variance > 0.0) or mean[-1] - mean[0] < SURE * np.sqrt(variance.max()):
        return None
    # steps that share a pixel are correlated by a half: their squares count for two thirds
    weight = np.array([len(part) for part in parts]) / (3.0 * variance**2)
    design = np.stack([np.ones(LEVELS), mean], axis=1)
    covariance = np.linalg.inv((design * weight[:, None]).T @ design)
    dark, gain = covariance @ (design.T @ (weight * variance))
    error = np.sqrt(np.diag(covariance))
    chi2 = float(np.sum(weight * (variance - dark - gain * mean) ** 2)) / (LEVELS - 2)
    straight = chi2 < MISFIT and dark > -ABOVE * error[0]
    if not (straight and gain > SURE * error[1]):
        return None
    return float(gain), float(np.sqrt(max(dark, 0.0)) / gain)


def _variance(steps: Float, step: float) -> float:
    """Variance of a pixel by steps between neighbours (m,), edges clipped out, without that of rounding."""
    sigma = 1.4826 * (float(np.median(np.abs(steps))) + 0.5 * step)
    for _ in range(3):
        sigma = float(np.sqrt(np.mean(steps[np.abs(steps) <= STRAY * sigma] ** 2)))
    return 0.5 * sigma**2 - step**2 / 12.0
