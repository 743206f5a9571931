"""Ambient light of an image: samples where the variance is, until the error or the number of samples is reached.

The samples of a pixel are two halves that know nothing of each other: half their difference is an honest estimate of
the error of their mean. The first samples of one half say how many more each tile of the other gets, once and for all,
so that how often a place is sampled never depends on the values that are averaged there: the image is unbiased.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numba
import numpy as np
from numpy.typing import NDArray

from render.ambient import path_kernels
from render.ambient.path_state import CLAMPED, CLAMPED_RADIANCE, INVALID
from render.ambient.path_tracer import WAVEFRONT, CameraPaths, camera_paths
from render.base.arrays import Float, Float32, Int
from render.base.errors import Cancelled, InputError
from render.base.threads import Cancel, map_chunks
from render.camera.camera import Camera
from render.run import Arrays, Run
from render.scene.scene import Scene
from render.world.placed import PlacedScene
from render.world.world import World

TILE = 16
"""Pixels a side of what gets samples together."""
PILOT = 2
"""Samples of each half on every pixel, before the rest goes where the variance is."""
EVEN_SHARE = 0.25
"""Of the rest goes everywhere alike, for what the first samples missed."""
MOST_SHARE = 64.0
"""Of the mean, for a single tile: the rest would wait for it."""
CONVERGENCE = 0.75
"""Power of the samples with which the error is taken to fall; 0.5 would be that of independent ones."""
GROWTH = 4.0
"""Most by which a pass multiplies the samples."""
IMAGE_ROWS = 8
"""Rows of tiles that a thread makes an image of at a time."""
GROUP = 256
"""Chunks between two moments at which an unfinished pass may be kept."""


@dataclass(frozen=True)
class AmbientImage:
    """Radiance of the ambient light, and how well it is known."""

    radiance: Float32
    """(h, w, 3) W/(m^2 sr) in R, G, B."""
    error: float
    """Estimated relative RMS error of the image; NaN after a single sample, which has no spread."""
    samples: float
    """On a pixel, on average."""
    invalid: int
    """Contributions that were NaN, infinite or negative, and were dropped."""
    clamped: int
    """Contributions that the clamp lowered."""
    clamped_radiance: float
    """Radiance that the clamp took away, mean over the image."""
    coarse_error: float | None = None
    """Relative RMS error of what was interpolated where no error matters, on held-out pixels; None: nothing was.
    `error` is then that of the scan lines over the allowed one (`render.ambient.measured_light`)."""
    lines: int | None = None
    """Scan lines of which that is, once they were looked at."""
    unknown: int | None = None
    """Those whose own error is above the allowed one."""


def ambient_images(
    placed: PlacedScene,
    *,
    target: float = 0.01,
    most: int = 16,
    surfaces: int | None = 1,
    clamp: float | None = None,
    run: Run = Run(),
) -> Iterator[AmbientImage]:
    """Ever better images, until the relative error is at most `target` or `most` samples a pixel are spent.

    surfaces: the most that light may meet, None for no bound; clamp, W/(m^2 sr): see `CameraPaths`. Raises Cancelled;
    where what is unfinished is wanted, after one more image, of all tiles that are done. What it goes on from gives
    the same image bit for bit as without interruption.
    """
    camera, view = placed.camera, placed.camera.view(placed.T_world_camera)
    paths = camera_paths(placed.world, placed.scene, view, surfaces=surfaces, clamp=clamp, seed=run.seed)
    film = Film(camera.width, camera.height)
    run.restore(film.load)
    try:
        yield from _passes(film, paths, target, most, run)
    except Cancelled:
        if run.keep_partial() and np.all(film.done.sum(axis=1) > 0):
            yield film.image(run.threads)
        raise


def _passes(film: Film, paths: CameraPaths, target: float, most: int, run: Run) -> Iterator[AmbientImage]:
    even = np.ones((film.tiles, 2))
    wanted, error = 1.0, math.nan
    # passes that are done already are gone through again, with their errors, to where the next one begins
    known = iter(tuple(film.errors))
    if most == 1:
        yield film.add_samples(paths, np.broadcast_to([1, 0], (film.tiles, 2)), run)
        return
    if most < 2 * PILOT:
        # a third sample would be no half's
        most = 2
    if film.errors:
        yield film.image(run.threads, run.cancelled)
    for level in range(1, min(PILOT, most // 2) + 1):
        wanted, done = float(level), next(known, None)
        if done is None:
            part = run.between(0.0, min(1.0, 2.0 * level / most))
            yield film.add_samples(paths, (level * even).astype(np.int64), part)
        error = film.errors[level - 1]
    share = film.shares()
    while error > target and 2.0 * wanted < most:
        spent = 2.0 * wanted / most
        needed = 1.1 * wanted * (error / target) ** (1.0 / CONVERGENCE) if target > 0.0 else math.inf
        wanted = min(max(needed, 1.25 * wanted), GROWTH * wanted, most / 2)
        done = next(known, None)
        if done is None:
            count = np.maximum(PILOT, np.rint(wanted * share)).astype(np.int64)
            yield film.add_samples(paths, count, run.between(spent, 2.0 * wanted / most))
        error = film.errors[-1] if done is None else done
    run.progress(1.0)


def ambient_image(
    world: World,
    scene: Scene,
    camera: Camera,
    T_world_camera: Float,
    *,
    samples: int = 16,
    surfaces: int | None = 1,
    run: Run = Run(),
) -> Float32:
    """(h, w, 3) float32 radiance, W/(m^2 sr) in R, G, B, with as many samples everywhere. Raises Cancelled."""
    paths = camera_paths(world, scene, camera.view(T_world_camera), surfaces=surfaces, seed=run.seed)
    film = Film(camera.width, camera.height)
    count = np.broadcast_to([samples - samples // 2, samples // 2], (film.tiles, 2))
    return film.add_samples(paths, count, run).radiance


class Film:
    """Sums of the samples of both halves, and how many there are of each in every tile."""

    consistent = True
    """No tile is ever half done."""

    def __init__(self, width: int, height: int) -> None:
        self.width, self.height = width, height
        self.across, self.down = -(-width // TILE), -(-height // TILE)
        self.tiles = self.across * self.down
        self.sums = np.zeros((height * width, 2, 3), np.float32)
        self.done = np.zeros((self.tiles, 2), np.int32)
        self.spread = np.zeros((self.tiles, 2))
        """Of each tile and half, sum of the squared differences of a pixel's first and second sample."""
        self.clamped_radiance = np.zeros((self.tiles, 2))
        """Of each tile and half, the sum of what the clamp took."""
        self.counts = np.zeros(2)
        """Invalid and clamped contributions."""
        self.errors: list[float] = []
        """After each pass."""

    def arrays(self) -> Arrays:
        """As a file holds it."""
        kept = {name: getattr(self, name) for name in ("sums", "done", "spread", "clamped_radiance", "counts")}
        return {**kept, "errors": np.array(self.errors, dtype=np.float64)}

    def load(self, arrays: Arrays) -> None:
        """Go on from `arrays`. InputError: they are not of this image."""
        for name in ("sums", "done", "spread", "clamped_radiance", "counts"):
            mine, found = getattr(self, name), arrays.get(name)
            if found is None or found.shape != mine.shape or found.dtype != mine.dtype:
                raise InputError("the saved ambient light is damaged", where=name, found=getattr(found, "shape", None))
            setattr(self, name, found)
        self.errors = [float(error) for error in arrays.get("errors", ())]

    def add_samples(self, paths: CameraPaths, count: NDArray[np.int64], run: Run) -> AmbientImage:
        """Add samples until each tile has count (tiles, 2) of both halves. Raises Cancelled."""
        more = np.maximum(count - self.done, 0).astype(np.int32)
        pixels_of = self._size_of(np.arange(self.tiles))
        chunks = _chunks(more.sum(axis=1) * pixels_of, WAVEFRONT)
        found = np.zeros((len(chunks), 2))

        def work(start: int, stop: int) -> None:
            for number in range(start, stop):
                self._trace_tiles(paths, chunks[number], more, found[number], run.cancelled)

        group = max(1, len(chunks)) if run.checkpoint is None else GROUP
        try:
            for start in range(0, len(chunks), group):
                stop = min(start + group, len(chunks))
                part = run.between(start / len(chunks), stop / len(chunks))
                part.map(lambda a, b, s=start: work(s + a, s + b), stop - start, 1)  # type: ignore[misc]
                run.keep(self)
        finally:
            # in the order of the chunks, whichever thread was first
            self.counts = self.counts + found.sum(axis=0)
        image = self.image(run.threads, run.cancelled)
        self.errors.append(image.error)
        run.keep(self)
        return image

    def image(self, threads: int | None = None, cancelled: Cancel | None = None) -> AmbientImage:
        """Of the samples so far. Raises Cancelled."""
        pixels_of = self._size_of(np.arange(self.tiles))
        image = np.empty((self.height, self.width, 3), np.float32)
        parts = np.zeros((self.down, 2))

        def work(start: int, stop: int) -> None:
            parts[start] = average_halves(self.sums, self.done, self.across, image, start, stop)

        map_chunks(work, self.down, IMAGE_ROWS, threads, cancelled)
        difference, power = (float(part) for part in parts.sum(axis=0))
        halves = bool(np.all(self.done > 0))
        variance = difference / 4.0
        error = math.sqrt(variance / max(power - variance, 1e-3 * power)) if power > 0.0 else 0.0
        samples = float((self.done.sum(axis=1) * pixels_of).sum() / pixels_of.sum())
        return AmbientImage(
            image,
            error if halves else math.nan,
            samples,
            int(self.counts[INVALID]),
            int(self.counts[CLAMPED]),
            float((self.clamped_radiance / np.maximum(self.done, 1)).sum() / 2 / pixels_of.sum()),
        )

    def shares(self) -> Float:
        """(tiles, 2) samples for each half, over their mean, as the root of the variance in the other half's pilot."""
        size = self._size_of(np.arange(self.tiles))
        deviation = np.sqrt(self.spread / size[:, None])[:, ::-1]
        mean = (deviation * size[:, None]).sum(axis=0) / size.sum()
        relative = np.where(mean > 0.0, deviation / np.where(mean > 0.0, mean, 1.0), 1.0)
        return np.asarray(EVEN_SHARE + (1.0 - EVEN_SHARE) * np.minimum(relative, MOST_SHARE))

    def _trace_tiles(self, paths: CameraPaths, tiles: Int, more: Int, counts: Float, cancelled: Cancel | None) -> None:
        pixels, place = self._pixels_of(tiles)
        first, count = self.done[tiles][place], more[tiles][place]
        sums = np.zeros((2 * len(pixels), 4))
        # a single tile may need more than a wavefront
        step = max(1, WAVEFRONT // max(2 * len(pixels), 1)) if len(tiles) == 1 else int(count.max())
        for begin in range(0, int(count.max()), step):
            some = np.clip(count - begin, 0, step).astype(np.int32)
            paths.add(pixels, (first + begin).astype(np.int32), some, path_kernels.Film(sums, counts), cancelled)
        new = sums.reshape(-1, 2, 4)[..., :3].astype(np.float32)
        if sums[:, CLAMPED_RADIANCE].any():
            for half in range(2):
                self.clamped_radiance[tiles, half] += np.bincount(place, sums[half::2, CLAMPED_RADIANCE], len(tiles))
        if np.all(first == 1) and np.all(count == 1):
            squares = np.sum((new.astype(np.float64) - self.sums[pixels]) ** 2, axis=2)
            for half in range(2):
                self.spread[tiles, half] = np.bincount(place, squares[:, half], len(tiles))
        self.sums[pixels] += new
        # no tile is in two chunks, and none is half done
        self.done[tiles] += more[tiles]

    def _size_of(self, tiles: NDArray[np.int64]) -> NDArray[np.int64]:
        """(n,) pixels in each tile; those at the right and lower edge may be cut."""
        columns = np.minimum(self.width - tiles % self.across * TILE, TILE)
        return np.asarray(columns * np.minimum(self.height - tiles // self.across * TILE, TILE))

    def _pixels_of(self, tiles: Int) -> tuple[Int, NDArray[np.int64]]:
        """(m,) pixels of the tiles, one tile after the other, and (m,) the place of each one's tile in `tiles`."""
        inside = np.arange(TILE * TILE)
        rows = (tiles // self.across * TILE)[:, None] + inside // TILE
        columns = (tiles % self.across * TILE)[:, None] + inside % TILE
        there = (rows < self.height) & (columns < self.width)
        place = np.broadcast_to(np.arange(len(tiles))[:, None], there.shape)[there]
        return (rows * self.width + columns)[there].astype(np.int32), place


def _chunks(rays: NDArray[np.int64], most: int) -> list[Int]:
    """Numbers of the tiles with rays, in groups of at most `most` rays, or of a single tile."""
    chunks: list[Int] = []
    group: list[int] = []
    total = 0
    for tile in np.flatnonzero(rays):
        if group and total + int(rays[tile]) > most:
            chunks.append(np.array(group, dtype=np.int32))
            group, total = [], 0
        group.append(int(tile))
        total += int(rays[tile])
    if group:
        chunks.append(np.array(group, dtype=np.int32))
    return chunks


@numba.njit(nogil=True, cache=True, error_model="numpy")
def average_halves(sums: Float32, done: Int, across: int, image: Float32, start: int, stop: int) -> tuple[float, float]:
    """The mean of both halves -> image (h, w, 3), rows of tiles start .. stop; the sums over these of the halves'
    squared difference, and of the image's square.

    sums (h w, 2, 3); done (tiles, 2). A half without samples is left out.
    """
    difference = power = 0.0
    for row in range(start * TILE, min(stop * TILE, image.shape[0])):
        for column in range(image.shape[1]):
            tile = row // TILE * across + column // TILE
            first = 1.0 / done[tile, 0] if done[tile, 0] > 0 else 0.0
            second = 1.0 / done[tile, 1] if done[tile, 1] > 0 else 0.0
            pixel = sums[row * image.shape[1] + column]
            for band in range(3):
                a = pixel[0, band] * first
                b = pixel[1, band] * second if second > 0.0 else a
                value = 0.5 * (a + b)
                image[row, column, band] = value
                difference += (a - b) * (a - b)
                power += value * value
    return difference, power
