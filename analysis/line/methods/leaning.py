"""What is too faint for one scan line to tell, but not for many neighbours: a second line, all of which it leans to
one side, and an edge that crosses the line slantwise, by which they lean or fit less well than others do.

    S = sum z / (sum L z^2)^(1/2)         over the neighbours; z lean, L how many of them err alike

By the scatter of z itself (Student's t in Fisher's form), so that it holds where the noise is not known: of one
Gaussian line S is a normal deviate but for its tails, of lines that all lean alike the root of their number. More is
seen by the scatter from line to line (von Neumann, Annals of Mathematical Statistics 12, 367, 1941), which what they
have in common leaves as it is; along an edge, where z changes its sign, by half as many neighbours:

    S = sum z / (s^2 sum L)^(1/2)         s^2 = sum (z_i - z_i-1)^2 / 2 n, at least 1
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_propagation

from analysis.line.methods.misfit import BESIDE_IT, ONE_PEAK, UNLIKELY
from analysis.line.methods.seed_loop import LEAN, SHARED, WIDTH
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
CLOSE, SURE, LIKELY = 16, 5.0, 3.0
"""Scan lines on either side of which an edge makes something else; the second S, by chance once in a million; and that
of the lines beside such a one."""
ALONG = np.array([[False, True, False]] * 3)
"""Of (n, k), the scan lines beside one."""
FAR, FEWEST, ALIKE = 8, 256, 0.1
"""Scan lines apart that no smoothing makes alike; pairs of them, and the correlation, from which it is believed."""
RESOLVED = 1.1
"""px; of narrower lines that are two the noise, where it is not known, comes out a third too large."""
AS_WIDE = 0.2
"""Of the neighbours' width, by which one of two lines that part may differ: another is no such pair."""
MOST_PART = 0.9
"""Share of the doubled neighbours that part; of fewer, those that do are the ones that noise has drawn apart."""


def no_gaussian_by_neighbours(lean: Float, fit: Float, length: Float, alike: bool = False) -> NDArray[np.bool_]:
    """Leans and what is left over (n, k), normal deviates where each line is a Gaussian, leans infinite of those
    measured as something else, NaN where nothing is known, and correlation lengths (n, k) -> (n, k): which were taken
    for a Gaussian and are none. alike: a camera has made the noise of neighbouring pixels alike, block by block, so
    that what differs from line to line says little.
    """
    known = np.isfinite(length) & ~np.isnan(lean)
    if not known.any():
        return known
    deviate = np.where(known, np.clip(lean, -UNLIKELY, UNLIKELY), 0.0)
    square = np.where(known, np.maximum(length, 1.0) * deviate**2, 0.0)
    total, spread, count = _of_neighbours(deviate, square, known.astype(np.float64))
    together = np.abs(total) > np.maximum(TOGETHER * np.sqrt(spread), LEAST * count)
    together |= _among_others(np.isinf(lean), known)
    if alike:
        return np.asarray(together & np.isfinite(lean))
    leaning = _nearby(np.where(known, deviate, np.nan), length)
    left = np.where(np.isfinite(fit) & known, np.clip(fit - _usual(fit), -UNLIKELY, UNLIKELY), np.nan)
    nearby = _above(np.abs(leaning[0])) & (np.abs(total) > LEAST * count)
    nearby |= _above(np.abs(leaning[1])) | _above(_nearby(left, length)[1])
    return np.asarray((together | nearby) & np.isfinite(lean))


def _usual(fit: Float) -> float:
    """What lines leave over for the most part, where noise is known less well than residuals are many."""
    there = np.isfinite(fit)
    return float(np.median(fit[there])) if there.any() else 0.0


def _above(together: Float) -> NDArray[np.bool_]:
    """(n, k) -> (n, k): above SURE, or with nothing below LIKELY between it and such a line."""
    sure = together > SURE
    return np.asarray(binary_propagation(sure, structure=ALONG, mask=together > LIKELY)) if sure.any() else sure


def _nearby(deviate: Float, length: Float) -> tuple[Float, Float]:
    """Deviates (n, k), NaN where not known, and correlation lengths (n, k) -> (n, k) each: their sum over all
    neighbours and over those CLOSE by, itself left out, in its standard deviations by what one line differs from the
    next."""
    known = np.isfinite(deviate)
    step = np.diff(deviate, axis=0, prepend=np.nan, append=np.nan) ** 2
    steps, squares = np.isfinite(step).astype(np.float64), np.nan_to_num(step)
    more, smoothed = _smoothed(deviate)
    deviate, alike = np.nan_to_num(deviate), np.where(known, np.maximum(length, smoothed), 0.0)
    squares, steps, total, wide = _of_neighbours(squares[:-1] + squares[1:], steps[:-1] + steps[1:], deviate, alike)
    scatter = np.maximum(more * 0.5 * squares / np.maximum(steps, 1.0), 1.0)
    close, narrow = _of_neighbours(deviate, alike, reach=CLOSE)
    return total / np.sqrt(scatter * np.maximum(wide, 1.0)), close / np.sqrt(scatter * np.maximum(narrow, 1.0))


