"""Kernels of the free search for ridges: what may be one, where exactly it is, and which points make a line.

background and noise   median and spread of every 32 x 32 tile, which a line across it does not move
may be a ridge         above that under a Gaussian of 1.5 px, no lower than both neighbours in two ways of four
exactly where          Newton along the normal on the continuous convolution (`ridge.hessian`), until it rests
which make a line      from the strongest on, to the neighbour whose distance and turn are least (Steger, 1998, 3.3)
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from analysis.line.detection.channel import MISSING, SATURATED
from analysis.line.methods.seed_loop import Array, Mask
from analysis.line.methods.steger_2d import CUT, hessian, normal, taps, weight_noise
from render.base.arrays import Float32, Int

TILE, EVERY = 32, 4
"""px; a side, and from sample to sample."""
SMOOTH, RADIUS = 1.5, 4
"""px; sigma and half length of the Gaussian that decides where to look."""
COLUMNS = 9
"""Of a point: u, v, sigma along the normal, normal_x, normal_y, width, amplitude, background, significance."""
STEPS = 12
REST = 1e-4
"""px."""
EIGENVALUE_GAIN = 3.0 / (16.0 * math.pi)
"""Variance of r_nn for white noise of unit variance, times sigma_f^6."""


class RidgeSearch(NamedTuple):
    """An image that is searched for ridges, and how."""

    signal: Float32
    """(h, w) electrons, without gaps."""
    mask: Mask
    floor: Float32
    """(h, w) or (h, 1) variance that does not come from the signal itself, e-^2."""
    level: Array
    """(rows, columns) background of the tiles, e-."""
    noise: Array
    """(rows, columns) standard deviation of a pixel in them, e-."""
    spread: float
    """sigma_f, px."""
    threshold: float
    """Least significance of the eigenvalue, in standard deviations of its noise."""
    max_width: float
    """px."""
    independent: bool
    """Whether pixels are, in their noise, so that a sigma can be reported."""


@njit(nogil=True, cache=True, error_model="numpy")
def tile_levels(smooth: Float32, mask: Mask, floor: Float32, gain: float, level: Array, noise: Array) -> None:
    """Smoothed (h, w) -> median of each tile (rows, columns), and the standard deviation of a pixel there.

    gain: standard deviation of the smoothed noise over that of a pixel. What is known of the noise is its least;
    texture and coarse quantisation show in the smoothed image alone.
    """
    h, w = smooth.shape
    some = np.empty((TILE // EVERY + 1) ** 2, np.float32)
    for ty in range(level.shape[0]):
        for tx in range(level.shape[1]):
            count, noise_variance = 0, 0.0
            for y in range(ty * TILE, min((ty + 1) * TILE, h), EVERY):
                for x in range(tx * TILE + (y // EVERY) % EVERY, min((tx + 1) * TILE, w), EVERY):
                    if mask[y, x] & MISSING == 0:
                        some[count] = smooth[y, x]
                        noise_variance += floor[y, min(x, floor.shape[1] - 1)]
                        count += 1
            if count == 0:
                level[ty, tx], noise[ty, tx] = np.nan, np.nan
                continue
            part = some[:count]
            part.sort()
            middle = part[count // 2]
            # half of the values lie within 0.6745 sigma; the lower half alone, since a line only adds
            spread = (middle - part[count // 4]) / (0.6745 * gain)
            known = max(middle, 0.0) + noise_variance / count
            level[ty, tx], noise[ty, tx] = middle, math.sqrt(max(known, spread * spread, 1e-2))


@njit(nogil=True, cache=True, error_model="numpy")
def smooth_rows(signal: Float32, kernel: Float32, out: Float32) -> None:
    """Gaussian along the rows, edges repeated."""
    h, w = signal.shape
    row = np.empty(w + 2 * RADIUS, np.float32)
    k0, k1, k2, k3, k4 = kernel[0], kernel[1], kernel[2], kernel[3], kernel[4]
    for y in range(h):
        row[RADIUS : RADIUS + w] = signal[y]
        row[:RADIUS], row[RADIUS + w :] = signal[y, 0], signal[y, w - 1]
        line = out[y]
        for i in range(w):
            line[i] = (
                k0 * row[i + 4]
                + k1 * (row[i + 3] + row[i + 5])
                + k2 * (row[i + 2] + row[i + 6])
                + k3 * (row[i + 1] + row[i + 7])
                + k4 * (row[i] + row[i + 8])
            )


@njit(nogil=True, cache=True, error_model="numpy")
def smooth_columns(rows: Float32, kernel: Float32, start: int, stop: int, out: Float32) -> None:
    """Gaussian along the columns of rows start..stop - 1 -> out (stop - start, w)."""
    h, w = rows.shape
    for y in range(start, stop):
        line, middle = out[y - start], rows[y]
        for i in range(w):
            line[i] = kernel[0] * middle[i]
        for j in range(1, RADIUS + 1):
            above, below, k = rows[max(y - j, 0)], rows[min(y + j, h - 1)], kernel[j]
            for i in range(w):
                line[i] += k * (above[i] + below[i])


@njit(nogil=True, cache=True, error_model="numpy")
def candidates(smooth: Float32, first: int, level: Array, noise: Array, threshold_sigma: float, found: Int) -> int:
    """Rows first.. of the smoothed image (m + 2, w), one more on either side -> (n, 2) pixels that may be on a ridge.

    threshold_sigma: above the background, in standard deviations of a pixel. Returns n, at most len(found).
    """
    m, w = smooth.shape
    count, tiles = 0, level.shape[1]
    for j in range(1, m - 1):
        ty = min((first + j - 1) // TILE, level.shape[0] - 1)
        row, above, below = smooth[j], smooth[j - 1], smooth[j + 1]
        for tx in range(tiles):
            bound = np.float32(level[ty, tx] + threshold_sigma * noise[ty, tx])
            start, stop = max(tx * TILE, 1), min((tx + 1) * TILE, w - 1)
            if tx == tiles - 1:
                stop = w - 1
            over = np.int32(0)
            for i in range(start, stop):
                over += np.int32(row[np.uint64(i)] > bound)
            if over == 0:
                continue
            for i in range(start, stop):
                v = row[i]
                if not v > bound:
                    continue
                ways = np.int32(v >= row[i - 1] and v >= row[i + 1]) + np.int32(v >= above[i] and v >= below[i])
                ways += np.int32(v >= above[i - 1] and v >= below[i + 1])
                ways += np.int32(v >= above[i + 1] and v >= below[i - 1])
                if ways >= 2:  # of four; a ridge's pixel is the highest across it and along both diagonals
                    if count == found.shape[0]:
                        return count
                    found[count, 0], found[count, 1] = i, first + j - 1
                    count += 1
    return count


@njit(nogil=True, cache=True, error_model="numpy")
def between(table: Array, u: float, v: float) -> float:
    """Value of a table of tiles at a pixel, bilinear between their centres; of the nearest tile where one is empty."""
    x = min(max((u + 0.5) / TILE - 0.5, 0.0), table.shape[1] - 1.0)
    y = min(max((v + 0.5) / TILE - 0.5, 0.0), table.shape[0] - 1.0)
    ix, iy = min(int(x), max(table.shape[1] - 2, 0)), min(int(y), max(table.shape[0] - 2, 0))
    jx, jy = min(ix + 1, table.shape[1] - 1), min(iy + 1, table.shape[0] - 1)
    tx, ty = x - ix, y - iy
    upper = (1.0 - tx) * table[iy, ix] + tx * table[iy, jx]
    lower = (1.0 - tx) * table[jy, ix] + tx * table[jy, jx]
    value = (1.0 - ty) * upper + ty * lower
    return value if not math.isnan(value) else table[int(y + 0.5), int(x + 0.5)]


@njit(nogil=True, cache=True, error_model="numpy")
def _newton(
    search: RidgeSearch, u0: int, v0: int, base: float, least: float, across: Array, along: Array
) -> tuple[float, float, int, int, float, float, float]:
    """Newton steps along the normal from a pixel -> u, v on the ridge, pixel of the taps, eigenvalue, normal.

    The eigenvalue is 0 where there is no such point: it is above -least, or the steps do not rest within a pixel.
    across, along (3, n): the taps at the point.
    """
    h, w = search.signal.shape
    half, edge = across.shape[1] // 2, 2.0 * search.spread
    r, u, v, x, y = np.empty(5), float(u0), float(v0), u0, v0
    for _ in range(STEPS):
        if min(u, w - 1 - u) < edge or min(v, h - 1 - v) < edge:
            break
        x, y = round(u), round(v)
        taps(u - x, half, search.spread, across)
        taps(v - y, half, search.spread, along)
        hessian(search.signal, base, y, x, half, across, along, r)
        value, nx, ny = normal(r)
        if not value < -least:
            break
        move = -(nx * r[0] + ny * r[1]) / value
        move = min(max(move, -1.0), 1.0)
        u += move * nx
        v += move * ny
        if max(abs(u - u0), abs(v - v0)) > 1.0:
            break
        if abs(move) < REST:
            return u, v, x, y, value, nx, ny
    return u, v, x, y, 0.0, 1.0, 0.0


@njit(nogil=True, cache=True, error_model="numpy")
def refine_ridges(search: RidgeSearch, found: Int, out: Array, flags: Mask) -> int:
    """Candidates (n, 2) -> points (m, 9) on ridges, and whether they are saturated; returns m.

    A point further than a pixel from its candidate belongs to another one.
    """
    spread = search.spread
    half = math.ceil(CUT * spread)
    across, along = np.zeros((3, 2 * half + 1)), np.zeros((3, 2 * half + 1))
    weight = np.zeros((2 * half + 1, 2 * half + 1))
    eigen_noise = math.sqrt(EIGENVALUE_GAIN) / spread**3
    count = 0
    for k in range(found.shape[0]):
        u0, v0 = int(found[k, 0]), int(found[k, 1])
        base, sigma = between(search.level, u0, v0), between(search.noise, u0, v0)
        least = search.threshold * eigen_noise * sigma
        u, v, x, y, value, nx, ny = _newton(search, u0, v0, base, least, across, along)
        if value == 0.0:
            continue
        total = height(search.signal, base, y, x, half, across, along)
        wide = -total / value  # of a Gaussian line: sigma^2 + sigma_f^2
        square = wide - spread * spread
        if total <= 0.0 or square > search.max_width * search.max_width:
            continue
        width = math.sqrt(max(square, 0.09))
        point = out[count]
        point[0], point[1], point[2], point[3], point[4] = u, v, np.nan, nx, ny
        point[5], point[6], point[7] = width, total * math.sqrt(wide) / width, base
        point[8] = -value / (eigen_noise * sigma)
        flags[count] = search.mask[y, x] & SATURATED
        if search.independent:
            for j in range(2 * half + 1):
                for i in range(2 * half + 1):
                    weight[j, i] = (nx * across[1, i] * along[0, j] + ny * across[0, i] * along[1, j]) / value
            point[2] = weight_noise(search.signal, search.mask, search.floor, y, x, weight)
        count += 1
    return count


@njit(nogil=True, cache=True, error_model="numpy")
def height(signal: Float32, base: float, y: int, x: int, half: int, across: Array, along: Array) -> float:
    """The smoothed image above the background."""
    n, w = signal.shape
    total = 0.0
    for j in range(-half, half + 1):
        line, part = signal[min(max(y + j, 0), n - 1)], 0.0
        for i in range(-half, half + 1):
            part += (line[min(max(x + i, 0), w - 1)] - base) * across[0, i + half]
        total += part * along[0, j + half]
    return total


@njit(nogil=True, cache=True, error_model="numpy")
def chain_points(points: Array, place: Int, low: float, high: float, chain: Int, order: Int) -> int:
    """Points (n, 9) in raster order -> chain (n,) of each, -1 for none, and its place in it; returns their number.

    place (h, w) is filled with -1. A chain begins at a significance of `high` and goes on while it is above `low`.
    """
    n = points.shape[0]
    h, w = place.shape
    for k in range(n):
        x, y = round(points[k, 0]), round(points[k, 1])
        if place[y, x] < 0:
            place[y, x] = k
        chain[k] = -1
    chains = 0
    for start in np.argsort(-points[:, 8]):
        x, y = round(points[start, 0]), round(points[start, 1])
        if points[start, 8] < high:
            break
        if chain[start] >= 0 or place[y, x] != start:
            continue
        chain[start], order[start] = chains, 0
        for way in (1, -1):
            here, number = start, 0
            tx, ty = -way * points[start, 4], way * points[start, 3]
            while True:
                x, y = round(points[here, 0]), round(points[here, 1])
                best, least = -1, np.inf
                for dy in range(-2, 3):
                    for dx in range(-2, 3):
                        if (dx == 0 and dy == 0) or not (0 <= x + dx < w and 0 <= y + dy < h):
                            continue
                        k = place[y + dy, x + dx]
                        if k < 0 or chain[k] >= 0 or points[k, 8] < low:
                            continue
                        gx, gy = points[k, 0] - points[here, 0], points[k, 1] - points[here, 1]
                        ahead = gx * tx + gy * ty
                        aside = abs(gx * ty - gy * tx)
                        if ahead <= 0.3 or aside > ahead:
                            continue
                        turn = math.acos(min(abs(points[k, 3] * ty - points[k, 4] * tx), 1.0))
                        cost = math.hypot(gx, gy) + turn + aside
                        if cost < least:
                            best, least = k, cost
                if best < 0:
                    break
                number += 1
                chain[best], order[best] = chains, way * number
                kx, ky = -points[best, 4], points[best, 3]
                sign = 1.0 if kx * tx + ky * ty >= 0.0 else -1.0
                tx, ty, here = sign * kx, sign * ky, best
        chains += 1
    return chains
