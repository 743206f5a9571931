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

from analysis.line.detection.channel import MISSING, SATURATED
from analysis.line.detection.detect import AMPLITUDE, BACKGROUND, CENTRE, PLATEAU, REACH, SLOPE, WIDTH
from analysis.line.methods.seed_loop import CORRELATION_LENGTH, Array, Mask, Options, Pixels, peak_kernel
from analysis.line.methods.window import ground, pixel_variance, write_peak
from analysis.line.result import Flag
from render.base.arrays import Float32

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
NEXT_TERM = 0.16
"""px^2 over the line's sigma squared: what the correction for straight lines between pixels leaves of itself."""
STEPS = 30
RIDGE, NORMAL_CENTROID = range(2)
"""Variants."""


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
def _refine(
    pixels: Pixels, y: int, seed: Array, spread: float, across: Array, along: Array
) -> tuple[float, int, float, float, float, int]:
    """Newton steps along the normal from the seed to the ridge, under a Gaussian of sigma `spread`.

    Returns its crossing with the scan line, the pixel that the taps are about, the derivative of n . grad r along the
    scan line, n, and NOT_CONVERGED, AT_BORDER, OUT_OF_WINDOW, ALONG_SCAN_LINE or OK.
    """
    m, w = pixels.signal.shape
    half = math.ceil(CUT * spread)
    taps(0.0, half, spread, along)
    r = np.empty(5)
    x, slope, nx, ny = seed[CENTRE], -1.0, 1.0, 0.0
    reach = 2.0 * spread + seed[WIDTH] + seed[PLATEAU] + 1.0
    middle = round(x)
    for _ in range(STEPS):
        middle = round(x)
        if min(x, w - 1 - x) < 2.0 * spread or min(y, m - 1 - y) < spread:
            return x, middle, slope, nx, ny, Flag.AT_BORDER.value
        taps(x - middle, half, spread, across)
        hessian(pixels.signal, seed[BACKGROUND], y, middle, half, across, along, r)
        r[0] -= seed[SLOPE]  # a slope's derivative is the same under any Gaussian, and it has no other
        value, nx, ny = normal(r)
        if value >= 0.0 or nx < STEEPEST:
            reason = Flag.ALONG_SCAN_LINE.value if value < 0.0 else Flag.NOT_CONVERGED.value
            return x, middle, slope, nx, ny, reason
        slope = value * nx
        move = -(nx * r[0] + ny * r[1]) / slope
        move = min(max(move, -spread), spread)
        x += move
        if abs(x - seed[CENTRE]) > reach:
            return x, middle, slope, nx, ny, Flag.OUT_OF_WINDOW.value
        if abs(move) < 1e-6:
            return x, middle, slope, nx, ny, Flag.OK.value
    return x, middle, slope, nx, ny, Flag.NOT_CONVERGED.value


@peak_kernel
def measure_ridge(pixels: Pixels, y: int, seed: Array, flag: int, options: Options, out: Array) -> int:
    """Peak kernel (`seed_loop`) of scan lines without gaps. options.variant: RIDGE or NORMAL_CENTROID.

    A sigma only where pixels are independent.
    """
    scale = 1.0 if options.variant == NORMAL_CENTROID else options.filter_scale
    spread = min(max(scale * seed[WIDTH], NARROWEST, 0.5 * seed[PLATEAU]), WIDEST)
    half = math.ceil(CUT * spread)
    across, along = np.empty((3, 2 * half + 1)), np.empty((3, 2 * half + 1))
    x, middle, slope, nx, ny, reason = _refine(pixels, y, seed, spread, across, along)
    if reason > Flag.SATURATED.value:
        return reason
    coarse = 0.0
    if options.variant == NORMAL_CENTROID:
        x, middle, weight, reason, coarse = _weigh_normal(pixels.signal, seed, y, x, nx, ny)
        if reason > Flag.SATURATED.value:
            return reason
    else:
        weight = np.empty((2 * half + 1, 2 * half + 1))
        for j in range(2 * half + 1):
            for i in range(2 * half + 1):
                weight[j, i] = (nx * across[1, i] * along[0, j] + ny * across[0, i] * along[1, j]) / slope
    sigma = np.nan
    if pixels.correlation.shape[0] == 1:
        sigma = math.hypot(weight_noise(pixels.signal, pixels.mask, pixels.floor, y, middle, weight), coarse)
        if pixels.covariances.shape[1] > 0:
            sigma = math.hypot(sigma, ridge_scintillation(pixels, seed, y, middle, weight))
        # rows err alike that see the same pixels: along the ridge, one row is 1 / nx px from the next
        alike = 2.0 * math.sqrt(math.pi) * spread * nx if options.variant == RIDGE else 1.0
        grain = pixels.scintillation[:, 0].sum() / pixels.covariances[0, 0] if pixels.covariances.shape[1] > 0 else 1.0
        out[CORRELATION_LENGTH] = max(alike, 2.0 * grain - 1.0, 1.0)
        if options.variant == RIDGE:
            sigma = math.hypot(sigma, _edge_error(min(y, pixels.signal.shape[0] - 1 - y) + 0.5, spread, ny / nx))
    write_peak(seed, x, sigma, out)
    return flag


