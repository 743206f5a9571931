"""Where on each scan line something rises above the noise: the K strongest, separated peaks, measured as seeds.

Shared by every method: a seed is a pixel, a width, an amplitude, a background, and how far a window may reach.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

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

Float32 = NDArray[np.float32]
Array = NDArray[np.float64]
Mask = NDArray[np.uint8]

CENTRE, WIDTH, AMPLITUDE, BACKGROUND, REACH, PLATEAU = range(6)
"""Columns of a seed: px, px, e-, e-, px half-way to the nearest other peak, half width in px of a saturated plateau."""
SEED_COLUMNS = 6

NEIGHBOUR = 0.05
"""Fraction of a peak's response from which another peak limits its window of pixels."""
HUMP = 2.0
"""Filter sigmas; a peak that is wider than this at half its height may be a narrow one on a broad glow."""
NARROWEST = 0.4
"""px; a narrower line cannot be told from this one before it is fitted."""

_OK, _NO_PEAK, _NO_PIXELS = int(Flag.OK), int(Flag.NO_PEAK), int(Flag.NO_PIXELS)
_SATURATED, _TOO_WIDE = int(Flag.SATURATED), int(Flag.TOO_WIDE)


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
def _on_hump(response: Float32, i: int, base: float, spread: float, still: float, rise: float) -> tuple[float, float]:
    """Spread and background of a narrow line on top of a broad glow, as rough metal reflects it; (0, 0): it is not one.

    A Gaussian's curvature is -height / spread^2. A line on a hump is much more curved than the hump is wide, and stands
    out of the hump's own noise.
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
        if float(response[i]) - under <= rise * math.sqrt(max(under, 0.0) + max(still, 0.0)):
            return 0.0, 0.0
    return narrow, under


@njit(nogil=True, cache=True, error_model="numpy")
def _measure(  # noqa: PLR0913
    row: Float32,
    response: Float32,
    mask: Mask,
    i: int,
    base: float,
    still: float,
    rise: float,
    width: float,
    max_width: float,
    seed: Array,
) -> int:
    """Fill a seed from the filter's maximum at pixel i over background `base`; row is the scan line, unpadded.

    still: variance of a pixel without signal. rise: threshold times the filter's gain in standard deviation.
    """
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
        return _SATURATED if seed[WIDTH] <= max_width else _TOO_WIDE
    top = float(response[i]) - base
    right = _crossing(response, i, 1, limit, base + 0.5 * top)
    left = _crossing(response, i, -1, limit, base + 0.5 * top)
    spread = (left + right) / 2.3548
    if spread > HUMP * FILTER_SIGMA:
        narrow, under = _on_hump(response, i, base, spread, still, rise)
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
    return _OK if seed[WIDTH] <= max_width else _TOO_WIDE


@njit(nogil=True, cache=True, error_model="numpy")
def detect(  # noqa: PLR0913
    signal: Float32,
    mask: Mask,
    floor: Float32,
    threshold: float,
    step: float,
    gain: float,
    width: float,
    max_width: float,
    seeds: Array,
    flags: Mask,
) -> None:
    """Scan lines (n, w) in electrons -> seeds (n, k, 6) and flags (n, k), strongest first.

    floor (n, w) or (n, 1): variance of a pixel without signal. step: of quantisation, e-.
    gain: variance of the filter's response over that of a pixel (`response_gain`).
    width: known sigma in px, or 0 to measure it.
    """
    n, w = signal.shape
    wanted = seeds.shape[1]
    row, response = np.empty(w + 2 * RADIUS, np.float32), np.empty(w, np.float32)
    block = block_size(w)
    blocks = max(1, w // block)
    means, level, margin = np.empty(blocks), np.empty(blocks), np.empty(blocks)
    at, height = np.empty(w, np.int32), np.empty(w)
    rise = threshold * math.sqrt(gain)
    for y in range(n):
        usable = load_row(signal[y], mask[y], row)
        for k in range(wanted):
            flags[y, k] = _NO_PEAK if usable else _NO_PIXELS
            for j in range(SEED_COLUMNS):
                seeds[y, k, j] = np.nan
        if not usable:
            continue
        respond(row, response)
        block_background(response, means, level)
        noise_margin(response, floor[y], gain * w / usable, level, threshold, step, margin)
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
            still = float(floor[y, min(pixel, floor.shape[1] - 1)])
            flags[y, taken] = _measure(line, response, mask[y], pixel, base, still, rise, width, max_width, seed)
            claim = max(3.0 * seed[WIDTH], 3.0) + seed[PLATEAU]
            strength, reach = height[best], np.inf
            for j in range(found):
                distance = abs(at[j] - seed[CENTRE])
                if distance <= claim:
                    height[j] = 0.0
                elif abs(height[j]) >= NEIGHBOUR * strength:
                    reach = min(reach, 0.5 * distance)
            height[best] = -strength  # taken: no longer a candidate, still a neighbour
            seed[REACH] = reach
            taken += 1
