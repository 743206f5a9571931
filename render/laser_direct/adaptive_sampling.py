"""How finely each pixel is divided: the fewest rays that bring the image's error below its target.

With v_i the variance of pixel i at c_i cells a side, v_i c_i^p =: A_i stays: p = 3 for an edge through jittered cells.
The sum of A_i c_i^-p at a given number of rays, the sum of c_i^2, is least where c_i goes with A_i^(1 / (p + 2)): a few
pixels on the worst edges are divided finely, most not at all. Cells come in powers of two.
"""

from __future__ import annotations

import math

import numba
import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]
Int = NDArray[np.int32]

MOST_CELLS = 32
_LEVELS = 6
_BINS, _FINENESS = 640, 16
"""Of log2 A^(1 / (p + 2)), so many an octave of c: from 2^-40 of the largest up, below which nothing counts."""


@numba.njit(nogil=True, cache=True, error_model="numpy")
def cells_needed(error: Float, cells: Int, allowed: float, least: float, order: float, growth: int) -> Int:
    """(n,) cells a side that bring the sum of the squares of `error` (n,) below `allowed`, from the present ones (n,).

    least: errors up to this cannot matter; order: p; growth: at most so many times the present cells, since an estimate
    from few rays is not to be believed too far.
    """
    n = error.shape[0]
    power = 1.0 / (order + 2.0)
    place = np.empty(n)
    highest, fixed = -np.inf, 0.0
    for i in range(n):
        place[i] = -np.inf
        if error[i] > least and cells[i] < MOST_CELLS:
            place[i] = power * math.log2(error[i] * error[i] * float(cells[i]) ** order)
            highest = max(highest, place[i])
        else:
            fixed += error[i] * error[i]
    wanted = cells.copy()
    if highest == -np.inf:
        return wanted
    # the variances, by the present level and by the place on the scale of A
    sums = np.zeros((_LEVELS, _BINS))
    for i in range(n):
        if place[i] > -np.inf:
            bin_ = min(int((highest - place[i]) * _FINENESS), _BINS - 1)
            sums[_level(cells[i]), bin_] += error[i] * error[i]
    most = _level(growth)
    # how far down the scale the first pixels get two cells a side, in bins: the least that is enough
    low, high = 0, _BINS + _LEVELS * _FINENESS
    while low < high:
        middle = (low + high) // 2
        left = fixed
        for level in range(_LEVELS):
            for bin_ in range(_BINS):
                if sums[level, bin_] > 0.0:
                    gain = max(_reached(bin_, middle, level, most) - level, 0)
                    left += sums[level, bin_] * 2.0 ** (-order * gain)
        if left <= allowed:
            high = middle
        else:
            low = middle + 1
    for i in range(n):
        if place[i] > -np.inf:
            bin_ = min(int((highest - place[i]) * _FINENESS), _BINS - 1)
            wanted[i] = max(cells[i], 1 << _reached(bin_, low, _level(cells[i]), most))
    return wanted


@numba.njit(nogil=True, cache=True)
def _level(cells: int) -> int:
    level = 0
    while cells > 1:
        cells >>= 1
        level += 1
    return level


@numba.njit(nogil=True, cache=True)
def _reached(bin_: int, threshold: int, level: int, most: int) -> int:
    """The level that pixels so far down the scale get."""
    if bin_ >= threshold:
        return 0
    return min(1 + (threshold - 1 - bin_) // _FINENESS, level + most, _LEVELS - 1)


@numba.njit(nogil=True, cache=True)
def graded(wanted: Int, cells: Int, pixels: Int, width: int) -> Int:
    """(n,) wanted cells of ascending flat pixel indices (n,) -> at least half as many beside each that is traced.

    All rays may miss the edge of a shadow that cuts a pixel's corner: its neighbours tell. Across the left and right
    edge of an image neighbours wrap: a pixel too many costs little.
    """
    n = len(pixels)
    out = wanted.copy()
    # three places in the set that walk along with i: the row before, its own, the row after
    start = np.zeros(3, np.int64)
    for i in range(n):
        if wanted[i] <= cells[i]:
            continue
        for row in range(3):
            low = pixels[i] + (row - 1) * width - 1
            j = start[row]
            while j < n and pixels[j] < low:
                j += 1
            start[row] = j
            while j < n and pixels[j] <= low + 2:
                out[j] = max(out[j], wanted[i] // 2)
                j += 1
    return out


@numba.njit(nogil=True, cache=True, error_model="numpy")
def doubt_beside(
    error: Float, doubt: Float, order: float, mean: Float, between: float, cells: Int, pixels: Int, width: int
) -> None:
    """Raise the errors (n,) of pixels whose own rays may have missed what those of their neighbours have met.

    doubt (n,): the error that each of the ascending flat pixel indices (n,) expects of a neighbour with one cell; it
    falls with the power order / 2 of the neighbour's own cells (n,). between: of the radiance of a pixel beside one
    that is wholly dark: the edge between the two may lie within either, closer to their border than any ray.
    """
    n = len(pixels)
    start = np.zeros(3, np.int64)
    for i in range(n):
        if doubt[i] <= 0.0 and mean[i] <= 0.0:
            continue
        for row in range(3):
            low = pixels[i] + (row - 1) * width - 1
            j = start[row]
            while j < n and pixels[j] < low:
                j += 1
            start[row] = j
            while j < n and pixels[j] <= low + 2:
                if cells[j] > 1:
                    error[j] = max(error[j], doubt[i] * float(cells[j]) ** (-0.5 * order))
                if mean[j] == 0.0 and mean[i] > 0.0 and (row == 1 or pixels[j] == low + 1):
                    if cells[j] > 1:
                        error[j] = max(error[j], between * mean[i] / float(cells[j]) ** 2)
                    if cells[i] > 1:
                        error[i] = max(error[i], between * mean[i] / float(cells[i]) ** 2)
                j += 1