@njit(nogil=True, cache=True, error_model="numpy")
def _edge_error(distance: float, spread: float, slope: float) -> float:
    """px that a slanted ridge is off where its filter reaches over the image's edge, whose row is repeated there.

    slope s_f (phi(z) - z Q(z)), z = distance / s_f: the mean of what the line would have gone on beyond the edge.
    """
    z = distance / spread
    beyond = math.exp(-0.5 * z * z) / math.sqrt(2.0 * math.pi) - 0.5 * z * math.erfc(z * math.sqrt(0.5))
    return abs(slope) * spread * beyond


@njit(nogil=True, cache=True, error_model="numpy")
def ridge_scintillation(pixels: Pixels, seed: Array, y: int, x: int, weight: Array) -> float:
    """As `weight_noise`, of the light's scintillation alone."""
    m, w = pixels.signal.shape
    table, half = pixels.scintillation, weight.shape[0] // 2
    moved = np.empty(weight.shape)
    for j in range(-half, half + 1):
        for i in range(-half, half + 1):
            light = pixels.signal[min(max(y + j, 0), m - 1), min(max(x + i, 0), w - 1)] - seed[BACKGROUND]
            moved[j + half, i + half] = weight[j + half, i + half] * max(light, 0.0)
    total, size = 0.0, weight.shape[0]
    for k in range(min(table.shape[0], size)):
        for d in range(min(table.shape[1], size)):
            shared = table[k, d] / (1.0 + table[k, d])  # as in `scintillation.shared_variance`
            pairs = 0.0
            for j in range(size - k):
                for i in range(size - d):
                    pairs += moved[j, i] * moved[j + k, i + d]
                    if k > 0 and d > 0:
                        pairs += moved[j + k, i] * moved[j, i + d]
            total += shared * pairs * (1.0 if k == 0 and d == 0 else 2.0)
    return math.sqrt(max(total, 0.0))


@njit(nogil=True, cache=True, error_model="numpy")
def _weigh_normal(
    signal: Float32, seed: Array, y: int, x: float, nx: float, ny: float
) -> tuple[float, int, Array, int, float]:
    """Centre of mass of bilinear samples 1 px apart along the normal through (x, y), moved until it rests.

    Returns the crossing with the scan line, the middle of weight (n, n) (pixels' influence on it), the reason, and how
    far the coarse grid may still have moved it, px.
    """
    m, w = signal.shape
    arm = max(1, math.ceil(min(WINDOW * seed[WIDTH] * nx + seed[PLATEAU], max(seed[REACH] * nx, 1.0), HALO - 2.0)))
    half = arm + 1
    weight = np.zeros((2 * half + 1, 2 * half + 1))
    total = 0.0
    reason = Flag.NOT_CONVERGED.value
    for _ in range(2 * STEPS):
        if x - arm * nx < 1.0 or x + arm * nx > w - 2.0 or y - arm * abs(ny) < 0.0 or y + arm * abs(ny) > m - 1.0:
            return x, round(x), weight, Flag.AT_BORDER.value, 0.0
        total, moment = 0.0, 0.0
        for j in range(-arm, arm + 1):
            value = _bilinear(signal, x + j * nx, y + j * ny) - ground(seed, x + j * nx)
            total += value
            moment += j * value
        if total <= 0.0:
            return x, round(x), weight, Flag.NOT_POSITIVE.value, 0.0
        move = moment / total
        if abs(move) > arm or abs(x + move / nx - seed[CENTRE]) > 2.0 * arm + 1.0:
            return x, round(x), weight, Flag.OUT_OF_WINDOW.value, 0.0
        x += move / nx
        if abs(move) < 1e-4:
            reason = Flag.OK.value
            break
    middle = round(x)
    start, square = x, (seed[WIDTH] * nx) ** 2
    for j in range(-arm, arm + 1):
        px, py = start + j * nx, y + j * ny
        ix, iy = math.floor(px), math.floor(py)
        tx, ty = px - ix, py - iy
        share = j / (total * nx)
        # a straight line between two pixels t (1 - t) / 2 I'' above the light: more on one side than on the other
        bend = seed[AMPLITUDE] * math.exp(-0.5 * j * j / square) * (j * j / square - 1.0) / square
        x -= share * 0.5 * (tx * (1.0 - tx) * nx * nx + ty * (1.0 - ty) * ny * ny) * bend
        a, b = iy - y + half, ix - middle + half
        for dy in range(2):
            for dx in range(2):
                part = (ty if dy else 1.0 - ty) * (tx if dx else 1.0 - tx)
                if 0 <= a + dy < 2 * half + 1 and 0 <= b + dx < 2 * half + 1:
                    weight[a + dy, b + dx] += share * part
    return x, middle, weight, reason, abs(start - x) * NEXT_TERM / square


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
def weight_noise(signal: Float32, mask: Mask, floor: Float32, y: int, x: int, weight: Array) -> float:
    """Standard deviation of a position that moves by weight[j, i] for one electron more in pixel (x + i, y + j).

    NaN where a pixel is saturated or missing: its noise is not that of a count.
    """
    m, w = signal.shape
    total, half = 0.0, weight.shape[0] // 2
    for j in range(-half, half + 1):
        b = min(max(y + j, 0), m - 1)
        for i in range(-half, half + 1):
            a = min(max(x + i, 0), w - 1)
            if mask[b, a] & (SATURATED | MISSING):
                return np.nan
            total += weight[j + half, i + half] ** 2 * pixel_variance(signal[b], floor[b], a)
    return math.sqrt(total)
