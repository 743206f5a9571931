"""One ray through the middle of each pixel, and what its neighbours say of the error that leaves.

On a facet the Gaussian over a whole pixel is known in closed form from one ray, and how the radiance beneath it changes
(distance, angles) from the rays beside it. So where a pixel's neighbours, each from its own facet, predict for it what
it says itself, that ray is enough; where they do not (edges, shadows, curvature, texture) their difference bounds the
error, and `render.laser_direct.integrator` looks closer.
"""

from __future__ import annotations

import math

import numba
import numpy as np
from numpy.typing import NDArray

from render.laser.irradiance import INV_SQRT_2PI

Float = NDArray[np.float64]
Int = NDArray[np.int32]

EDGE_SHARE = 0.3
"""RMS error of the middle of a pixel for its mean, over the jump, where an edge crosses it anywhere: 1 / sqrt(12)."""
BEYOND = -1.0
"""In place of the radiance, where the sheet would not reach the pixel whatever stood in its way."""


@numba.njit(nogil=True, cache=True, error_model="numpy")
def look_around(
    start: int,
    stop: int,
    pixels: Int,
    width: int,
    planes: Float,
    middle: Float,
    mean: Float,
    error: Float,
) -> None:
    """Fill mean and error (n,) of pixels start..stop of (n,) ascending flat indices.

    planes (n, 4): q in the middle of the pixel, its change with u and with v, and the radiance in the sheet's middle,
    0 where no light is seen, and then the others are anything; or BEYOND. middle (n,): the Gaussian's mean over the
    pixel times that.
    """
    n = len(pixels)
    # three places in the set that walk along with i: the row before, its own, the row after
    walk = np.empty(3, np.int64)
    for row in range(3):
        walk[row] = np.searchsorted(pixels, pixels[start] + (row - 1) * width - 1)
    for i in range(start, stop):
        q, peak, worst = planes[i, 0], planes[i, 3], 0.0
        # change of the radiance with u and v: half the difference of the neighbours on either side
        along_u = along_v = 0.0
        share = slope = 0.0
        if peak > 0.0:
            share = middle[i] / peak
            # change of the mean over the pixel with q: a difference of densities at its ends
            half = 0.5 * max(abs(planes[i, 1]), abs(planes[i, 2]))
            if half < 0.05:
                slope = abs(q) * share
            else:
                ends = math.exp(-0.5 * (q - half) ** 2) - math.exp(-0.5 * (q + half) ** 2)
                slope = abs(ends) * INV_SQRT_2PI / (2.0 * half)
            # in the very middle the slope vanishes, and the curvature is what counts
            slope = max(slope, 0.25 * share)
        for row in range(3):
            low = pixels[i] + (row - 1) * width - 1
            j = walk[row]
            while j < n and pixels[j] < low:
                j += 1
            walk[row] = j
            while j < n and pixels[j] <= low + 2:
                other = planes[j, 3]
                predicted = planes[j, 0] + planes[j, 1] * (low + 1 - pixels[j]) + planes[j, 2] * (1 - row)
                if peak > 0.0 and other > 0.0:
                    worst = max(worst, peak * slope * min(abs(predicted - q), 1.0) + share * abs(other - peak))
                    if row == 1:
                        along_u += 0.5 * (other - peak) * (pixels[j] - low - 1)
                    elif pixels[j] == low + 1:
                        along_v += 0.5 * (other - peak) * (row - 1)
                elif peak > 0.0 or other > 0.0:
                    # dark beside the line is no edge where the same surface goes on there
                    beyond = min(peak, other) == BEYOND
                    worst = max(worst, max(middle[i], middle[j]) * (min(abs(predicted - q), 1.0) if beyond else 1.0))
                j += 1
        error[i] = EDGE_SHARE * worst
        # the mean of u times the Gaussian over the pixel, the pixel taken for a Gaussian of its variance
        mean[i] = middle[i]
        if peak > 0.0:
            moment = -share * q / (12.0 + planes[i, 1] ** 2 + planes[i, 2] ** 2)
            mean[i] = max(middle[i] + moment * (along_u * planes[i, 1] + along_v * planes[i, 2]), 0.0)


@numba.njit(nogil=True, cache=True)
def gather_first(
    values: Float, occluded: NDArray[np.bool_], sample: Int, count: int, planes: Float, middle: Float
) -> None:
    """Radiance of each pixel (n,) from its one ray; one in the shade has no radiance in the sheet's middle either."""
    for i in range(len(middle)):
        middle[i] = values[i, 0]
    for j in range(count):
        if occluded[j]:
            middle[sample[j]] = planes[sample[j], 3] = 0.0