def _smoothed(deviate: Float) -> tuple[float, float]:
    """Deviates (n, k) of an image that a camera has smoothed -> what their variance is over that of neighbours'
    differences, and how many are alike: 1 and 1 where neighbours differ as much as those FAR apart."""
    far, near = (_mean_square(deviate[lag:] - deviate[:-lag]) for lag in (FAR, 1))
    if not near < (1.0 - ALIKE) * far:  # NaN: too few tell
        return 1.0, 1.0
    correlation = [1.0 - _mean_square(deviate[lag:] - deviate[:-lag]) / far for lag in range(1, FAR)]
    # up to the first that is not alike, or of which too few tell
    alike = np.cumprod(np.array(correlation) > ALIKE) > 0
    return far / max(near, UNIT), 1.0 + 2.0 * float(np.sum(correlation, where=alike))


def _mean_square(values: Float) -> float:
    """Of those that are known, NaN where too few are; of whole numbers, so that either end is alike."""
    there = values[np.isfinite(values)]
    return UNIT * int(np.rint(there**2 / UNIT).astype(np.int64).sum()) / len(there) if len(there) >= FEWEST else np.nan


def _among_others(odd: NDArray[np.bool_], known: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(n, k) -> (n, k): whether on both sides MANY of the lines beside a line are odd."""
    sums = np.cumsum(np.pad(np.stack([odd & known, known]), ((0, 0), (BESIDE + 1, BESIDE), (0, 0))), axis=1, dtype=int)
    above = sums[:, BESIDE : -BESIDE - 1] - sums[:, : -2 * BESIDE - 1]
    below = sums[:, 2 * BESIDE + 1 :] - sums[:, BESIDE + 1 : -BESIDE]
    enough = (above[1] > 0) & (below[1] > 0)
    return np.asarray(enough & (above[0] >= MANY * above[1]) & (below[0] >= MANY * below[1]))


def keep_sure(out: Float, flags: NDArray[np.uint8], leaning: NDArray[np.bool_], single: Float, farthest: float) -> None:
    """Flag lines (n, k) that were measured as two since they lean, but for RESOLVED ones that part as most of their
    neighbours do; without a sure position they get the single back.

    out (n, k, columns), u and sigma_u its first; single (m, columns), as before; farthest: px, the largest sigma.
    """
    double, parted = out[leaning], flags[leaning] == Flag.OK
    sure = _most_part(flags, np.isinf(out[..., LEAN])) & _as_wide(out[..., WIDTH], flags == Flag.OK)
    doubtful = parted & ~sure[leaning]
    double[doubtful] = _doubtful(double[doubtful], single[doubtful])
    unsure = ~(double[:, 1] < farthest)
    out[leaning] = np.where(unsure[:, None], single, double)
    flags[leaning] = np.where(unsure | doubtful, Flag.BLENDED, flags[leaning])


def _as_wide(width: Float, among: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(n, k) px and which count among a line's neighbours -> RESOLVED, and as wide as these."""
    total, count = _of_neighbours(np.where(among, width, 0.0), among.astype(np.float64))
    return np.asarray((width > RESOLVED) & (np.abs(width * count - total) < AS_WIDE * total))


def keep_doubtful(out: Float, flags: NDArray[np.uint8], alone: NDArray[np.bool_], double: Float) -> None:
    """Flag lines (n, k) that part by noise alone, double (m, columns); out (n, k, columns) holds the single ones."""
    out[alone], flags[alone] = _doubtful(double, out[alone]), Flag.BLENDED


def _doubtful(double: Float, single: Float) -> Float:
    """Of lines (m, columns) measured as two and as one: the single where these are comparable and have one peak, else
    the brighter, with a sigma that holds the distance between single and brighter.

    Their own distance d follows from width w and shift s of the single one, by moments: d = s + (w^2 - w_double^2) / s.
    """
    shift, width = single[:, 0] - double[:, 0], double[:, WIDTH]
    distance = np.abs(shift) + (single[:, WIDTH] ** 2 - width**2) / np.maximum(np.abs(shift), UNIT)
    one = (distance < ONE_PEAK * width) & (np.abs(shift) > BESIDE_IT * width) & np.isfinite(single[:, 1])
    found = np.where(one[:, None], single, double)
    found[:, LEAN], found[:, SHARED] = double[:, LEAN], np.nan_to_num(shift)
    found[:, 1] = np.hypot(found[:, 1], found[:, SHARED])
    return found


def parts_alone(flag: NDArray[np.uint8], lean: Float) -> NDArray[np.bool_]:
    """Flags and leans as above (n, k) -> (n, k): of lines that were parted, those whose neighbours mostly do not."""
    parted = np.isinf(lean) & (flag == Flag.OK)
    return parted & ~_most_part(flag, np.isinf(lean)) if parted.any() else parted


def _most_part(flag: NDArray[np.uint8], doubled: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Flags of lines (n, k), and which were measured as two -> whether most of the neighbours that were do part."""
    parted = doubled & (flag == Flag.OK)
    some, every = _of_neighbours(
        parted.astype(np.float64), (parted | (flag == Flag.BLENDED) | (flag == Flag.MISFIT)).astype(np.float64)
    )
    return np.asarray(some >= MOST_PART * every)


def _of_neighbours(*values: Float, reach: int = NEIGHBOURS) -> list[Float]:
    """(n, k) each -> sums over the neighbours of each, itself left out: of whole numbers, so that either end is
    alike."""
    whole = np.rint(np.hstack(values) / UNIT).astype(np.int64)
    sums = np.cumsum(np.pad(whole, ((reach + 1, reach), (0, 0))), axis=0)
    found = UNIT * (sums[2 * reach + 1 :] - sums[: -2 * reach - 1] - whole)
    return np.split(found, len(values), axis=1)
