"""Where on each scan line something rises above the noise: the K strongest, separated peaks, measured as seeds.

Shared by every method: a seed is a pixel, a width, an amplitude, a background, and how far a window may reach.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from analysis.line.detection.background_slope import background_slope
from analysis.line.detection.channel import SATURATED
from analysis.line.detection.matched_filter import (
    FILTER_SIGMA,
    RADIUS,
    background_at,
    block_background,
    block_size,
    load_row,
    local_maxima,
    noise_margin,
    respond,
)
from analysis.line.result import Flag
from render.base.arrays import Float32

Array = NDArray[np.float64]
Mask = NDArray[np.uint8]

CENTRE, WIDTH, AMPLITUDE, BACKGROUND, REACH, PLATEAU, SLOPE, SLOPE_SIGMA, PRIOR = range(9)
"""Columns of a seed: px, px, e-, e-, px half-way to the nearest other peak, half width in px of a saturated plateau;
slope of the background along the scan line and its standard deviation, e-/px; from PRIOR on the logarithm of how likely
a narrow line is as wide as each of PRIOR_WIDTHS, all 0 where nothing is known (`methods.shared_width`)."""
PRIOR_WIDTHS = np.concatenate((0.02 + 0.03 * np.arange(17), np.array((0.56, 0.64, 0.72, 0.8))))
"""px. The narrowest is no line that a lens draws on small pixels, but a sheet may be as thin on large ones, as in an
image that is reduced to a quarter."""
SEED_COLUMNS = PRIOR + len(PRIOR_WIDTHS)

NEIGHBOUR = 0.05
"""Fraction of a peak's response from which another peak limits its window of pixels."""
BROAD = 2.0
"""Filter sigmas; a peak that is wider than this at half its height may be a narrow one on a broad glow."""
BUMP = 1.3
"""Times the threshold by which a narrow line stands out of a glow: of a wide line's own noise the highest of many bumps
is looked at, and one wide line of 60 e- in ten was taken for a narrow one. More would lose lines on ground steel: at
1.6 one to three scan lines in 100."""
NARROWEST = 0.4
"""px; a narrower line cannot be told from this one before it is fitted."""


class Limits(NamedTuple):
    """What counts as a line."""

    threshold: float
    """Response over its noise."""
    step: float
    """Of quantisation, e-."""
    gain: float
    """Variance of the filter's response over that of a pixel (`response_gain`)."""
    width: float
    """Known sigma, px, or 0 to measure it."""
    max_width: float
    """px."""


@njit(nogil=True, cache=True, error_model="numpy")
def _crossing(row: Float32, start: int, step: int, limit: int, value: float) -> float:
    """Distance from pixel `start` to where the row first falls below `value`, going by `step`; linear in between."""
    w = row.shape[0]
    for distance in range(1, limit + 1):
        i = start + step * distance
        if i < 0 or i >= w:
            return float(distance)
        if row[i] < value:
            above = row[i - step]
            return distance - (value - row[i]) / max(above - row[i], 1e-30)
    return float(limit)


@njit(nogil=True, cache=True, error_model="numpy")
def _plateau(mask: Mask, centre: int) -> tuple[int, int]:
    """First and last saturated pixel of the run at, or within 2 px of, `centre`; (0, -1) where there is none."""
    w = mask.shape[0]
    for offset in (0, -1, 1, -2, 2):
        i = centre + offset
        if 0 <= i < w and mask[i] & SATURATED:
            first = last = i
            while first > 0 and mask[first - 1] & SATURATED:
                first -= 1
            while last < w - 1 and mask[last + 1] & SATURATED:
                last += 1
            return first, last
    return 0, -1


@njit(nogil=True, cache=True, error_model="numpy")
def _on_glow(response: Float32, i: int, base: float, spread: float, dark: float, rise: float) -> tuple[float, float]:
    """Spread and background of a narrow line on top of a broad glow, as rough metal reflects it; (0, 0): it is not one.

    A Gaussian's curvature is -height / spread^2. A line on a glow is much more curved than the glow is wide, and stands
    out of the glow's own noise: `rise`, in standard deviations of a pixel.
    """
    w = response.shape[0]
    if i < 1 or i > w - 2:
        return 0.0, 0.0
    bend = 2.0 * float(response[i]) - float(response[i - 1]) - float(response[i + 1])
    if bend <= 0.0:
        return 0.0, 0.0
    under, narrow = base, spread
    for _ in range(3):
        narrow = math.sqrt((float(response[i]) - under) / bend)
        if 2.0 * narrow > spread:
            return 0.0, 0.0
        reach = math.ceil(3.0 * narrow)
        under = max(min(float(response[max(i - reach, 0)]), float(response[min(i + reach, w - 1)])), base)
        if float(response[i]) - under <= rise * math.sqrt(max(under, 0.0) + max(dark, 0.0)):
            return 0.0, 0.0
    return narrow, under


