"""Points that stand alone, told from the edges of steps: false ones, which would draw a fit or an area to them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from analysis.measures import robust_sigma
from render.base.arrays import Float

NEIGHBOURS = 5
"""Points in a row whose median tells a spike from a step."""
SIGMAS = 5.0


def spikes(places: Float, sigma: Float) -> NDArray[np.bool_]:
    """(n,) of (n, 2) places along and across, in their order, and their (n,) sigmas: those far off their neighbours.

    Off the median of these, or off a line through them, whichever is less: the median keeps the edges of a step, the
    line (Sen, J. Am. Stat. Assoc. 63, 1968) a slope.
    """
    if len(places) < NEIGHBOURS:
        return np.zeros(len(places), dtype=np.bool_)
    half = NEIGHBOURS // 2
    x, y = (np.lib.stride_tricks.sliding_window_view(np.pad(one, half, mode="reflect"), NEIGHBOURS) for one in places.T)
    i, j = np.triu_indices(NEIGHBOURS, 1)
    run = x[:, j] - x[:, i]
    slope = np.median((y[:, j] - y[:, i]) / np.where(run == 0.0, np.inf, run), axis=1)
    beside = y - slope[:, None] * (x - x[:, [half]])
    middle = y[:, half]
    off = np.minimum(np.abs(middle - np.median(y, axis=1)), np.abs(middle - np.median(beside, axis=1)))
    return np.asarray(off > SIGMAS * np.maximum(robust_sigma(off), sigma))
