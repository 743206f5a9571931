"""Which pixels of an image were seen, where a mosaic's filling-in made the others of them.

A sensor's noise bends from pixel to pixel everywhere alike. What bilinear filling-in put between seen pixels lies on
the straight line through its neighbours, so that its second differences are none: along the scan line, across it, or
from the mean of the four pixels around it. Ground is asked, which a line crosses in few pixels.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from render.base.arrays import Float

STRAIGHT = 6.0
"""Times that the second differences' variance of pixels that were filled in is below that of others; by chance, of
1,000 pixels, it is 1.3 times."""
FEWEST = 1000
"""Pixels of one place in the mosaic."""
STRAY, ROUNDS = 4.0, 3
"""Robust sigmas beyond which a second difference is of an edge or a line."""
COARSE = 0.25
"""Share of a squared step, of a variance that a sensor of whole numbers cannot tell from none."""

Seen = NDArray[np.bool_]


def seen_pixels(image: NDArray[np.floating], step: float) -> Seen | None:
    """Numbers (n, w), NaN where unknown, of a quantisation step -> (2, 2) whether the pixels of even and odd scan
    lines (first) and columns are seen; None: no pixel is filled in, or it cannot be told.

    Of a Bayer mosaic a colour is seen at one of the four places, or at two of them across from each other.
    """
    if min(image.shape) < 8:
        return None
    values = image.astype(np.float64)
    values = values[: len(values) // 2 * 2, : values.shape[1] // 2 * 2]
    middle = values[2:-2, 2:-2]
    beside, above = values[2:-2, 1:-3] + values[2:-2, 3:-1], values[1:-3, 2:-2] + values[3:-1, 2:-2]
    bends = middle - 0.5 * beside, middle - 0.5 * above, middle - 0.25 * (beside + above)
    filled = np.zeros((2, 2), np.bool_)
    for bend, rounding in zip(bends, (0.125, 0.125, 5.0 / 48.0), strict=True):
        found = [_variance(bend[y::2, x::2], step) - rounding * step**2 for y in (0, 1) for x in (0, 1)]
        if not np.isfinite(found).all():
            return None
        variance = np.array(found).reshape(2, 2)
        filled |= STRAIGHT * np.maximum(variance, COARSE * step**2 / STRAIGHT) < variance.max()
    seen = ~filled
    alone = seen.sum() == 1 or (seen.sum() == 2 and seen[0, 0] == seen[1, 1])
    return seen if alone else None


def _variance(bends: Float, step: float) -> float:
    """Mean square without strays; NaN of too few."""
    size = np.abs(bends[np.isfinite(bends)])
    if len(size) < FEWEST:
        return np.nan
    sigma = 1.4826 * (float(np.median(size)) + 0.5 * step)
    for _ in range(ROUNDS):
        sigma = float(np.sqrt(np.mean(size[size <= STRAY * sigma] ** 2)))
    return sigma**2