@njit(nogil=True, cache=True, error_model="numpy")
def _measure(
    row: Float32, response: Float32, mask: Mask, i: int, base: float, dark: float, limits: Limits, seed: Array
) -> int:
    """Fill a seed from the filter's maximum at pixel i over background `base`; row is the scan line, unpadded.

    dark: variance of a pixel without signal, e-^2.
    """
    width, max_width = limits.width, limits.max_width
    limit = int(4.0 * max_width) + 8
    w = row.shape[0]
    first, last = _plateau(mask, i)
    seed[BACKGROUND] = base
    if last >= first:
        top = float(row[(first + last) // 2]) - base
        half = 0.5 * (last - first + 1)
        ratio = 0.2
        right = _crossing(row, last, 1, limit, base + ratio * top)
        left = _crossing(row, first, -1, limit, base + ratio * top)
        outer = half - 0.5 + 0.5 * (left + right)
        # two heights of a Gaussian, clip and clip / 5, give its sigma and its hidden top
        sigma = math.sqrt(max((outer * outer - half * half) / (-2.0 * math.log(ratio)), NARROWEST**2))
        seed[CENTRE], seed[PLATEAU] = 0.5 * (first + last), half
        seed[WIDTH] = width if width > 0.0 else sigma
        seed[AMPLITUDE] = top * math.exp(min(0.5 * (half / seed[WIDTH]) ** 2, 12.0))
        return Flag.SATURATED.value if seed[WIDTH] <= max_width else Flag.TOO_WIDE.value
    top = float(response[i]) - base
    right = _crossing(response, i, 1, limit, base + 0.5 * top)
    left = _crossing(response, i, -1, limit, base + 0.5 * top)
    spread = (left + right) / 2.3548
    if spread > BROAD * FILTER_SIGMA:
        rise = BUMP * limits.threshold * math.sqrt(limits.gain)
        narrow, under = _on_glow(response, i, base, spread, dark, rise)
        if narrow > 0.0:
            spread, base = narrow, under
            top = float(response[i]) - base
            seed[BACKGROUND] = base
    sigma = math.sqrt(max(spread * spread - FILTER_SIGMA * FILTER_SIGMA, NARROWEST**2))
    offset = 0.0
    if 0 < i < w - 1:
        before, after = float(response[i - 1]), float(response[i + 1])
        bend = before - 2.0 * float(response[i]) + after
        offset = 0.5 * (before - after) / bend if bend < 0.0 else 0.0
    seed[CENTRE], seed[PLATEAU] = i + min(max(offset, -0.5), 0.5), 0.0
    seed[WIDTH] = width if width > 0.0 else sigma
    # undo what the filter takes off the top of a Gaussian
    seed[AMPLITUDE] = top * math.sqrt(1.0 + (FILTER_SIGMA / seed[WIDTH]) ** 2)
    return Flag.OK.value if seed[WIDTH] <= max_width else Flag.TOO_WIDE.value


@njit(nogil=True, cache=True, error_model="numpy")
def detect(signal: Float32, mask: Mask, floor: Float32, limits: Limits, seeds: Array, flags: Mask) -> None:
    """Scan lines (n, w) in electrons -> seeds (n, k, SEED_COLUMNS), strongest first, but for PRIOR, and flags (n, k).

    floor (n, w) or (n, 1): variance of a pixel without signal, e-^2.
    """
    n, w = signal.shape
    wanted = seeds.shape[1]
    row, response = np.empty(w + 2 * RADIUS, np.float32), np.empty(w, np.float32)
    block = block_size(w)
    blocks = max(1, w // block)
    means, level, margin = np.empty(blocks), np.empty(blocks), np.empty(blocks)
    at, height = np.empty(w, np.int32), np.empty(w)
    for y in range(n):
        usable = load_row(signal[y], mask[y], row)
        for k in range(wanted):
            flags[y, k] = Flag.NO_PEAK.value if usable else Flag.NO_PIXELS.value
            for j in range(PRIOR):
                seeds[y, k, j] = np.nan
        if not usable:
            continue
        respond(row, response)
        block_background(response, means, level)
        noise_margin(response, floor[y], limits.gain * w / usable, level, limits.threshold, limits.step, margin)
        found = local_maxima(response, level, margin, at)
        for j in range(found):
            pixel = np.int64(at[j])
            height[j] = response[pixel] - background_at(pixel, level, block)
        line = row[RADIUS : RADIUS + w]
        taken = 0
        while taken < wanted:
            best = -1
            for j in range(found):
                if height[j] > 0.0 and (best < 0 or height[j] > height[best]):
                    best = j
            if best < 0:
                break
            seed = seeds[y, taken]
            pixel = np.int64(at[best])
            base = background_at(pixel, level, block)
            dark = float(floor[y, min(pixel, floor.shape[1] - 1)])
            flags[y, taken] = _measure(line, response, mask[y], pixel, base, dark, limits, seed)
            covered = max(3.0 * seed[WIDTH], 3.0) + seed[PLATEAU]
            strength, reach = height[best], np.inf
            for j in range(found):
                distance = abs(at[j] - seed[CENTRE])
                if distance <= covered:
                    height[j] = 0.0
                elif abs(height[j]) >= NEIGHBOUR * strength:
                    reach = min(reach, 0.5 * distance)
            height[best] = -strength  # taken: no longer a candidate, still a neighbour
            seed[REACH] = reach
            inner, outer = 4.0 * seed[WIDTH] + 1.5 + seed[PLATEAU], 8.0 * seed[WIDTH] + 6.5 + seed[PLATEAU]
            beside, slope, slope_sigma = background_slope(
                signal[y], mask[y], floor[y], seed[CENTRE], inner, min(outer, reach)
            )
            if flags[y, taken] != Flag.OK.value:  # beside a plateau the wings reach farther than the seed knows
                slope = slope_sigma = 0.0
            if slope != 0.0:  # on it the blocks' median is the level beside the line
                flags[y, taken] = _measure(line, response, mask[y], pixel, beside, dark, limits, seed)
            seed[SLOPE], seed[SLOPE_SIGMA] = slope, slope_sigma
            taken += 1
