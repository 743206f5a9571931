"""Flags that scan lines get by their neighbours: what they show together and none of them shows alone.

**A profile that leans to one side.** A second line on the first one's flank moves the position by several sigmas long
before a single scan line can tell. Its skewness g is the same on all of them, noise is not. So the deviates z of the
skewness (`gaussian_fit._asymmetry`) of a scan line and its neighbours are averaged, and their own scatter and
correlation r along the line say how sure the mean is:

    t = mean(z) sqrt(n / l) / std(z),       l = (1 + r) / (1 - r)

Where t is beyond chance, and mean and mode of such a profile, g width / 2 apart (Pearson), differ by more than sigma or
g is large, the line is flagged, and its sigma holds how far a second line of 30 % would have moved it,
g^(1/3) width / 2 (the skewness of two lines grows as the cube of their distance, the shift as the distance).

**Two lines where the neighbours part none.** Below `PLAIN` deviates it is chance which scan lines are found to be two
lines, and those that are, are not like the others: `BLENDED`, unless `TOGETHER` of the neighbours are.

**A line that its neighbours cannot resolve** is not resolved by itself either: what makes it wide is something else.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from analysis.line.result import NEIGHBOURS, Flag, positioned
from render.base.arrays import Float

MOST = 3.0
"""Deviates are cut off there: a few scan lines that lean by themselves, at an edge, do not speak for all."""
CHANCE = 6.0
"""Standard errors of a mean; with FEWEST scan lines and their own scatter still less than one in 100,000."""
FEWEST = 16
SKEW = 0.1
"""Skewness that no lens gives a line: it is taken for a second one."""
PLAIN, TOGETHER = 9.0, 0.75
LEAST_SCATTER = 0.02
"""Of deviates, where an image has next to no noise."""
UNIT = 2.0**-20
"""Sums are of whole numbers, so that they are the same to the bit from either end."""


def with_shared_flags(
    peaks: Float, flag: NDArray[np.uint8], lean: Float, skewness: Float
) -> tuple[Float, NDArray[np.uint8]]:
    """Sigma and width of peaks (n, 2), px, their flags (n,), deviates and skewness (n,) -> sigma (n,) and flags (n,).

    `MISFIT` where neighbours show that the line leans, `BLENDED` where they are no two lines, `UNRESOLVED` where they
    are. A deviate is NaN where it is not
    known, and the skewness also where the line was found to be none: such a scan line only speaks for its neighbours.
    """
    sigma, width = peaks.T
    found, coarse = (_of_neighbours(which.astype(np.float64)) for which in (positioned(flag), flag == Flag.UNRESOLVED))
    with_coarse = (flag == Flag.OK) & (2.0 * coarse > found)
    flag = np.where(with_coarse, Flag.UNRESOLVED, flag).astype(np.uint8)
    known, single = np.isfinite(lean), np.isfinite(skewness)
    if known.sum() < FEWEST:
        return sigma, flag
    cut, skew = (np.clip(np.nan_to_num(x), -most, most) for x, most in ((lean, MOST), (skewness, 1.0)))
    of_known, of_single = known.astype(np.float64), single.astype(np.float64)
    count, total, square, skew, singles = (_of_neighbours(x) for x in (of_known, cut, cut**2, skew, of_single))
    parted = known & ~single & (flag == Flag.OK)
    by_chance = (
        parted & (np.abs(np.nan_to_num(lean)) < PLAIN) & (_of_neighbours(parted.astype(np.float64)) < TOGETHER * count)
    )
    flag = np.where(by_chance, Flag.BLENDED, flag).astype(np.uint8)
    enough = single & (count >= FEWEST)
    count = np.maximum(count, 1.0)
    mean, shared = total / count, np.abs(skew) / np.maximum(singles, 1.0)
    scatter = np.sqrt(np.maximum(square / count - mean**2, LEAST_SCATTER**2))
    sure = np.abs(mean) * np.sqrt(count / _alike(np.where(known, cut - mean, 0.0))) / scatter
    shift = 0.5 * np.cbrt(shared) * width
    usual_sigma, usual_width = (_of_neighbours(np.where(single, x, 0.0)) / np.maximum(singles, 1.0) for x in peaks.T)
    matters = (0.5 * shared * usual_width > usual_sigma) | (
        (shared > SKEW) & (0.5 * np.cbrt(shared) * usual_width > usual_sigma)
    )
    leans = (flag == Flag.OK) & enough & (sure > CHANCE) & matters
    return np.where(leans, np.hypot(sigma, shift), sigma), np.where(leans, Flag.MISFIT, flag).astype(np.uint8)


def _alike(values: Float) -> float:
    """Scan lines that are alike in what varies about a mean (n,), as of a first-order process."""
    whole = np.rint(values * 2.0**10).astype(np.int64)  # products of them fit
    correlation = int(whole[1:] @ whole[:-1]) / max(int(whole @ whole), 1)
    return (1.0 + max(correlation, 0.0)) / (1.0 - min(correlation, 0.98))


def _of_neighbours(values: Float) -> Float:
    """(n,) -> sums over each and `NEIGHBOURS` on either side."""
    whole = np.rint(values / UNIT).astype(np.int64)
    sums = np.concatenate([[0], np.cumsum(np.pad(whole, NEIGHBOURS))])
    return np.asarray(UNIT * (sums[2 * NEIGHBOURS + 1 :] - sums[: len(values)]))
