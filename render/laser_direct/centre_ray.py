"""One ray through the centre of each pixel, and the error that this leaves, estimated from the pixel's neighbours.

On a facet one ray gives the Gaussian's mean over the whole pixel in closed form, and the neighbouring rays give the
gradient of the radiance beneath it (distance, angles). Where a pixel's neighbours, each from its own facet, predict the
value that the pixel has, one ray is enough. Where they do not (edges, shadows, curvature, texture) their difference
bounds the error, and `render.laser_direct.integrator` divides the pixel.
"""

from __future__ import annotations

import math

import numba
import numpy as np
from numpy.typing import NDArray

from render.base.arrays import Float, Int
from render.laser.irradiance import INV_SQRT_2PI
from render.laser_direct.adaptive_sampling import neighbours_in_row

EDGE_SHARE = 0.3
"""RMS error, as a fraction of the jump, of taking a pixel's centre for its mean where an edge crosses it anywhere:
1 / sqrt(12), rounded up.
"""
BEYOND = -1.0
"""Marks, in place of the radiance, a pixel whose surface lies outside the sheet, occluded or not."""


@numba.njit(nogil=True, cache=True, error_model="numpy")
def estimate_errors(
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

    planes (n, 4): q at the pixel's centre, its derivatives by u and v, and the radiance in the sheet's middle. That is
    0 where no light is seen, and q and its derivatives are then undefined; or BEYOND. middle (n,): the radiance times
    the Gaussian's mean over the pixel.
    """
    walk = np.empty(3, np.int64)
    for row in range(3):
        walk[row] = np.searchsorted(pixels, pixels[start] + (row - 1) * width - 1)
    for i in range(start, stop):
        q, peak, worst = planes[i, 0], planes[i, 3], 0.0
        # gradient of the radiance by u and v: central differences of the neighbours
        along_u = along_v = 0.0
        share = slope = 0.0
        if peak > 0.0:
            share = middle[i] / peak
            # derivative of the mean over the pixel by q: a difference of the Gaussian at its ends
            half = 0.5 * max(abs(planes[i, 1]), abs(planes[i, 2]))
            if half < 0.05:
                slope = abs(q) * share
            else:
                ends = math.exp(-0.5 * (q - half) ** 2) - math.exp(-0.5 * (q + half) ** 2)
                slope = abs(ends) * INV_SQRT_2PI / (2.0 * half)
            # in the sheet's middle the slope vanishes, and the curvature decides
            slope = max(slope, 0.25 * share)
        for row in range(3):
            low, first = neighbours_in_row(pixels, walk, i, row, width)
            for j in range(first, len(pixels)):
                if pixels[j] > low + 2:
                    break
                other = planes[j, 3]
                if peak <= 0.0 and other <= 0.0:
                    continue
                predicted = planes[j, 0] + planes[j, 1] * (low + 1 - pixels[j]) + planes[j, 2] * (1 - row)
                if peak > 0.0 and other > 0.0:
                    worst = max(worst, peak * slope * min(abs(predicted - q), 1.0) + share * abs(other - peak))
                    if row == 1:
                        along_u += 0.5 * (other - peak) * (pixels[j] - low - 1)
                    elif pixels[j] == low + 1:
                        along_v += 0.5 * (other - peak) * (row - 1)
                else:
                    # a dark neighbour outside the sheet is no edge where the same surface continues there
                    beyond = min(peak, other) == BEYOND
                    worst = max(worst, max(middle[i], middle[j]) * (min(abs(predicted - q), 1.0) if beyond else 1.0))
        error[i] = EDGE_SHARE * worst
        # first moment of the Gaussian over the pixel, with the pixel's box replaced by a Gaussian of equal variance
        mean[i] = middle[i]
        if peak > 0.0:
            moment = -share * q / (12.0 + planes[i, 1] ** 2 + planes[i, 2] ** 2)
            mean[i] = max(middle[i] + moment * (along_u * planes[i, 1] + along_v * planes[i, 2]), 0.0)


@numba.njit(nogil=True, cache=True)
def gather_centre_rays(
    values: Float, occluded: NDArray[np.bool_], sample: Int, count: int, planes: Float, middle: Float
) -> None:
    """Radiance of each pixel -> middle (n,) from its centre ray; an occluded one also gets 0 in planes (n, 4)."""
    for i in range(len(middle)):
        middle[i] = values[i, 0]
    for j in range(count):
        if occluded[j]:
            middle[sample[j]] = planes[sample[j], 3] = 0.0
