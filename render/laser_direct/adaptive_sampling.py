"""Adaptive sampling: how finely each pixel is stratified, so that the fewest rays bring the error below its target.

A pixel of c_i x c_i cells has the variance v_i = A_i c_i^-p, with p = 3 for an edge through jittered cells. At a given
number of rays, the sum of c_i^2, the sum of the variances is least where c_i is proportional to A_i^(1 / (p + 2)): the
few pixels on the worst edges are divided finely, most are not divided. c_i is a power of two.
"""

from __future__ import annotations

import math

import numba
import numpy as np

from render.base.arrays import Float, Int, Long

MOST_CELLS = 32
"""Largest number of cells a side."""
_LEVELS = 6
"""Number of levels; level k has 2^k cells a side."""
_BINS, _BINS_PER_LEVEL = 640, 16
"""Histogram of log2 A^(1 / (p + 2)): 40 octaves below the largest value, 16 bins each; the last bin takes the rest."""


@numba.njit(nogil=True, cache=True, error_model="numpy")
def cells_needed(error: Float, cells: Int, allowed: float, least: float, order: float, growth: int) -> Int:
    """(n,) cells a side that bring the sum of the squares of `error` (n,) below `allowed`, from the present (n,).

    least: pixels with errors up to this are not refined; order: p; growth: largest factor by which the cells a side
    grow, since an estimate from few rays cannot be extrapolated far.
    """
    n = error.shape[0]
    power = 1.0 / (order + 2.0)
    log_weight = np.empty(n)
    highest, fixed = -np.inf, 0.0
    for i in range(n):
        log_weight[i] = -np.inf
        if error[i] > least and cells[i] < MOST_CELLS:
            log_weight[i] = power * math.log2(error[i] * error[i] * float(cells[i]) ** order)
            highest = max(highest, log_weight[i])
        else:
            fixed += error[i] * error[i]
    wanted = cells.copy()
    if highest == -np.inf:
        return wanted
    # histogram of the variances by present level and by weight
    sums = np.zeros((_LEVELS, _BINS))
    for i in range(n):
        if log_weight[i] > -np.inf:
            bin_ = min(int((highest - log_weight[i]) * _BINS_PER_LEVEL), _BINS - 1)
            sums[_level(cells[i]), bin_] += error[i] * error[i]
    most = _level(growth)
    # bisect for the threshold: the first bin whose undivided pixels stay undivided
    low, high = 0, _BINS + _LEVELS * _BINS_PER_LEVEL
    while low < high:
        middle = (low + high) // 2
        left = fixed
        for level in range(_LEVELS):
            for bin_ in range(_BINS):
                if sums[level, bin_] > 0.0:
                    gain = max(_level_at(bin_, middle, level, most) - level, 0)
                    left += sums[level, bin_] * 2.0 ** (-order * gain)
        if left <= allowed:
            high = middle
        else:
            low = middle + 1
    for i in range(n):
        if log_weight[i] > -np.inf:
            bin_ = min(int((highest - log_weight[i]) * _BINS_PER_LEVEL), _BINS - 1)
            wanted[i] = max(cells[i], 1 << _level_at(bin_, low, _level(cells[i]), most))
    return wanted


@numba.njit(nogil=True, cache=True)
def _level(cells: int) -> int:
    level = 0
    while cells > 1:
        cells >>= 1
        level += 1
    return level


@numba.njit(nogil=True, cache=True)
def _level_at(bin_: int, threshold: int, level: int, most: int) -> int:
    """The level of pixels in a bin, from their present level up by `most` levels at most."""
    if bin_ >= threshold:
        return 0
    return min(1 + (threshold - 1 - bin_) // _BINS_PER_LEVEL, level + most, _LEVELS - 1)


@numba.njit(nogil=True, cache=True, forceinline=True)
def neighbours_in_row(pixels: Int, start: Long, i: int, row: int, width: int) -> tuple[int, int]:
    """Of pixel i of ascending flat indices, its neighbours in the row before (0), its own (1) or the row after (2).

    The index of the leftmost place, and where `pixels` reach it; the neighbours are those up to two places on. start
    (3,): where the neighbours of each row began at the pixel before; as pixels ascend these only ascend, and are moved
    on.
    """
    low = pixels[i] + (row - 1) * width - 1
    first = start[row]
    while first < len(pixels) and pixels[first] < low:
        first += 1
    start[row] = first
    return low, first


@numba.njit(nogil=True, cache=True)
def grade_neighbours(wanted: Int, cells: Int, pixels: Int, width: int) -> Int:
    """(n,) wanted cells of ascending flat pixel indices (n,) -> the same, with at least half as many in the neighbours
    of each pixel that is refined.

    All rays of a pixel may miss a shadow's edge that cuts its corner, but its neighbours' rays meet it. Neighbours wrap
    around the left and right border of the image, which refines a few pixels too many.
    """
    n = len(pixels)
    out = wanted.copy()
    start = np.zeros(3, np.int64)
    for i in range(n):
        if wanted[i] <= cells[i]:
            continue
        for row in range(3):
            low, first = neighbours_in_row(pixels, start, i, row, width)
            for j in range(first, len(pixels)):
                if pixels[j] > low + 2:
                    break
                out[j] = max(out[j], wanted[i] // 2)
    return out


@numba.njit(nogil=True, cache=True, error_model="numpy")
def raise_neighbour_errors(
    error: Float, neighbour_error: Float, order: float, mean: Float, border: float, cells: Int, pixels: Int, width: int
) -> None:
    """Raise the errors (n,) of pixels whose own rays may have missed an edge that their neighbours' rays have met.

    neighbour_error (n,): the error that each of the ascending flat pixel indices (n,) predicts for a neighbour of one
    cell; it falls with the power order / 2 of the neighbour's own cells (n,). border: fraction of a pixel's radiance,
    times the square of its cells, by which it and a dark neighbour may be wrong, since the edge between them may lie in
    either, closer to their border than any ray.
    """
    n = len(pixels)
    start = np.zeros(3, np.int64)
    for i in range(n):
        if neighbour_error[i] <= 0.0 and mean[i] <= 0.0:
            continue
        for row in range(3):
            low, first = neighbours_in_row(pixels, start, i, row, width)
            for j in range(first, n):
                if pixels[j] > low + 2:
                    break
                if cells[j] > 1 and neighbour_error[i] > error[j]:  # cells only lower it
                    error[j] = max(error[j], neighbour_error[i] * float(cells[j]) ** (-0.5 * order))
                if mean[j] == 0.0 and mean[i] > 0.0 and (row == 1 or pixels[j] == low + 1):
                    if cells[j] > 1:
                        error[j] = max(error[j], border * mean[i] / float(cells[j]) ** 2)
                    if cells[i] > 1:
                        error[i] = max(error[i], border * mean[i] / float(cells[i]) ** 2)
