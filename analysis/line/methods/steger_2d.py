"""The ridge of a line in two dimensions: Steger's detector, and the centre of mass along the normal it gives.

    r(x, y)  the image under a Gaussian of sigma_f,  H n = lambda n  with the most negative lambda,  n . grad r = 0

Steger, PAMI 20 (1998), section 3. The point reported is where the ridge crosses the scan line, found by Newton steps of
n . grad r / (lambda n_x) on the continuous convolution. Smoothing along the line lowers the noise, ties the scan lines
together over about 3 sigma_f, and cuts corners: sigma_f^2 / 2R on an arc, 0.8 m sigma_f at a corner of slope m.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from analysis.line.detection.channel import MISSING, SATURATED
from analysis.line.detection.detect import BACKGROUND, CENTRE, PLATEAU, REACH, WIDTH
from analysis.line.methods.window import write_peak
from analysis.line.result import Flag

Float32 = NDArray[np.float32]
Array = NDArray[np.float64]
Mask = NDArray[np.uint8]

WIDEST = 6.0
"""px; the filter's largest sigma, which decides how many scan lines beyond a chunk are read."""
CUT = 4.0
HALO = math.ceil(WIDEST * CUT) + 1
"""Scan lines read on either side of a chunk."""
NARROWEST = 1.2
"""px; the filter's least sigma: between the pixels a narrower one sees them one by one."""
STEEPEST = 0.17
"""Least |n_x|: a line within 10 degrees of the scan line has no crossing worth the name."""
WINDOW = 3.0
"""Half window of the centre of mass along the normal, in sigmas across the line."""
STEPS = 30

_OK, _SATURATED, _AT_BORDER = int(Flag.OK), int(Flag.SATURATED), int(Flag.AT_BORDER)
_NOT_CONVERGED, _OUT_OF_WINDOW, _NOT_POSITIVE = int(Flag.NOT_CONVERGED), int(Flag.OUT_OF_WINDOW), int(Flag.NOT_POSITIVE)
_ALONG = int(Flag.ALONG_SCAN_LINE)


@njit(nogil=True, cache=True, error_model="numpy")
def fill_gaps(signal: Float32, mask: Mask) -> Float32:
    """(n, w) with missing pixels linear along the scan line, and whole missing lines as their neighbours' mean."""
    n, w = signal.shape
    filled = signal.copy()
    empty = np.zeros(n, np.uint8)
    for y in range(n):
        last = -1
        for i in range(w):
            if mask[y, i] & MISSING == 0:
                if last < i - 1:
                    left = signal[y, last] if last >= 0 else signal[y, i]
                    for j in range(last + 1, i):
                        filled[y, j] = left + (signal[y, i] - left) * np.float32((j - last) / (i - last))
                last = i
        if last < 0:
            empty[y] = 1
        for j in range(last + 1, w):
            filled[y, j] = signal[y, last]
    for y in range(n):
        if empty[y]:
            above = max(y - 1, 0) if y > 0 and not empty[y - 1] else min(y + 1, n - 1)
            below = y + 1 if y + 1 < n and not empty[y + 1] else above
            for i in range(w):
                filled[y, i] = np.float32(0.5) * (filled[above, i] + filled[below, i])
    return filled


@njit(nogil=True, cache=True, error_model="numpy")
def taps(offset: float, half: int, spread: float, taps: Array) -> None:
    """Gaussian, its first and second derivative at offset - j, j = -half..half -> taps (3, 2 half + 1)."""
    inverse = 1.0 / (spread * spread)
    norm = 1.0 / (spread * math.sqrt(2.0 * math.pi))
    for j in range(-half, half + 1):
        d = offset - j
        g = norm * math.exp(-0.5 * d * d * inverse)
        taps[0, j + half] = g
        taps[1, j + half] = -d * inverse * g
        taps[2, j + half] = (d * d * inverse - 1.0) * inverse * g


