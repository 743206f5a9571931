"""Narrow peaks that other light hides: on the flank of a brighter one, or on top of a broad glow.

A filtered scan line, of which a straight background has no second difference, and a broad glow hardly any:

    bend = -R'' = 2 R_i - R_i-1 - R_i+1     a line of sigma s in a filter of sigma f: h / (s^2 + f^2)
    noise of it                             by the counts on the spot, not those of the row's background
    R' at the middle                        the background's slope, as a line has none there

They are no lines before somebody says so: the bumps of a glow are among them.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from analysis.line.detection.detect import (
    AMPLITUDE,
    BACKGROUND,
    CENTRE,
    NARROWEST,
    PLATEAU,
    PRIOR,
    REACH,
    SLOPE,
    SLOPE_SIGMA,
    WIDTH,
)
from analysis.line.detection.matched_filter import FILTER_SIGMA, RADIUS, TAPS, load_row, respond
from analysis.line.result import Flag
from render.base.arrays import Float32

Array = NDArray[np.float64]
Mask = NDArray[np.uint8]

BROADEST = 3.0
"""px; what is wider is no narrow line on something else, and found as it is."""
NEAREST = 1.0
"""px around a peak that is measured already; of a wider one its sigma, up to BROADEST."""
AWAY = RADIUS
"""Pixels on either side by whose level the light under a peak is known."""


class Sought(NamedTuple):
    """What counts as a hidden peak."""

    threshold: float
    """Bend over its noise."""
    gain: float
    """Variance of the bend over that of a pixel (`bend_gain`)."""
    scattered: float
    """Variance of the light over its squared mean, as speckle makes it."""
    width: float
    """Known sigma, px, or 0 to measure it."""


def bend_gain(correlation: Array) -> float:
    """Variance of the bend over that of a raw pixel, for pixels whose covariance at distance d is (m,)."""
    taps = np.convolve(TAPS, (-1.0, 2.0, -1.0))
    overlap = np.correlate(taps, taps, "full")[len(taps) - 1 :]
    m = min(len(overlap), len(correlation))
    return float(2.0 * (overlap[:m] * correlation[:m]).sum() - overlap[0] * correlation[0])


@njit(nogil=True, cache=True, error_model="numpy")
def _bend(response: Float32, i: int) -> float:
    return 2.0 * float(response[i]) - float(response[i - 1]) - float(response[i + 1])


@njit(nogil=True, cache=True, error_model="numpy")
def _fall(response: Float32, i: int, step: int) -> float:
    """Distance from pixel i, by step, to where the scan line bends the other way; linear in between."""
    before = _bend(response, i)
    for distance in range(1, RADIUS + 1):
        at = i + step * distance
        if at < 1 or at > response.shape[0] - 2:
            return float(distance)
        bend = _bend(response, at)
        if bend <= 0.0:
            return distance - 1.0 + before / (before - bend)
        before = bend
    return float(RADIUS + 1)


@njit(nogil=True, cache=True, error_model="numpy")
def _fill(response: Float32, i: int, bend: float, variance: float, width: float, seed: Array) -> bool:
    """Seed of a maximum of the bend at pixel i, where pixels have a variance; False where it is too broad."""
    spread = 0.5 * (_fall(response, i, 1) + _fall(response, i, -1))
    if spread * spread > BROADEST * BROADEST + FILTER_SIGMA * FILTER_SIGMA:
        return False
    before, after = _bend(response, i - 1), _bend(response, i + 1)
    curve = before - 2.0 * bend + after
    offset = min(max(0.5 * (before - after) / curve, -0.5), 0.5) if curve < 0.0 else 0.0
    sigma = width if width > 0.0 else math.sqrt(max(spread * spread - FILTER_SIGMA * FILTER_SIGMA, NARROWEST**2))
    both = sigma * sigma + FILTER_SIGMA * FILTER_SIGMA
    height = bend * both
    seed[CENTRE], seed[WIDTH], seed[PLATEAU], seed[REACH] = i + offset, sigma, 0.0, np.inf
    seed[AMPLITUDE] = height * math.sqrt(both) / sigma
    seed[BACKGROUND] = float(response[i]) - height
    # the line's own part of R' is -h offset / (s^2 + f^2) to first order
    seed[SLOPE] = 0.5 * (float(response[i + 1]) - float(response[i - 1])) - bend * offset
    seed[SLOPE_SIGMA] = abs(seed[SLOPE])
    return True


@njit(nogil=True, cache=True, error_model="numpy")
def detect_hidden(
    signal: Float32, mask: Mask, floor: Float32, known: tuple[Array, Array], sought: Sought, seeds: Array, flags: Mask
) -> None:
    """Scan lines (n, w) in electrons -> seeds (n, k, SEED_COLUMNS) of hidden peaks, clearest first, and flags (n, k).

    floor (n, w) or (n, 1): variance of a pixel without signal, e-^2. known: position, NaN for none, and width (n, m) of
    the peaks that were found without.
    """
    n, w = signal.shape
    wanted = seeds.shape[1]
    row, response = np.empty(w + 2 * RADIUS, np.float32), np.empty(w, np.float32)
    clear = np.empty(wanted)
    at = np.empty(wanted, np.int64)
    least = sought.threshold * sought.threshold * sought.gain
    for y in range(n):
        for k in range(wanted):
            flags[y, k] = Flag.NO_PEAK.value
            for j in range(PRIOR):
                seeds[y, k, j] = np.nan
        if not load_row(signal[y], mask[y], row):
            continue
        respond(row, response)
        found = 0
        for i in range(AWAY, w - AWAY):
            bend = _bend(response, i)
            if bend <= 0.0:
                continue
            dark = float(floor[y, min(i, floor.shape[1] - 1)])
            if bend * bend <= least * (float(response[i]) + dark):
                continue
            if bend < _bend(response, i - 1) or bend <= _bend(response, i + 1):
                continue
            level = max(0.5 * (float(response[i - AWAY]) + float(response[i + AWAY])), 0.0)
            variance = max(float(response[i]), 0.0) + dark + sought.scattered * level * level
            clearness = bend * bend / variance
            if clearness <= least or mask[y, i - 2 : i + 3].any():
                continue
            taken = False
            for k in range(known[0].shape[1]):
                near = max(NEAREST, min(known[1][y, k], BROADEST))
                taken = taken or abs(known[0][y, k] - i) <= near
            if taken:
                continue
            k = found if found < wanted else wanted - 1
            if found == wanted and clearness <= clear[k]:
                continue
            while k > 0 and clear[k - 1] < clearness:
                clear[k], at[k] = clear[k - 1], at[k - 1]
                k -= 1
            clear[k], at[k] = clearness, i
            found = min(found + 1, wanted)
        taken_seeds = 0
        for k in range(found):
            i = at[k]
            if _fill(response, i, _bend(response, i), 0.0, sought.width, seeds[y, taken_seeds]):
                flags[y, taken_seeds] = Flag.OK.value
                taken_seeds += 1
            else:
                for j in range(PRIOR):
                    seeds[y, taken_seeds, j] = np.nan
