"""How far a misfit's centre may be moved, as its width w is not the width W of the lines beside it.

An edge that hides light beyond t sigmas of the line, all or a part of it, moves the centre of mass by d. About the true
centre the light that is left has

    w^2 + d^2 = W^2              where t = 0
    w^2 + d^2 < W^2              where t > 0: |d| is W l(t) where all is hidden, w^2 / W^2 = 1 - t l - l^2, l = phi/Phi

(mean and variance of a truncated normal: Johnson, Kotz and Balakrishnan, Continuous Univariate Distributions, 1994,
13.10.1). How much is hidden nobody knows: d is anything from that of a black edge to (W^2 - w^2)^(1/2). Where w is the
larger one, a second line D away adds p q D^2 to w^2, and moves the centre by q D off the brighter one, q <= p: d is
from 0 to (w^2 - W^2)^(1/2).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from analysis.line.result import NEIGHBOURS, SYSTEMATIC, Flag
from render.base.arrays import Float

REACH, FEWEST = 4 * NEIGHBOURS, 16
"""Scan lines on either side whose single lines tell the width, and how many of them do."""
BESIDE = 2.0
"""Widths from their course beyond which a line is on another surface: no edge moves it as far."""
SLANT = 4
"""Scan lines on either side that an edge is on as well: where the width passes through W it says nothing by itself."""
SURE = 3.0
"""Standard deviations of their widths by which one is another."""
EDGES = np.linspace(8.0, 0.0, 801)
"""Sigmas from the middle to a black edge."""
MOVED = np.exp(-0.5 * EDGES**2) / np.sqrt(2.0 * np.pi) / ndtr(EDGES)
"""Sigmas by which such an edge moves the centre of mass."""
HIDDEN = EDGES * MOVED + MOVED**2
"""By how much it lowers the variance, of 1."""


def moved_by_odd_width(u: Float, width: Float, flag: NDArray[np.uint8]) -> Float:
    """Positions and widths, px, and flags (n, k) -> (n, k) px: standard deviation of how far a `SYSTEMATIC` line is
    moved as its width is not that of its neighbours, 0 of others and where that is not known, as on another surface.

    Of what is as likely anywhere from a to b the mean square is (a^2 + a b + b^2) / 3.
    """
    single = (flag == Flag.OK) & np.isfinite(width)
    asked = np.isin(flag, SYSTEMATIC) & np.isfinite(width)
    if not (asked.any() and single.any()):
        return np.zeros_like(width)
    known = single.astype(np.float64)
    usual, spread, count = _foretold(np.where(single, width, 0.0), known)
    course, scatter, _ = _foretold(np.where(single, u, 0.0), known)
    asked &= count >= FEWEST
    asked &= np.abs(np.nan_to_num(u) - course) <= BESIDE * usual + SURE * scatter
    usual, odd = np.where(asked, usual, 1.0), np.where(asked, width, 1.0)
    most = np.maximum(np.abs(usual**2 - odd**2) - 2.0 * usual * SURE * spread, 0.0)
    least = np.where(odd < usual, usual * np.interp(most / usual**2, HIDDEN, MOVED), 0.0)
    square = np.where(asked, (least**2 + least * np.sqrt(most) + most) / 3.0, 0.0)
    there, together = _around(asked.astype(np.float64), SLANT), _around(square, SLANT)
    return np.where(asked, np.sqrt(together / np.maximum(there, 1.0)), 0.0)


def _foretold(values: Float, known: Float) -> tuple[Float, Float, Float]:
    """Numbers (n, k), 0 where they are not `known` -> (n, k) each: that of a scan line by a straight line through those
    around it, as a sheet widens with depth, its standard deviation, and how many they are.
    """
    rows, pad = len(values), ((REACH, REACH), (0, 0))
    count, first, square = known.copy(), values.copy(), values**2
    lever, far, product = np.zeros_like(values), np.zeros_like(values), np.zeros_like(values)
    there, padded = np.pad(known, pad), np.pad(values, pad)
    for d in range(1, REACH + 1):  # both sides at once: upside down it is the same to the last bit
        above, below = there[REACH - d :][:rows], there[REACH + d :][:rows]
        before, after = padded[REACH - d :][:rows], padded[REACH + d :][:rows]
        count += above + below
        lever += d * (below - above)
        far += d * d * (above + below)
        first += before + after
        product += d * (after - before)
        square += before**2 + after**2
    determinant = count * far - lever**2
    enough = determinant > 0.0
    determinant = np.where(enough, determinant, 1.0)
    usual, slope = (far * first - lever * product) / determinant, (count * product - lever * first) / determinant
    left = np.maximum(square - usual * first - slope * product, 0.0) / np.maximum(count - 2.0, 1.0)
    return usual, np.sqrt(left * (1.0 + far / determinant)), np.where(enough, count, 0.0)


def _around(values: Float, reach: int) -> Float:
    """(n, k) -> sums over the scan lines within reach of each."""
    padded = np.pad(values, ((reach, reach), (0, 0)))
    total = values.copy()
    for distance in range(1, reach + 1):  # both sides at once: upside down it is the same to the last bit
        total += padded[reach - distance :][: len(values)] + padded[reach + distance :][: len(values)]
    return total