@njit(nogil=True, cache=True, error_model="numpy")
def hessian(signal: Float32, base: float, y: int, x: int, half: int, across: Array, along: Array, r: Array) -> None:
    """r (5,) = r_x, r_y, r_xx, r_xy, r_yy from taps across (along x) and along (along y), edges repeated."""
    n, w = signal.shape
    for j in range(5):
        r[j] = 0.0
    for j in range(-half, half + 1):
        line = signal[min(max(y + j, 0), n - 1)]
        s0 = s1 = s2 = 0.0
        for i in range(-half, half + 1):
            value = line[min(max(x + i, 0), w - 1)] - base
            s0 += value * across[0, i + half]
            s1 += value * across[1, i + half]
            s2 += value * across[2, i + half]
        g0, g1, g2 = along[0, j + half], along[1, j + half], along[2, j + half]
        r[0] += s1 * g0
        r[1] += s0 * g1
        r[2] += s2 * g0
        r[3] += s1 * g1
        r[4] += s0 * g2


@njit(nogil=True, cache=True, error_model="numpy")
def normal(r: Array) -> tuple[float, float, float]:
    """Eigenvalue of the Hessian that is most negative, and its unit vector (n_x, n_y) with n_x >= 0."""
    half_sum, half_gap = 0.5 * (r[2] + r[4]), 0.5 * (r[2] - r[4])
    root = math.hypot(half_gap, r[3])
    # of two ways to write the vector, the one without cancellation
    a, b = (half_gap - root, r[3]) if half_gap < 0.0 else (r[3], -half_gap - root)
    length = math.hypot(a, b)
    if length == 0.0:
        return half_sum - root, 1.0, 0.0
    sign = -1.0 if a < 0.0 else 1.0
    return half_sum - root, sign * a / length, sign * b / length


@njit(nogil=True, cache=True, error_model="numpy")
def ridge_seeds(  # noqa: PLR0913
    signal: Float32,
    raw: Float32,
    mask: Mask,
    floor: Float32,
    offset: int,
    seeds: Array,
    flags: Mask,
    scale: float,
    mass: bool,
    independent: bool,
    out: Array,
) -> None:
    """Filled scan lines (m, w) with those before smoothing, and seeds (n, k, 6) of lines offset.. -> out (n, k, 6).

    scale: sigma_f over the seed's sigma. mass: go on with the centre of mass along the normal. independent: pixels
    are, in their noise, so that a sigma can be claimed.
    """
    m, w = signal.shape
    size = 2 * HALO + 1
    across, along, weight = np.zeros((3, size)), np.zeros((3, size)), np.zeros((size, size))
    r = np.empty(5)
    for row in range(seeds.shape[0]):
        y = row + offset
        for k in range(seeds.shape[1]):
            for j in range(6):
                out[row, k, j] = np.nan
            if flags[row, k] > _SATURATED:
                continue
            seed = seeds[row, k]
            spread = min(max(scale * seed[WIDTH], NARROWEST, 0.5 * seed[PLATEAU]), WIDEST)
            half = math.ceil(CUT * spread)
            taps(0.0, half, spread, along)
            x, reason, slope, nx, ny = seed[CENTRE], _NOT_CONVERGED, -1.0, 1.0, 0.0
            reach = 2.0 * spread + seed[WIDTH] + seed[PLATEAU] + 1.0
            middle = round(x)
            for _ in range(STEPS):
                middle = round(x)
                if min(x, w - 1 - x) < 2.0 * spread or min(y, m - 1 - y) < spread:
                    reason = _AT_BORDER
                    break
                taps(x - middle, half, spread, across)
                hessian(signal, seed[BACKGROUND], y, middle, half, across, along, r)
                value, nx, ny = normal(r)
                if value >= 0.0 or nx < STEEPEST:
                    reason = _ALONG if value < 0.0 else _NOT_CONVERGED
                    break
                slope = value * nx
                move = -(nx * r[0] + ny * r[1]) / slope
                move = min(max(move, -spread), spread)
                x += move
                if abs(x - seed[CENTRE]) > reach:
                    reason = _OUT_OF_WINDOW
                    break
                if abs(move) < 1e-6:
                    reason = flags[row, k]
                    break
            if reason <= _SATURATED:
                for j in range(-half, half + 1):
                    for i in range(-half, half + 1):
                        g = (
                            nx * across[1, i + half] * along[0, j + half]
                            + ny * across[0, i + half] * along[1, j + half]
                        )
                        weight[j + half, i + half] = g / slope
                if mass:
                    x, middle, half, reason = _weigh_normal(signal, seed, y, x, nx, ny, reason, weight)
            flags[row, k] = reason
            if reason > _SATURATED:
                continue
            sigma = weight_noise(raw, mask, floor, y, middle, half, weight) if independent else np.nan
            write_peak(seed, x, sigma, out[row, k])


