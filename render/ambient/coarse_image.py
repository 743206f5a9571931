"""The ambient light where nothing is measured: few pixels sampled, the others interpolated, and the error of that.

Some pixels, drawn by chance, are held out: they are sampled as well, but nothing is made of them. Where I is the image
and a, b the two halves of such a pixel's samples, which know nothing of each other or of I,

    E[(I - a)(I - b)] = (I - L)^2,     E[a b] = L^2

so that the mean over them is the squared error of the image, of noise and of interpolation together, and without the
noise of the held-out pixels themselves. Where noise is most of it the points of the grid get more samples, those of
large deviation most, otherwise the grid gets finer; in the end every pixel is sampled.

Held-out pixels are too few to tell where the error is. That is told by the points of the grid, each held out in turn
and predicted by its neighbours, from twice as far as any pixel has to be, so that it is rather too much.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.ndimage import uniform_filter

from render.ambient.guided_image import LightGrid, Places, guided_image, places_of
from render.ambient.guided_interpolation import (
    ON_EDGE,
    SEEN,
    grid_of,
    predict_by_neighbours,
    seen_at,
    smooth_grid,
)
from render.ambient.integrator import EVEN_SHARE, MOST_SHARE
from render.ambient.path_tracer import CameraPaths
from render.ambient.pixel_samples import PixelSamples
from render.base.arrays import Bool, Float, Float32, Int
from render.base.threads import map_chunks
from render.run import Run

COARSE_ERROR = 0.05
"""Relative RMS error that is enough where no error matters to what is measured: peaks are found there against the noise
of the sensor, of which a twentieth more or less of the ambient light changes a fortieth."""
BLOCK = 8
"""Pixels between two points of the grid, at first."""
FIRST_SAMPLES, HELD_OUT_SAMPLES = 2, 4
"""Of each half, of a point of the grid at first and of a held-out pixel."""
HELD_OUT, HELD_OUT_SHARE = 8192, 16
"""Most held-out pixels, and pixels of the image for each at least."""
HELD_OUT_SEED = 32_452_843
LOOKS = 1 << 13
"""Pixels that a thread looks at, at a time."""
TILE = 32
"""Pixels a side of the tiles whose error is told by itself, together with those about it: a multiple of BLOCK."""


@dataclass(frozen=True)
class CoarseImage:
    """Ambient light that is known as well as it takes to find lines."""

    radiance: Float32
    """(h, w, 3) W/(m^2 sr) in R, G, B."""
    error: float
    """Estimated relative RMS error, over all pixels."""
    deviation: Float32
    """(tiles down, tiles across) RMS error of the pixels in each tile, W/(m^2 sr), on the high side."""
    block: int
    """Pixels between two that were sampled; 1: all were."""
    samples: int
    """That it took."""
    dropped: int
    clamped: int
    cut: float
    """As in `AmbientImage`."""
    grid: LightGrid | None = None
    """That it was interpolated from; None: it was not."""
    taken_over: bool = False
    """It is that of another frame, which was checked as a whole alone: of a single place nothing is known for sure."""


@dataclass(frozen=True)
class SeenGrid:
    """The points of a grid, and what is seen there."""

    pixels: Int
    """(n,) of the image."""
    across: int
    block: int
    """Pixels from point to point."""
    seen: Float32
    item: Int
    """As `seen_at` gives them."""
    on_edge: Bool
    """(n,) another object is seen beside the point."""


def coarse_image(paths: CameraPaths, height: int, most: int, run: Run, target: float = COARSE_ERROR) -> CoarseImage:
    """Sampled until the error is at most `target`, or `most` samples are spent. Raises Cancelled.

    The image depends on the scene and the seed alone.
    """
    width = paths.view.width
    held, block, count = _held_out(width * height, run), BLOCK, FIRST_SAMPLES
    film = PixelSamples(held)
    film.add(paths, held, np.full((len(held), 2), HELD_OUT_SAMPLES, np.int32), run.between(0.0, 0.1))
    while True:
        seen = seen_grid(paths, height, block, run.threads)
        grid, across = seen.pixels, seen.across
        part = run.between(0.1, 0.5)
        film.extend(grid)
        for level in range(1, FIRST_SAMPLES + 1):
            film.add(paths, grid, np.full((len(grid), 2), level, np.int32), part)
        if count > FIRST_SAMPLES:
            film.add(paths, grid, np.maximum(FIRST_SAMPLES, np.rint(count * _shares(film, grid, across))), part)
        error, noise = _errors(film, paths, height, seen, held, run.threads)
        noisy = 2.0 * noise**2 > error**2 or block == 1
        needed = 2 * count * len(grid) if noisy else 3 * 2 * FIRST_SAMPLES * len(grid)
        if error <= target or film.total + max(needed, _least(error / target, needed, noisy)) > most:
            break
        count, block = (2 * count, block) if noisy else (count, block // 2)
    radiance, known = _image(film, paths, height, seen, run.between(0.5, 1.0))
    dropped, clamped = film.invalid_counts.astype(int).tolist()
    deviation = _deviation(film, seen)
    return CoarseImage(radiance, error, deviation, block, film.total, dropped, clamped, film.cut / film.total, known)


def _least(beyond: float, next_step: int, noisy: bool) -> float:
    """Samples that it takes at least until an error so many times too large is small enough, where the next step takes
    some: noise falls with the root of the samples, interpolation with the square of the spacing at best.

    What is out of reach is not tried: pixels whose error matters to a line are sampled by themselves.
    """
    if noisy:
        return next_step * (2.0 ** math.ceil(2.0 * math.log2(beyond)) - 1.0)
    # each grid has four times the points of the one before, three in four of them new
    return next_step * (4.0 ** math.ceil(math.log(beyond, 4.0)) - 1.0) / 3.0


def _held_out(pixels: int, run: Run) -> Int:
    """Some pixels, one by chance of each of equal parts of the image."""
    count = min(HELD_OUT, -(-pixels // HELD_OUT_SHARE))
    random = np.random.default_rng(run.shifted(HELD_OUT_SEED).seed)
    edges = np.linspace(0, pixels, count + 1).astype(np.int64)
    return random.integers(edges[:-1], edges[1:]).astype(np.int32)


def _shares(film: PixelSamples, grid: Int, across: int) -> Float:
    """(n, 2) samples of each half on the points of a grid over their mean, by the deviation in the other half."""
    variance = film.spread[film.place(grid)].mean(axis=2).reshape(-1, across, 2)
    deviation = np.sqrt(means_about(variance, (3, 3, 0), "nearest")).reshape(-1, 2)[:, ::-1]
    mean = deviation.mean(axis=0)
    relative = np.where(mean > 0.0, deviation / np.where(mean > 0.0, mean, 1.0), 1.0)
    return np.asarray(EVEN_SHARE + (1.0 - EVEN_SHARE) * np.minimum(relative, MOST_SHARE), dtype=np.float64)


def _errors(
    film: PixelSamples, paths: CameraPaths, height: int, grid: SeenGrid, held: Int, threads: int | None
) -> tuple[float, float]:
    """Relative RMS error of the image, and what of it is noise."""
    held = np.setdiff1d(held, grid.pixels).astype(np.int32)
    if not len(held):
        sampled = film.means(grid.pixels).astype(np.float64)
        power, square = (
            float(np.sum(sampled[:, 0] * sampled[:, 1])),
            float(np.sum((sampled[:, 0] - sampled[:, 1]) ** 2)),
        )
        noise = math.sqrt(square / 4.0 / power) if power > 0.0 else 0.0
        return noise, noise
    truth = film.means(held).astype(np.float64)
    apart = _light_grid(film, paths, height, grid, apart=True)
    halves = radiance_at(apart, paths, held, own_places(paths), threads).reshape(-1, 2, 3)
    image = halves.mean(axis=1)
    power = float(np.sum(truth[:, 0] * truth[:, 1]))
    if power <= 0.0:
        return 0.0, 0.0
    square = float(np.sum((image - truth[:, 0]) * (image - truth[:, 1]))) / power
    variance = float(np.sum((halves[:, 0] - halves[:, 1]) ** 2)) / 4.0 / power
    # of rare bright paths the held-out pixels may have caught none: the error is no less than the noise of the image
    return math.sqrt(max(square, variance)), math.sqrt(variance)


def _deviation(film: PixelSamples, grid: SeenGrid) -> Float32:
    """(tiles down, tiles across) RMS error of the image in each tile."""
    halves = film.means(grid.pixels).reshape(-1, grid.across, 2, 3)
    # the least that it may be: the noise of a mean of four
    noise = np.square(halves[:, :, 0] - halves[:, :, 1]).mean(axis=2) / 16.0
    if grid.block == 1:
        square = 4.0 * noise
    else:
        predicted = np.empty((len(grid.pixels), 3), np.float32)
        predict_by_neighbours(grid.across, grid.seen, grid.item, halves.mean(axis=2).reshape(-1, 3), predicted)
        off = predicted.reshape(-1, grid.across, 1, 3) - halves
        square = (off[:, :, 0] * off[:, :, 1]).mean(axis=2)
    points = TILE // grid.block
    square, noise = (_tile_means(values, points) for values in (square, noise))
    return np.sqrt(np.maximum(square, noise)).astype(np.float32)


def _tile_means(values: Float32, points: int) -> Float32:
    """(h, w) -> (tiles down, tiles across) means over tiles of points a side and the eight about each."""
    ends = [(0, -len(values) % points), (0, -values.shape[1] % points)]
    tiles = [-(-side // points) for side in values.shape]

    def sums(of: Float32) -> Float32:
        parts = np.pad(of, ends).reshape(tiles[0], points, tiles[1], points).sum(axis=(1, 3))
        return means_about(parts, (3, 3), "constant")

    return np.asarray(sums(values) / sums(np.ones_like(values)), np.float32)


def means_about(values: Float32, size: tuple[int, ...], beyond: Literal["nearest", "constant"]) -> Float32:
    """Means of squares over windows of `size`; beyond the edge: as at the edge, or zero.

    Never negative: the filter's running sum leaves a rest of either sign where zeros follow large values.
    """
    return np.maximum(uniform_filter(values, size, mode=beyond), np.float32(0.0))


def seen_grid(paths: CameraPaths, height: int, block: int, threads: int | None) -> SeenGrid:
    """The points of a grid, with what is seen there where it is interpolated: with more than a pixel between them."""
    pixels, across = grid_of(paths.view.width, height, block)
    if block == 1:
        nothing = np.zeros(0, np.int32)
        return SeenGrid(pixels, across, block, np.zeros((0, SEEN), np.float32), nothing, nothing != 0)
    seen, item = _seen(paths, pixels, threads)
    return SeenGrid(pixels, across, block, seen, item, _on_edge(pixels, item, paths, height, threads))


def _seen(paths: CameraPaths, pixels: Int, threads: int | None) -> tuple[Float32, Int]:
    """As `seen_at`, on threads."""
    seen, item = np.empty((len(pixels), SEEN), np.float32), np.empty(len(pixels), np.int32)

    def look(start: int, stop: int) -> None:
        found = seen_at(pixels[start:stop], paths.view, paths.surface, paths.lights, paths.rays)
        seen[start:stop], item[start:stop] = found

    map_chunks(look, len(pixels), LOOKS, threads)
    return seen, item


def _light_grid(film: PixelSamples, paths: CameraPaths, height: int, grid: SeenGrid, *, apart: bool) -> LightGrid:
    """The grid with its light, as of both halves together, or apart side by side (n, 6)."""
    item = np.where(grid.on_edge, np.int32(ON_EDGE), grid.item)
    halves = film.means(grid.pixels)
    radiance = halves.reshape(-1, 6) if apart else halves.mean(axis=1)
    light = np.empty_like(radiance)
    smooth_grid(grid.across, grid.seen, item, radiance, light)
    return LightGrid((height, paths.view.width), grid.block, grid.seen, item, light)


def _on_edge(pixels: Int, item: Int, paths: CameraPaths, height: int, threads: int | None) -> Bool:
    """(n,) another object is seen beside a point of the grid: its pixel holds light of both, and speaks for neither."""
    width, edge = paths.view.width, np.zeros(len(pixels), np.bool_)
    for down, right in ((-1, 0), (1, 0), (0, -1), (0, 1)):
        row = np.clip(pixels // width + down, 0, height - 1)
        beside = (row * width + np.clip(pixels % width + right, 0, width - 1)).astype(np.int32)
        edge |= _seen(paths, beside, threads)[1] != item
    return edge


def radiance_at(
    grid: LightGrid, paths: CameraPaths, pixels: Int, places: Places, threads: int | None = None
) -> Float32:
    """(n, c) radiance of some pixels as a grid, of their image or of another, has it."""
    out = np.empty((len(pixels), grid.light.shape[1]), np.float32)
    seen, item = _seen(paths, pixels, threads)
    grid.at(places(pixels, seen, item), seen, item, out)
    return out


def own_places(paths: CameraPaths) -> Places:
    return lambda pixels, seen, item: places_of(pixels, paths.view.width)


def _image(
    film: PixelSamples, paths: CameraPaths, height: int, grid: SeenGrid, run: Run
) -> tuple[Float32, LightGrid | None]:
    """(h, w, 3) radiance, and the grid that it is made of; None: every pixel was sampled. Raises Cancelled."""
    if grid.block == 1:
        return film.means(grid.pixels).mean(axis=1).reshape(height, paths.view.width, 3), None
    known = _light_grid(film, paths, height, grid, apart=False)
    return guided_image(known, paths, height, own_places(paths), run), known
