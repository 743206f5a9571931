"""The matched filter on one scan line: a Gaussian response, the background under it and the noise around it."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from analysis.line.detection.channel import MISSING
from render.base.arrays import Float32

Array = NDArray[np.float64]
Mask = NDArray[np.uint8]

FILTER_SIGMA = 1.5
"""px; for lines of 0.6 to 4 px it gives up less than 20 % of the best signal-to-noise."""
RADIUS = 4
BLOCK = 32
"""px; the background is sought on blocks of pixels, at least 8 of them."""
SAMPLES = 4
"""Of a whole block, at every eighth pixel."""
TEXTURED_BLOCKS = 24
"""At most twice so many tell how large a texture is."""
TEXTURE = 1.25
"""A row whose response spreads this much more than its noise is textured: the spread is its noise then."""

_taps = np.exp(-0.5 * (np.arange(RADIUS + 1) / FILTER_SIGMA) ** 2)
_taps /= 2.0 * _taps.sum() - _taps[0]
T0, T1, T2, T3, T4 = (np.float32(t) for t in _taps)
TAPS = np.concatenate([_taps[:0:-1], _taps])
"""(2 RADIUS + 1,)."""
NOISE_GAIN = float(2.0 * (_taps**2).sum() - _taps[0] ** 2)
"""Variance of the response over that of a pixel."""
SKEW_GAIN = float(2.0 * (_taps**3).sum() - _taps[0] ** 3)


def response_gain(correlation: Array) -> float:
    """Variance of the response over that of a raw pixel, for pixels whose covariance at distance d is (m,)."""
    overlap = np.correlate(TAPS, TAPS, "full")[2 * RADIUS :]
    m = min(len(overlap), len(correlation))
    return float(2.0 * (overlap[:m] * correlation[:m]).sum() - overlap[0] * correlation[0])


@njit(nogil=True, cache=True, error_model="numpy")
def load_row(signal: Float32, mask: Mask, row: Float32) -> int:
    """(w,) -> padded (w + 2 RADIUS,), gaps filled linearly; returns the number of usable pixels."""
    w = signal.shape[0]
    seen, gaps = np.uint8(0), 0
    for i in range(w):
        row[i + RADIUS] = signal[i]
    for i in range(w):  # 32 at a time, which a count is not
        seen |= mask[i]
    if seen & MISSING:
        for i in range(w):
            gaps += (mask[i] & MISSING) >> 1
        if gaps == w:
            return 0
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


@njit(nogil=True, cache=True, error_model="numpy")
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


@njit(nogil=True, cache=True, error_model="numpy")
def block_size(w: int) -> int:
    """Pixels in a block, at most BLOCK."""
    return max(4, min(BLOCK, w // 8))


@njit(nogil=True, cache=True, error_model="numpy")
def _insert(ordered: Array, count: int, value: float) -> None:
    """Put a value into its place among the `count` first."""
    while count > 0 and ordered[count - 1] > value:
        ordered[count] = ordered[count - 1]
        count -= 1
    ordered[count] = value


@njit(nogil=True, cache=True, error_model="numpy")
def _low(a: float, b: float) -> float:
    return a if a < b else b


@njit(nogil=True, cache=True, error_model="numpy")
def _high(a: float, b: float) -> float:
    return b if a < b else a


@njit(nogil=True, cache=True, error_model="numpy")
def _median(a: float, b: float, c: float, d: float, e: float, f: float, g: float) -> float:
    """Of seven, by minima and maxima alone, so that several are found at a time (Devillard, 1998)."""
    a, f = _low(a, f), _high(a, f)
    a, d = _low(a, d), _high(a, d)
    b, g = _low(b, g), _high(b, g)
    c, e = _low(c, e), _high(c, e)
    b = _high(a, b)
    d, f = _low(d, f), _high(d, f)
    c, g = _low(c, g), _high(c, g)
    d = _high(c, d)
    d = _low(d, g)
    e = _low(e, f)
    b, e = _low(b, e), _high(b, e)
    d = _high(b, d)
    return _low(d, e)


@njit(nogil=True, cache=True, error_model="numpy")
def block_background(response: Float32, means: Array, level: Array) -> None:
    """Robust level at the centre of each block: the median over up to 7 blocks, of which a line spoils 2 or 3.

    As many blocks left as right, so that a slope does no harm. Near the image's ends either fewer blocks are taken or
    a straight line stands in for those beyond; a line can only raise one of the two.
    """
    w, blocks = response.shape[0], means.shape[0]
    block = block_size(w)
    first, quarter = min(1, w - 1), block // 4
    for b in range(blocks):
        total, start = np.float32(0.0), np.uint64(b * block + first)
        for i in range(quarter):  # smooth: every fourth holds nearly all of it
            total += response[start + np.uint64(4 * i)]
        means[b] = total / np.float32(quarter)
    for b in range(blocks - 6):
        level[b + 3] = _median(
            means[b], means[b + 1], means[b + 2], means[b + 3], means[b + 4], means[b + 5], means[b + 6]
        )
    near, far = np.empty(7), np.empty(7)
    for b in range(blocks):
        if 3 <= b < blocks - 3:
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


@njit(nogil=True, cache=True, error_model="numpy")
def background_at(x: float, level: Array, block: int) -> float:
    """The level at x, on straight lines between the centres of blocks."""
    blocks = level.shape[0]
    if blocks == 1:
        return level[0]
    position = (x + 0.5) / block - 0.5
    b = min(max(math.floor(position), 0), blocks - 2)
    t = position - b
    return (1.0 - t) * level[b] + t * level[b + 1]


@njit(nogil=True, cache=True, error_model="numpy")
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
    scale = math.sqrt(gain * (1.0 + level_gain / NOISE_GAIN))
    lift = max(threshold * threshold - 1.0, 0.0) / 6.0 * SKEW_GAIN / (NOISE_GAIN * math.sqrt(NOISE_GAIN))
    sigma = np.empty(blocks)
    for b in range(blocks):
        sigma[b] = floor[min(b * block + block // 2, floor.shape[0] - 1)]
    for b in range(blocks):  # conditions in place of max, so that it is done four at a time
        photons = level[b] if level[b] > 0.0 else 0.0
        variance = photons + sigma[b]
        variance = variance if variance > 1e-2 else 1e-2
        root = math.sqrt(variance)
        rise = (threshold + lift * photons / (variance * root)) * scale * root
        sigma[b] = scale * root
        margin[b] = rise if rise > step else step
    spread = np.int32(0)
    samples = (block + 5) // 8
    for b in range(blocks):
        middle, bound = np.float32(level[b]), np.float32(0.6745 * TEXTURE * sigma[b])
        start = np.uint64(min(b * block + 2, w - 1))
        if samples == SAMPLES:  # most often, and over a length known beforehand
            for i in range(SAMPLES):
                spread += np.int32(abs(response[start + np.uint64(8 * i)] - middle) > bound)
        else:
            for i in range(samples):
                spread += np.int32(abs(response[start + np.uint64(8 * i)] - middle) > bound)
    count = blocks * samples
    if 2 * spread <= count + 3.0 * math.sqrt(count):  # three sigma of a fair coin
        return
    size = np.empty(blocks)
    every = 1 + blocks // TEXTURED_BLOCKS
    for b in range(0, blocks, every):
        before, after = max(b - 1, 0), min(b + 1, blocks - 1)
        slope = (level[after] - level[before]) / (block * max(after - before, 1))
        lowest = level[b] - slope * 0.5 * (block - 1)
        values = response[b * block : min((b + 1) * block, w)]
        _insert(size, b // every, _deviation(values, np.float32(lowest), np.float32(slope)))
    texture = 1.2533 * size[(blocks - 1) // every // 2]
    for b in range(blocks):
        margin[b] = max(margin[b], threshold * texture)


@njit(nogil=True, cache=True, error_model="numpy", fastmath={"reassoc"})
def _deviation(values: Float32, start: float, slope: float) -> float:
    """Mean distance of values (n,) from start + slope i, summed in any order."""
    total = np.float32(0.0)
    for i in range(values.shape[0]):
        total += abs(values[i] - start - slope * np.float32(i))
    return total / max(values.shape[0], 1)


@njit(nogil=True, cache=True, error_model="numpy")
def local_maxima(response: Float32, level: Array, margin: Array, at: NDArray[np.int32]) -> int:
    """Pixels where the response is a maximum and exceeds background + margin; returns how many.

    From the centre of one block to the next the bound is a straight line, and goes on beyond the outermost.
    """
    w, blocks = response.shape[0], level.shape[0]
    block = block_size(w)
    half, bound = block // 2, np.empty(blocks, np.float32)
    for b in range(blocks):
        bound[b] = level[b] + margin[b]
    rise = bound[1] - bound[0] if blocks > 1 else np.float32(0.0)
    before = bound[0] - np.float32(0.5) * rise
    found = _maxima_above(response, before, before + rise, 0, half, at, 0)
    b = 0
    while b < blocks - 1:
        several = block == BLOCK and b + 4 < blocks
        if several and not _any_of_four(response, bound, b):
            b += 4
            continue
        for _ in range(4 if several else 1):
            start = b * block + half
            found = _maxima_above(response, bound[b], bound[b + 1], start, start + block, at, found)
            b += 1
    rise = bound[b] - bound[b - 1] if blocks > 1 else np.float32(0.0)
    return _maxima_above(response, bound[b], bound[b] + rise, b * block + half, w, at, found)


@njit(nogil=True, cache=True, error_model="numpy")
def _any_of_four(response: Float32, bound: Float32, b: int) -> bool:
    """Whether a pixel from the centre of block b on exceeds the lower end of its bound, in any of four blocks.

    Without a branch, over a length known beforehand and with one sum for all: most stretches hold nothing.
    """
    a0, a1 = _low(bound[b], bound[b + 1]), _low(bound[b + 1], bound[b + 2])
    a2, a3 = _low(bound[b + 2], bound[b + 3]), _low(bound[b + 3], bound[b + 4])
    above, origin = np.int32(0), np.uint64(b * BLOCK + BLOCK // 2)
    for i in range(BLOCK):
        first = origin + np.uint64(i)
        above += np.int32(response[first] > a0) + np.int32(response[first + np.uint64(BLOCK)] > a1)
        above += np.int32(response[first + np.uint64(2 * BLOCK)] > a2)
        above += np.int32(response[first + np.uint64(3 * BLOCK)] > a3)
    return bool(above > 0)


@njit(nogil=True, cache=True, error_model="numpy")
def _maxima_above(
    response: Float32, low: float, high: float, start: int, stop: int, at: NDArray[np.int32], found: int
) -> int:
    """Maxima at pixels start..stop above a bound that goes from low to high in a block -> at; returns the new count."""
    w = response.shape[0]
    slope = (high - low) / np.float32(block_size(w))
    for i in range(start, stop):
        value = response[i]
        if value > low + slope * (np.float32(i - start) + np.float32(0.5)):
            before = response[i - 1] if i > 0 else np.float32(-np.inf)
            after = response[i + 1] if i < w - 1 else np.float32(-np.inf)
            if value >= before and value > after:
                at[found] = i
                found += 1
    return found
