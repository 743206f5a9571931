"""A second line that is too faint for one scan line to tell, but not for many neighbours, all of which it leans.

    S = sum z / (sum L z^2)^(1/2)         over the neighbours; z lean, L how many of them err alike

By the scatter of z itself (Student's t in Fisher's form), so that it holds where the noise is not known: of one
Gaussian line S is a normal deviate but for its tails, of lines that all lean alike the root of their number.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from analysis.line.methods.misfit import UNLIKELY
from analysis.line.methods.seed_loop import SHARED
from analysis.line.result import NEIGHBOURS, Flag
from render.base.arrays import Float

TOGETHER = 4.0
"""S of 64 neighbours: Student's t of 4.6, by chance once in 50,000. Fewer than 16 cannot reach it."""
LEAST = 0.1
"""Mean lean; a smaller one moves a line by less than its sigma, and where there is no noise all lean alike."""
UNIT = 2.0**-20
"""Of sums."""
BESIDE, MANY = 16, 0.25
"""Scan lines on either side, and the share of them, on both sides, that are measured as something else from which a
line that looks like a Gaussian by itself is taken to be as they are."""
MOST_PART = 0.9
"""Share of the doubled neighbours that part; of fewer, those that do are the ones that noise has drawn apart."""


def leans_as_neighbours_do(lean: Float, length: Float) -> NDArray[np.bool_]:
    """Leans of lines (n, k), normal deviates where each is a Gaussian, infinite of those measured as something else,
    NaN where nothing is known, and correlation lengths (n, k) -> (n, k): which were taken for a Gaussian and are none.
    """
    known = np.isfinite(length) & ~np.isnan(lean)
    if not known.any():
        return known
    deviate = np.where(known, np.clip(lean, -UNLIKELY, UNLIKELY), 0.0)
    square = np.where(known, np.maximum(length, 1.0) * deviate**2, 0.0)
    total, spread, count = np.split(_of_neighbours(np.hstack((deviate, square, known.astype(np.float64)))), 3, axis=1)
    together = np.abs(total) > np.maximum(TOGETHER * np.sqrt(spread), LEAST * count)
    return np.asarray((together | _among_others(np.isinf(lean), known)) & np.isfinite(lean))


def _among_others(odd: NDArray[np.bool_], known: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(n, k) -> (n, k): whether on both sides MANY of the lines beside a line are odd."""
    sums = np.cumsum(np.pad(np.stack([odd & known, known]), ((0, 0), (BESIDE + 1, BESIDE), (0, 0))), axis=1, dtype=int)
    above = sums[:, BESIDE : -BESIDE - 1] - sums[:, : -2 * BESIDE - 1]
    below = sums[:, 2 * BESIDE + 1 :] - sums[:, BESIDE + 1 : -BESIDE]
    enough = (above[1] > 0) & (below[1] > 0)
    return np.asarray(enough & (above[0] >= MANY * above[1]) & (below[0] >= MANY * below[1]))


def keep_sure(out: Float, flags: NDArray[np.uint8], leaning: NDArray[np.bool_], single: Float, farthest: float) -> None:
    """Flag lines (n, k) that were measured as two since they lean; without a sure position they get the single back.

    out (n, k, columns), u and sigma_u its first; single (m, columns), as before; farthest: px, the largest sigma.
    """
    double, parted = out[leaning], flags[leaning] == Flag.OK
    double[parted] = _with_distance(double[parted], single[parted])
    unsure = ~(double[:, 1] < farthest)
    out[leaning] = np.where(unsure[:, None], single, double)
    flags[leaning] = np.where(unsure | parted, Flag.BLENDED, flags[leaning])


def keep_doubtful(out: Float, flags: NDArray[np.uint8], alone: NDArray[np.bool_], double: Float) -> None:
    """Flag lines (n, k) that part by noise alone: where the brighter of the two is, double (m, columns), with how far
    that is from the single line, which out (n, k, columns) holds.
    """
    out[alone], flags[alone] = _with_distance(double, out[alone]), Flag.BLENDED


def _with_distance(double: Float, single: Float) -> Float:
    """The brighter of two lines (m, columns) with a sigma that holds its distance from the single line."""
    found = double.copy()
    found[:, SHARED] = np.nan_to_num(single[:, 0] - double[:, 0])
    found[:, 1] = np.hypot(double[:, 1], found[:, SHARED])
    return found


def parts_alone(flag: NDArray[np.uint8], lean: Float) -> NDArray[np.bool_]:
    """Flags and leans as above (n, k) -> (n, k): of lines that were parted, those whose neighbours mostly do not."""
    parted = np.isinf(lean) & (flag == Flag.OK)
    if not parted.any():
        return parted
    doubled = parted | (flag == Flag.BLENDED) | (flag == Flag.MISFIT)
    some, every = (_of_neighbours(one.astype(np.float64)) for one in (parted, doubled))
    return np.asarray(parted & (some < MOST_PART * every))


def _of_neighbours(values: Float) -> Float:
    """(n, m) -> sums over the neighbours of each, itself left out: of whole numbers, so that either end is alike."""
    whole = np.rint(values / UNIT).astype(np.int64)
    sums = np.cumsum(np.pad(whole, ((NEIGHBOURS + 1, NEIGHBOURS), (0, 0))), axis=0)
    return np.asarray(UNIT * (sums[2 * NEIGHBOURS + 1 :] - sums[: -2 * NEIGHBOURS - 1] - whole))
