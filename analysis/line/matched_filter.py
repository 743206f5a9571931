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
"""px; the background is sought on blocks of pixels, at least 8 of them."""
TEXTURED_BLOCKS = 24
"""At most twice so many tell how large a texture is."""
TEXTURE = 1.25
"""A row whose response spreads this much more than its noise is textured: the spread is its noise then."""

_taps = np.exp(-0.5 * (np.arange(RADIUS + 1) / FILTER_SIGMA) ** 2)
_taps /= 2.0 * _taps.sum() - _taps[0]
T0, T1, T2, T3, T4 = (np.float32(t) for t in _taps)
NOISE_GAIN = float(2.0 * (_taps**2).sum() - _taps[0] ** 2)
"""Variance of the response over that of a pixel."""
SKEW_GAIN = float(2.0 * (_taps**3).sum() - _taps[0] ** 3)


def response_gain(correlation: Array) -> float:
    """Variance of the response over that of a raw pixel, for pixels whose covariance at distance d is (m,)."""
    kernel = np.concatenate([_taps[:0:-1], _taps])
    overlap = np.correlate(kernel, kernel, "full")[2 * RADIUS :]
    m = min(len(overlap), len(correlation))
    return float(2.0 * (overlap[:m] * correlation[:m]).sum() - overlap[0] * correlation[0])


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
def block_size(w: int) -> int:
    """Pixels in a block, at most BLOCK."""
    return max(4, min(BLOCK, w // 8))


@njit(nogil=True, cache=True)
def _insert(ordered: Array, count: int, value: float) -> None:
    """Put a value into its place among the `count` first."""
    while count > 0 and ordered[count - 1] > value:
        ordered[count] = ordered[count - 1]
        count -= 1
    ordered[count] = value


@njit(nogil=True, cache=True)
def _median(a: float, b: float, c: float, d: float, e: float, f: float, g: float) -> float:
    """Of seven, by minima and maxima alone, so that there is no branch to guess (Devillard, 1998)."""
    a, f = min(a, f), max(a, f)
    a, d = min(a, d), max(a, d)
    b, g = min(b, g), max(b, g)
    c, e = min(c, e), max(c, e)
    b = max(a, b)
    d, f = min(d, f), max(d, f)
    c, g = min(c, g), max(c, g)
    d = max(c, d)
    d = min(d, g)
    e = min(e, f)
    b, e = min(b, e), max(b, e)
    d = max(b, d)
    return min(d, e)


@njit(nogil=True, cache=True)
def block_background(response: Float32, means: Array, level: Array) -> None:
    """Robust level at the centre of each block: the median over up to 7 blocks, of which a line spoils 2 or 3.

    As many blocks left as right, so that a slope does no harm. Near the image's ends either fewer blocks are taken or
    a straight line stands in for those beyond; a line can only raise one of the two.
    """
    w, blocks = response.shape[0], means.shape[0]
    block = block_size(w)
    for b in range(blocks):
        total, count = 0.0, 0
        for i in range(b * block + 1, min((b + 1) * block, w), 4):  # smooth: every fourth holds nearly all of it
            total += response[i]
            count += 1
        means[b] = total / count if count else response[0]
    near, far = np.empty(7), np.empty(7)
    for b in range(blocks):
        if 3 <= b < blocks - 3:
            level[b] = _median(
                means[b - 3], means[b - 2], means[b - 1], means[b], means[b + 1], means[b + 2], means[b + 3]
            )
            continue
        near[0] = far[0] = means[b]
        pairs = continued = 0
        for distance in range(1, 4):
            left, right = b - distance, b + distance
            if left >= 0 and right < blocks:
                _insert(near, 1 + 2 * pairs, means[left])
                _insert(near, 2 + 2 * pairs, means[right])
                _insert(far, 1 + 2 * continued, means[left])
                _insert(far, 2 + 2 * continued, means[right])
                pairs += 1
                continued += 1
            else:
                inner = right if left < 0 else left
                outer = 2 * inner - b
                if 0 <= outer < blocks:
                    _insert(far, 1 + 2 * continued, means[inner])
                    _insert(far, 2 + 2 * continued, 2.0 * means[inner] - means[outer])
                    continued += 1
        level[b] = min(near[pairs], far[continued])


@njit(nogil=True, cache=True)
def background_at(x: float, level: Array, block: int) -> float:
    """The level at x, on straight lines between the centres of blocks."""
    blocks = level.shape[0]
    if blocks == 1:
        return level[0]
    position = (x + 0.5) / block - 0.5
    b = min(max(math.floor(position), 0), blocks - 2)
    t = position - b
    return (1.0 - t) * level[b] + t * level[b + 1]


@njit(nogil=True, cache=True)
def noise_margin(
    response: Float32,
    floor: Float32,
    gain: float,
    level: Array,
    threshold: float,
    step: float,
    margin: Array,
) -> None:
    """How far above the background a response must rise at each block: threshold times its noise; floor (w,) or (1,).
    gain: variance of the response over that of a pixel.

    Photon counts lean upwards: Cornish and Fisher's (1938) first term keeps the rate of false peaks that of a Gaussian.
    Texture counts as noise. Noise below half a quantisation step is no longer Gaussian, but it cannot reach one `step`.
    """
    w, blocks = response.shape[0], level.shape[0]
    block = block_size(w)
    level_gain = 0.5 * math.pi / (block * min(5, blocks))  # a median of block means
    sigma = np.empty(blocks)
    for b in range(blocks):
        photons = max(level[b], 0.0)
        variance = max(photons + floor[min(b * block + block // 2, floor.shape[0] - 1)], 1e-2)
        sigma[b] = math.sqrt(gain * (1.0 + level_gain / NOISE_GAIN) * variance)
        pixel_variance = NOISE_GAIN * variance
        skew = SKEW_GAIN * photons / (pixel_variance * math.sqrt(pixel_variance))
        margin[b] = max((threshold + skew * max(threshold * threshold - 1.0, 0.0) / 6.0) * sigma[b], step)
    spread, count = 0, 0
    for b in range(blocks):
        middle, bound = level[b], 0.6745 * TEXTURE * sigma[b]
        for i in range(b * block + 2, min((b + 1) * block, w), 8):
            spread += abs(response[i] - middle) > bound
            count += 1
    if 2 * spread <= count + 3.0 * math.sqrt(count):  # three sigma of a fair coin
        return
    size = np.empty(blocks)
    every = 1 + blocks // TEXTURED_BLOCKS
    for b in range(0, blocks, every):
        before, after = max(b - 1, 0), min(b + 1, blocks - 1)
        slope = np.float32((level[after] - level[before]) / (block * max(after - before, 1)))
        middle, centre = np.float32(level[b]), np.float32((b + 0.5) * block - 0.5)
        sum_of, count = np.float32(0.0), 0
        for i in range(b * block, min((b + 1) * block, w)):
            sum_of += abs(response[i] - middle - slope * (np.float32(i) - centre))
            count += 1
        _insert(size, b // every, sum_of / max(count, 1))
    texture = 1.2533 * size[(blocks - 1) // every // 2]
    for b in range(blocks):
        margin[b] = max(margin[b], threshold * texture)


@njit(nogil=True, cache=True)
def local_maxima(response: Float32, level: Array, margin: Array, at: NDArray[np.int32]) -> int:
    """Pixels where the response is a maximum and exceeds background + margin; returns how many."""
    w, blocks = response.shape[0], level.shape[0]
    block = block_size(w)
    found = 0
    for b in range(max(1, blocks - 1)):
        # from the centre of one block to the next, the bound is a straight line
        after_b = min(b + 1, blocks - 1)
        low, high = level[b] + margin[b], level[after_b] + margin[after_b]
        slope = np.float32((high - low) / block)
        start = 0 if b == 0 else b * block + block // 2
        stop = w if b >= blocks - 2 else (b + 1) * block + block // 2
        bound = np.float32(low) + slope * np.float32(start - (b * block + 0.5 * block - 0.5))
        lowest = min(bound, bound + slope * np.float32(stop - start))
        above = np.int32(0)
        for i in range(start, stop):  # without a branch: most stretches hold nothing
            above += np.int32(response[i] > lowest)
        if above == 0:
            continue
        for i in range(start, stop):
            value = response[i]
            if value > bound + slope * np.float32(i - start):
                before = response[i - 1] if i > 0 else np.float32(-np.inf)
                after = response[i + 1] if i < w - 1 else np.float32(-np.inf)
                if value >= before and value > after:
                    at[found] = i
                    found += 1
    return found