@njit(nogil=True, cache=True, error_model="numpy")
def _weigh_normal(
    signal: Float32, seed: Array, y: int, x: float, nx: float, ny: float, reason: int, weight: Array
) -> tuple[float, int, int, int]:
    """Centre of mass of bilinear samples 1 px apart along the normal through (x, y), moved until it rests.

    Returns the crossing with the scan line, the middle and half size of weight (pixels' influence on it), the reason.
    """
    m, w = signal.shape
    arm = max(1, math.ceil(min(WINDOW * seed[WIDTH] * nx + seed[PLATEAU], max(seed[REACH] * nx, 1.0), HALO - 2.0)))
    half = arm + 1
    total = 0.0
    outcome = _NOT_CONVERGED
    for _ in range(2 * STEPS):
        if x - arm * nx < 1.0 or x + arm * nx > w - 2.0 or y - arm * abs(ny) < 0.0 or y + arm * abs(ny) > m - 1.0:
            return x, round(x), half, _AT_BORDER
        total, moment = 0.0, 0.0
        for j in range(-arm, arm + 1):
            value = _bilinear(signal, x + j * nx, y + j * ny) - seed[BACKGROUND]
            total += value
            moment += j * value
        if total <= 0.0:
            return x, round(x), half, _NOT_POSITIVE
        move = moment / total
        if abs(move) > arm or abs(x + move / nx - seed[CENTRE]) > 2.0 * arm + 1.0:
            return x, round(x), half, _OUT_OF_WINDOW
        x += move / nx
        if abs(move) < 1e-4:
            outcome = reason
            break
    middle = round(x)
    for j in range(2 * half + 1):
        for i in range(2 * half + 1):
            weight[j, i] = 0.0
    start = x
    for j in range(-arm, arm + 1):
        px, py = start + j * nx, y + j * ny
        ix, iy = math.floor(px), math.floor(py)
        tx, ty = px - ix, py - iy
        share = j / (total * nx)
        a, b = iy - y + half, ix - middle + half
        for dy in range(2):
            for dx in range(2):
                part = (ty if dy else 1.0 - ty) * (tx if dx else 1.0 - tx)
                if 0 <= a + dy < 2 * half + 1 and 0 <= b + dx < 2 * half + 1:
                    weight[a + dy, b + dx] += share * part
    return x, middle, half, outcome


@njit(nogil=True, cache=True, error_model="numpy")
def _bilinear(signal: Float32, x: float, y: float) -> float:
    m, w = signal.shape
    ix, iy = min(max(math.floor(x), 0), w - 2), min(max(math.floor(y), 0), max(m - 2, 0))
    tx, ty = x - ix, y - iy
    below = min(iy + 1, m - 1)
    upper = (1.0 - tx) * signal[iy, ix] + tx * signal[iy, ix + 1]
    lower = (1.0 - tx) * signal[below, ix] + tx * signal[below, ix + 1]
    return float((1.0 - ty) * upper + ty * lower)


@njit(nogil=True, cache=True, error_model="numpy")
def weight_noise(raw: Float32, mask: Mask, floor: Float32, y: int, x: int, half: int, weight: Array) -> float:
    """Standard deviation of a position that moves by weight[j, i] for one electron more in pixel (x + i, y + j).

    NaN where a pixel is saturated or missing: its noise is not that of a count.
    """
    m, w = raw.shape
    total = 0.0
    for j in range(-half, half + 1):
        b = min(max(y + j, 0), m - 1)
        for i in range(-half, half + 1):
            a = min(max(x + i, 0), w - 1)
            if mask[b, a] & (SATURATED | MISSING):
                return np.nan
            still = float(floor[b, min(a, floor.shape[1] - 1)])
            total += weight[j + half, i + half] ** 2 * max(raw[b, a] + still, 0.1 * abs(still))
    return math.sqrt(total)
