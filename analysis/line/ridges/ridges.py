"""Lines anywhere in an image, of any direction and shape: points on ridges after Steger, strung into chains.

Steger, PAMI 20 (1998). Unlike a scan line's peaks these need no axis: a line may run along the rows, turn back or cross
another. Each point carries its normal, and a sigma along it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.line.detection.channel import MISSING, check_image, scan_lines
from analysis.line.detection.noise import NoiseModel
from analysis.line.estimate import estimate_noise
from analysis.line.methods.steger_2d import NARROWEST, WIDEST, fill_gaps
from analysis.line.result import Flag
from analysis.line.ridges.ridge_search import (
    COLUMNS,
    RADIUS,
    SMOOTH,
    TILE,
    RidgeSearch,
    candidates,
    chain_points,
    refine_ridges,
    smooth_columns,
    smooth_rows,
    tile_levels,
)
from analysis.line.settings import ExtractionSettings
from render.base.arrays import Float
from render.base.threads import map_chunks

ROWS = 128
"""At a time."""
LOOK = 3.5
"""Standard deviations above the background from which on a pixel is looked at."""
LOW = 0.5
"""Of the detection threshold: a line goes on down to it."""
SHORTEST = 8
"""Points; fewer are no line."""
PILOT = 2000
"""Points that tell how wide the lines are."""


@dataclass(frozen=True)
class Ridges:
    """Points on lines, (n,) each, chain by chain and in order along it. Lengths in px, light in electrons."""

    u: Float
    v: Float
    sigma_u: Float
    """Standard deviation along the normal; NaN where a pixel near is saturated or missing, or noise is smoothed."""
    normal: Float
    """(n, 2) unit vector across the line, in u and v."""
    width: Float
    """Gaussian sigma across the line."""
    amplitude: Float
    background: Float
    significance: Float
    """Of the curvature across the line, in standard deviations of its noise."""
    flag: NDArray[np.uint8]
    """OK or SATURATED."""
    chain: NDArray[np.int32]
    """Which line; 0 is the one with the most significant point."""

    @property
    def pixels(self) -> Float:
        """(n, 2)."""
        return np.column_stack((self.u, self.v))


def find_ridges(
    image: NDArray[Any],
    *,
    settings: ExtractionSettings | None = None,
    noise: NoiseModel | None = None,
    threads: int | None = None,
) -> Ridges:
    """Image (h, w) or (h, w, 3), uint8, uint16, float32 or float64 -> Ridges.

    Of the settings channel, pattern, threshold, width, max_width, smoothing and filter_scale count. Without a width the
    typical one of the image sets the filter. Raises InputError as `extract`.
    """
    chosen = (settings or ExtractionSettings()).model_copy(update={"axis": "rows"})
    array = check_image(image)
    if noise is None:
        noise = estimate_noise(array, chosen)
    lines = scan_lines(array, chosen, noise)
    signal, mask, floor = lines.read(0, lines.count)
    if (mask & MISSING).any():
        signal = fill_gaps(signal, mask)
    h, w = signal.shape
    level, spread = np.empty((-(-h // TILE), -(-w // TILE))), np.empty((-(-h // TILE), -(-w // TILE)))

    found = _candidates(signal, mask, floor, level, spread, threads)

    independent = chosen.smoothing == 0.0

    def points(pixels: NDArray[np.int32], sigma: float) -> tuple[Float, NDArray[np.uint8]]:
        least = LOW * chosen.threshold
        search = RidgeSearch(signal, mask, floor, level, spread, sigma, least, chosen.max_width, independent)
        return _refined(search, pixels, threads)

    width = chosen.width
    if width is None:
        pilot, _ = points(found[:: max(1, len(found) // PILOT)], max(NARROWEST, chosen.filter_scale))
        width = float(np.median(pilot[:, 5])) if len(pilot) else 1.0
    sigma = min(max(chosen.filter_scale * width, NARROWEST), WIDEST)
    table, flags = points(found, sigma)
    chain, order = np.full(len(table), -1, np.int32), np.zeros(len(table), np.int32)
    if len(table):
        chain_points(table, np.full((h, w), -1, np.int32), LOW * chosen.threshold, chosen.threshold, chain, order)
    return _strung(table, flags, chain, order, chosen.threshold)


def _candidates(
    signal: NDArray[np.float32],
    mask: NDArray[np.uint8],
    floor: NDArray[np.float32],
    level: Float,
    spread: Float,
    threads: int | None,
) -> NDArray[np.int32]:
    """(n, 2) pixels worth looking at, in raster order; fills level and spread, the tiles' background and noise."""
    h, w = signal.shape
    kernel = np.exp(-0.5 * (np.arange(RADIUS + 1) / SMOOTH) ** 2)
    kernel = (kernel / (2.0 * kernel.sum() - kernel[0])).astype(np.float32)
    gain = float(2.0 * (kernel.astype(np.float64) ** 2).sum() - float(kernel[0]) ** 2)  # of both directions together
    smooth = np.empty((h + 2, w), np.float32)  # a row more at either end
    parts: dict[int, NDArray[np.int32]] = {}

    def blur(start: int, stop: int) -> None:
        low, high = max(0, start - RADIUS), min(h, stop + RADIUS)
        rows = np.empty((high - low, w), np.float32)
        smooth_rows(signal[low:high], kernel, rows)
        smooth_columns(rows, kernel, start - low, stop - low, smooth[start + 1 : stop + 1])

    def tiles(start: int, stop: int) -> None:
        part = slice(start * TILE, min(stop * TILE, h))
        tile_levels(smooth[1:-1][part], mask[part], floor[part], gain, level[start:stop], spread[start:stop])

    def look(start: int, stop: int) -> None:
        room = np.empty(((stop - start) * w // 2 + 1, 2), np.int32)
        count = candidates(smooth[start : stop + 2], start, level, spread, LOOK * gain, room)
        parts[start] = room[:count].copy()

    map_chunks(blur, h, ROWS, threads)
    smooth[0], smooth[-1] = smooth[1], smooth[-2]
    map_chunks(tiles, len(level), 4, threads)
    map_chunks(look, h, ROWS, threads)
    return np.concatenate([parts[start] for start in sorted(parts)])


def _refined(search: RidgeSearch, pixels: NDArray[np.int32], threads: int | None) -> tuple[Float, NDArray[np.uint8]]:
    """Candidates (n, 2) -> points (m, 9) and flags (m,), one a pixel, in raster order."""
    out, flags = np.empty((len(pixels), COLUMNS)), np.empty(len(pixels), np.uint8)
    counts: dict[int, int] = {}

    def work(start: int, stop: int) -> None:
        part = slice(start, stop)
        counts[start] = refine_ridges(search, pixels[part], out[part], flags[part])

    chunk = 256
    map_chunks(work, len(pixels), chunk, threads)
    kept = [slice(start, start + counts[start]) for start in sorted(counts)]
    table = np.concatenate([out[one] for one in kept]) if kept else out[:0]
    marks = np.concatenate([flags[one] for one in kept]) if kept else flags[:0]
    return table, np.where(marks > 0, np.uint8(Flag.SATURATED), np.uint8(Flag.OK))


def _strung(
    table: Float, flags: NDArray[np.uint8], chain: NDArray[np.int32], order: NDArray[np.int32], threshold: float
) -> Ridges:
    """Points in the order of their chains; those too short or on the whole too weak left out, others numbered anew."""
    kept = np.nonzero(chain >= 0)[0]
    kept = kept[np.lexsort((order[kept], chain[kept]))]
    if len(kept):
        cuts = np.flatnonzero(np.diff(chain[kept])) + 1
        lines = np.split(kept, cuts)
        lines = [one for one in lines if len(one) >= SHORTEST and np.median(table[one, 8]) >= threshold]
        kept = np.concatenate(lines) if lines else kept[:0]
    t = table[kept]
    numbers = np.unique(chain[kept], return_inverse=True)[1].astype(np.int32)
    return Ridges(t[:, 0], t[:, 1], t[:, 2], t[:, 3:5], t[:, 5], t[:, 6], t[:, 7], t[:, 8], flags[kept], numbers)
