"""The slope of the background under a peak, from the pixels on either side that the peak does not reach.

    y = b + m (i - c)     least squares over  4 s + 1.5 < |i - c| < 8 s + 6.5  px, c and s those of the seed

A slope m of the background moves a centroid by m times the window's second moment over the line's light, and a fit of a
line on level ground by as much. The pixels beyond 4 s know it so well that a free slope costs 2 % of the efficiency,
where the fit's own window would make it 17 % in read noise. It is taken off where it is SURE, and what is left unknown
of it is part of sigma_u.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from render.base.arrays import Float32

Array = NDArray[np.float64]
Mask = NDArray[np.uint8]

FEWEST = 3
"""Pixels on either side."""
BENT = 4.0
"""Standard deviations by which the slopes of both sides differ from which they are of no straight background: the tail
of a second line, which would be taken off the first, and is none of the slope's own uncertainty."""
SURE = 2.0
"""Standard deviations from which a slope is taken off: left in, it moves a fit by a third of its sigma at most."""


@njit(nogil=True, cache=True, error_model="numpy")
def background_slope(
    signal: Float32, mask: Mask, floor: Float32, centre: float, inner: float, outer: float
) -> tuple[float, float, float]:
    """Background of a scan line (w,) at distances inner..outer px from a peak: level at the peak, e-, slope, e-/px, and
    the slope's standard deviation.

    floor (w,) or (1,): variance of a pixel without signal, e-^2. The slope is 0 where it is not sure, and so is its
    sigma where a side has no pixels. What scatters more than a count does makes it less sure.
    """
    count, n = 0, signal.shape[0]
    sx = sy = sxx = sxy = syy = dark = left_slope = left_spread = 0.0
    for side in range(2):
        low, high = (centre - outer, centre - inner) if side == 0 else (centre + inner, centre + outer)
        ax = ay = axx = axy = 0.0
        before = count
        for i in range(max(0, math.ceil(low)), min(n - 1, math.floor(high)) + 1):
            if mask[i] == 0:
                x, y = i - centre, float(signal[i])
                dark += floor[min(i, floor.shape[0] - 1)]
                ax += x
                ay += y
                axx += x * x
                axy += x * y
                syy += y * y
                count += 1
        own = count - before
        if own < FEWEST:
            return 0.0, 0.0, 0.0
        own_spread = axx - ax * ax / own
        own_slope = (axy - ax * ay / own) / own_spread
        if side == 0:
            left_slope, left_spread = own_slope, own_spread
        sx, sy, sxx, sxy = sx + ax, sy + ay, sxx + axx, sxy + axy
    spread = sxx - sx * sx / count
    slope = (sxy - sx * sy / count) / spread
    left_over = syy - sy * sy / count - slope * slope * spread
    counted = max((sy + dark) / count, 0.1 * abs(dark) / count)
    bend = abs(own_slope - left_slope) / math.sqrt(counted / own_spread + counted / left_spread)
    if bend > BENT:
        return (sy - slope * sx) / count, 0.0, math.sqrt(counted / spread)
    sigma = math.sqrt(max(counted, left_over / (count - 2)) / spread)
    return (sy - slope * sx) / count, slope if abs(slope) > SURE * sigma else 0.0, sigma
