"""The width that a narrow line has in common with its neighbours, as a prior for those that hardly tell it.

The pixels of scan line j say of the width s  exp(k_j s + q_j s^2)  (`narrow_line.py`). Where neighbours hold the same
width the product over them says it best, the line's own part left out; how much better than one alone depends on how
well they agree (the same in Bayesian terms: Gelman et al., Bayesian Data Analysis, 5.4, with the spread as given).
"""

from __future__ import annotations

import numpy as np

from render.base.arrays import Float

NEIGHBOURS = 32
"""Scan lines on either side."""
FEWEST = 8
STRANGE = 4.0
"""Standard deviations from which a scan line does not share its neighbours' width."""
SPREAD = 0.02
"""px; neighbours differ by as much."""
SURE = 0.02
"""px; a line that tells its own width better needs no neighbours."""
WIDEST = 0.5
"""px; a wider line is resolved by itself."""


def width_priors(told: Float) -> Float | None:
    """k, q by scan line (n, 2), NaN where there is no narrow line -> those of its neighbours (n, 2), 0 where a scan
    line needs none or does not share theirs; None: none needs any."""
    known = np.isfinite(told).all(axis=1)
    if known.sum() < FEWEST:
        return None
    own_k, own_q = np.where(known, told[:, 0], 0.0), np.where(known, told[:, 1], 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        variance = np.where(own_q < 0.0, -0.5 / own_q, np.inf)
        alike = known
        for _ in range(2):
            k, q, count = (_of_neighbours(np.where(alike, v, 0.0)) for v in (own_k, own_q, np.ones(len(told))))
            sharp = (q < 0.0) & (count >= FEWEST)
            shared = np.where(sharp, -0.5 * k / q, np.nan)
            apart = (own_k * variance - shared) ** 2 / variance
            # those that scatter more than their pixels say, by speckle, say less
            usual = apart[np.isfinite(apart) & np.isfinite(variance)]
            scatter = max(float(np.median(usual)) / 0.455, 1.0) if len(usual) else 1.0
            alike = known & ~(apart > STRANGE**2 * scatter)
    spread = np.where(sharp, scatter * -0.5 / np.where(sharp, q, -1.0), 1.0) + SPREAD**2
    needed = known & alike & sharp & (shared < WIDEST) & (variance * scatter > SURE**2)
    if not needed.any():
        return None
    return np.where(needed[:, None], np.stack([shared / spread, -0.5 / spread], axis=1), 0.0)


def _of_neighbours(values: Float) -> Float:
    """(n,) -> sums over the neighbours of each, itself left out."""
    padded = np.pad(values, NEIGHBOURS)
    total = np.zeros(len(values))
    for distance in range(1, NEIGHBOURS + 1):  # both sides at once: upside down it is the same to the last bit
        total += padded[NEIGHBOURS - distance :][: len(values)] + padded[NEIGHBOURS + distance :][: len(values)]
    return total
