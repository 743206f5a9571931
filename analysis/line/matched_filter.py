"""The matched filter on one scan line: a Gaussian response, the background under it and the noise around it."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from analysis.line.channel import MISSING

Float32 = NDArray[np.float32]
Array = NDArray[np.float64]
Mask = NDArray[np.uint8]

FILTER_SIGMA = 1.5
"""px; for lines of 0.6 to 4 px it gives up less than 20 % of the best signal-to-noise."""
RADIUS = 4
BLOCK = 32
TEXTURE = 1.25
"""A row whose response spreads this much more than its noise is textured: the spread is its noise then."""

_taps = np.exp(-0.5 * (np.arange(RADIUS + 1) / FILTER_SIGMA) ** 2)
_taps /= 2.0 * _taps.sum() - _taps[0]
T0, T1, T2, T3, T4 = (np.float32(t) for t in _taps)
NOISE_GAIN = float(2.0 * (_taps**2).sum() - _taps[0] ** 2)
"""Variance of the response over that of a pixel."""
SKEW_GAIN = float(2.0 * (_taps**3).sum() - _taps[0] ** 3)
LEVEL_GAIN = 0.5 * math.pi / (7 * BLOCK)
"""Variance of the background, a median of 7 block means, over that of a pixel."""


@njit(nogil=True, cache=True)
def load_row(signal: Float32, mask: Mask, row: Float32) -> int:
    """(w,) -> padded (w + 2 RADIUS,), gaps filled linearly; returns the number of usable pixels."""
    w = signal.shape[0]
    gaps = 0
    for i in range(w):
        row[i + RADIUS] = signal[i]
        gaps += (mask[i] & MISSING) >> 1
    if gaps == w:
        return 0
    if gaps > 0:
        last = -1
        for i in range(w):
            if mask[i] & MISSING == 0:
                if last < i - 1:
                    right = signal[i]
                    left = signal[last] if last >= 0 else right
                    for j in range(last + 1, i):
                        row[j + RADIUS] = left + (right - left) * (j - last) / (i - last)
                last = i
        for j in range(last + 1, w):
            row[j + RADIUS] = signal[last]
    for j in range(RADIUS):
        row[j] = row[RADIUS]
        row[w + RADIUS + j] = row[w + RADIUS - 1]
    return w - gaps


@njit(nogil=True, cache=True)
def respond(row: Float32, out: Float32) -> None:
    """Gaussian filter of unit sum."""
    for i in range(out.shape[0]):
        out[i] = (
            T0 * row[i + 4]
            + T1 * (row[i + 3] + row[i + 5])
            + T2 * (row[i + 2] + row[i + 6])
            + T3 * (row[i + 1] + row[i + 7])
            + T4 * (row[i] + row[i + 8])
        )


@njit(nogil=True, cache=True)
def block_background(response: Float32, means: Array, level: Array) -> int:
    """Medians of the means of 7 neighbouring blocks: a line spoils 2 or 3 of them. Returns the number of blocks."""
    w = response.shape[0]
    blocks = max(1, w // BLOCK)
    for b in range(blocks):
        start = b * BLOCK
        stop = start + BLOCK if b < blocks - 1 else w
        total, count = 0.0, 0
        for i in range(start + 1, stop, 4):  # the response is smooth: every fourth value holds nearly all of it
            total += response[i]
            count += 1
        means[b] = total / max(count, 1)
    sorted_means = np.empty(7)
    for b in range(blocks):
        low = max(0, min(b - 3, blocks - 7))
        count = min(blocks, low + 7) - low
        for j in range(count):
            value = means[low + j]
            k = j
            while k > 0 and sorted_means[k - 1] > value:
                sorted_means[k] = sorted_means[k - 1]
                k -= 1
            sorted_means[k] = value
        level[b] = 0.5 * (sorted_means[(count - 1) // 2] + sorted_means[count // 2])
    return blocks


@njit(nogil=True, cache=True)
def background_at(x: float, level: Array, blocks: int) -> float:
    position = (x + 0.5) / BLOCK - 0.5
    b = math.floor(position)
    if b < 0:
        return level[0]
    if b >= blocks - 1:
        return level[blocks - 1]
    t = position - b
    return (1.0 - t) * level[b] + t * level[b + 1]


@njit(nogil=True, cache=True)
def noise_margin(
    response: Float32, floor: Float32, scale: float, level: Array, blocks: int, threshold: float, step: float, margin: Array
) -> None:
    """How far above the background a response must rise at each block: threshold times its noise; floor (w,) or (1,).

    Photon counts lean upwards: Cornish and Fisher's (1938) first term keeps the rate of false peaks that of a Gaussian.
    Texture counts as noise. Noise below half a quantisation step is no longer Gaussian, but it cannot reach one `step`.
    """
    w = response.shape[0]
    sigma = np.empty(blocks)
    for b in range(blocks):
        photons = max(level[b], 0.0)
        variance = photons + floor[min(b * BLOCK + BLOCK // 2, floor.shape[0] - 1)]
        sigma[b] = math.sqrt(scale * (NOISE_GAIN + LEVEL_GAIN) * variance)
        skew = SKEW_GAIN * photons / (NOISE_GAIN * variance) ** 1.5
        margin[b] = max((threshold + skew * max(threshold * threshold - 1.0, 0.0) / 6.0) * sigma[b], step)
    spread, count = 0, 0
    for i in range(2, w, 8):
        b = min(i // BLOCK, blocks - 1)
        spread += abs(response[i] - background_at(i, level, blocks)) > 0.6745 * TEXTURE * sigma[b]
        count += 1
    if 2 * spread <= count + 3.0 * math.sqrt(count):  # three sigma of a fair coin
        return
    size = np.empty(blocks)
    for b in range(blocks):
        total, count = 0.0, 0
        for i in range(b * BLOCK + 1, min((b + 1) * BLOCK, w), 2):
            total += abs(response[i] - background_at(i, level, blocks))
            count += 1
        value = total / max(count, 1)
        k = b
        while k > 0 and size[k - 1] > value:
            size[k] = size[k - 1]
            k -= 1
        size[k] = value
    texture = 1.2533 * size[blocks // 2]
    for b in range(blocks):
        margin[b] = max(margin[b], threshold * texture)


@njit(nogil=True, cache=True)
def local_maxima(response: Float32, level: Array, margin: Array, blocks: int, at: NDArray[np.int32]) -> int:
    """Pixels where the response is a maximum and exceeds background + margin; returns how many."""
    w = response.shape[0]
    found = 0
    for b in range(-1, blocks):
        # from the centre of one block to the next, the bound is a straight line
        left, right = max(b, 0), min(b + 1, blocks - 1)
        start = 0 if b < 0 else b * BLOCK + BLOCK // 2
        stop = w if b == blocks - 1 else (b + 1) * BLOCK + BLOCK // 2
        low, high = level[left] + margin[left], level[right] + margin[right]
        slope = np.float32((high - low) / BLOCK)
        bound = np.float32(low)
        for i in range(start, stop):
            value = response[i]
            if value > bound + slope * np.float32(i - start):
                before = response[i - 1] if i > 0 else np.float32(-np.inf)
                after = response[i + 1] if i < w - 1 else np.float32(-np.inf)
                if value >= before and value > after:
                    at[found] = i
                    found += 1
    return found
