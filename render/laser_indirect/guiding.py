"""Where the camera looks for a laser's indirect light, and where along the lit curve it expects it from.

Both follow from the passes before, so a pass on its own stays unbiased: they decide how often something is tried, and
every try is weighed by that.
"""

from __future__ import annotations

import math
from functools import partial
from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter, uniform_filter

from render.base.threads import Cancel, map_chunks
from render.camera.camera import Camera
from render.laser_indirect.specular_edges import find_edges
from render.material.bsdf import is_smooth
from render.sampling.random import uniform
from render.world.triangles import Surface
from render.world.world import World

Float = NDArray[np.float64]
Float32 = NDArray[np.float32]
Int = NDArray[np.int32]
Bool = NDArray[np.bool_]

NOWHERE: Bool = np.zeros(0, np.bool_)
"""Nothing is clear."""

TILE, BINS = 8, 128
"""Pixels a side of the guide's tiles; parts of the lit curve."""
COARSE = 4
"""Pixels a side of the cells in which camera paths are spread."""
WINDOWS = ((3, 0.7), (9, 0.2), (27, 0.1))
"""In cells, of the neighbourhood that tells what to expect of a pixel, and their weights."""
DOUBT = 1.0
"""Camera paths of its own that a pixel needs to be believed as much as its neighbourhood."""
WITHIN = 0.15
"""What a camera path is worth in a pixel that has one in every pass, to that in a pixel where it is left to chance."""
LEAST, MOST_SAMPLES = 1e-8, 64.0
"""Least share of all light in a cell worth looking at; most camera paths of a pixel and pass."""
UNSEEN = 0.1
"""Of the camera paths, for what may be behind glass besides what was found there."""
LOOK = 4
"""Pixels between the rays that look for glass."""
CELL_ROWS, GUIDE_ROWS, PIXELS_A_CHUNK = 16, 1024, 1 << 18
"""Rows of cells, of the guide, and pixels that a thread does at a time."""
FEWEST_TO_LEARN, FLAT = 1.0, 0.2
"""Camera paths a pass in a tile that learns; the part of a guide that stays flat."""


class Guide(NamedTuple):
    """Where on the lit curve light is expected from, for each tile of the image."""

    width: int
    """Of the image."""
    row: Int
    """(tiles down, tiles across) row of `cumulative`, -1: nothing is known."""
    cumulative: Float
    """(n, BINS + 1) distribution over equal parts of the list of light vertices, from 0 to 1."""


def share_samples(
    image: Float32,
    width: int,
    count: float,
    samples: Float | None = None,
    drawn: float = 0.0,
    threads: int | None = None,
    cancelled: Cancel | None = None,
) -> Float:
    """(pixels,) radiance so far -> camera paths to be expected for each pixel, about `count` in all; into `samples`.

    In proportion to a pixel's radiance as its own paths so far know it, `drawn` times `samples`, and before there are
    any as its neighbourhood does. What is beyond one path only lessens the spread within the pixel, and is worth less.
    Raises Cancelled.
    """
    if samples is None:
        samples = np.zeros(len(image))
    cells = np.zeros((-(-(len(image) // width) // COARSE), -(-width // COARSE)), np.float32)
    sums = np.zeros(len(cells))
    map_chunks(partial(sum_cells, image, width, cells, sums), len(cells), CELL_ROWS, threads, cancelled)
    total = float(sums.sum())
    if total <= 0.0 or count <= 0.0:
        samples[:] = 0.0
        return samples
    about = np.zeros_like(cells)
    for window, share in WINDOWS:
        about += uniform_filter(cells, window, mode="constant") * np.float32(share / COARSE**2)
    work = partial(expect, image, width, about, drawn, LEAST * total, samples)
    map_chunks(work, len(cells), CELL_ROWS, threads, cancelled)
    scale(samples, pixels_looked_at(samples), count, threads)
    return samples


def pixels_looked_at(samples: Float) -> Int:
    """(n,) the pixels that may have camera paths, in order."""
    return np.flatnonzero(samples).astype(np.int32)


@numba.njit(nogil=True, cache=True)
def sum_cells(image: Float32, width: int, cells: Float32, sums: Float, start: int, stop: int) -> None:
    """Add (pixels,) up in cells of COARSE x COARSE pixels, and the rows start .. stop of these in sums."""
    for row in range(start * COARSE, min(stop * COARSE, image.shape[0] // width)):
        for column in range(width):
            value = image[row * width + column]
            if value != 0.0:
                cells[row // COARSE, column // COARSE] += value
                sums[row // COARSE] += value


@numba.njit(nogil=True, cache=True)
def expect(
    image: Float32,
    width: int,
    about: Float32,
    drawn: float,
    least: float,
    samples: Float,
    start: int,
    stop: int,
) -> None:
    """Radiance that is expected of each pixel, by its own and its cell's neighbourhood -> samples (pixels,).

    In rows start .. stop of cells.
    """
    for row in range(start * COARSE, min(stop * COARSE, image.shape[0] // width)):
        for column in range(width):
            pixel = row * width + column
            near = about[row // COARSE, column // COARSE]
            if near <= least:
                if samples[pixel] != 0.0:
                    samples[pixel] = 0.0
                continue
            known = samples[pixel] * drawn
            samples[pixel] = (known * image[pixel] + DOUBT * near) / (known + DOUBT)


def scale(samples: Float, looked_at: Int, count: float, threads: int | None = None) -> None:
    """Scale samples (pixels,) to `count` in all, whereby what exceeds 1 grows more slowly."""
    sums = np.zeros(-(-len(looked_at) // PIXELS_A_CHUNK))

    def total(factor: float) -> float:
        map_chunks(partial(sum_scaled, samples, looked_at, factor, sums), len(looked_at), PIXELS_A_CHUNK, threads)
        return float(sums.sum())

    factor = count / total(0.0)
    for _ in range(3):
        factor *= count / total(factor)
    map_chunks(partial(set_scaled, samples, looked_at, factor), len(looked_at), PIXELS_A_CHUNK, threads)


@numba.njit(nogil=True, cache=True)
def sum_scaled(samples: Float, looked_at: Int, factor: float, sums: Float, start: int, stop: int) -> None:
    """The sum over looked_at[start .. stop], scaled, or as it is where the factor is 0, into the chunk's place."""
    total = 0.0
    for i in range(start, stop):
        value = samples[looked_at[i]] * (factor if factor > 0.0 else 1.0)
        total += value if value < 1.0 or factor == 0.0 else 1.0 + WITHIN * (value - 1.0)
    sums[start // PIXELS_A_CHUNK] = total


@numba.njit(nogil=True, cache=True)
def set_scaled(samples: Float, looked_at: Int, factor: float, start: int, stop: int) -> None:
    """Scale the pixels looked_at[start .. stop]."""
    for i in range(start, stop):
        value = factor * samples[looked_at[i]]
        samples[looked_at[i]] = min(value if value < 1.0 else 1.0 + WITHIN * (value - 1.0), MOST_SAMPLES)


def any_clear(surface: Surface) -> bool:
    """Some material scatters into single directions only."""
    return any(is_smooth(row) for row in surface.rows)


def clear_pixels(world: World, surface: Surface, camera: Camera, T_world_camera: Float) -> Bool:
    """(pixels,) whether the camera looks at a mirror or clear glass, to the nearest few pixels."""
    v, u = np.mgrid[0 : camera.height : LOOK, 0 : camera.width : LOOK]
    rays, known = camera.rays(np.stack([u.ravel(), v.ravel()], axis=1).astype(np.float64))
    hit = world.rays.from_point(T_world_camera[:3, 3], (rays @ T_world_camera[:3, :3].T).astype(np.float32))
    clear = np.array([is_smooth(row) for row in surface.rows]) | (surface.second >= 0)
    found = ((hit >= 0) & known & clear[world.object_id[hit]]).reshape(v.shape)
    # a part too thin for these rays is no farther than that from its edges
    find_edges(world, clear, camera, T_world_camera, LOOK, found)
    found = maximum_filter(found, 3)
    return np.kron(found, np.ones((LOOK, LOOK), np.bool_))[: camera.height, : camera.width].ravel()


def look_behind(samples: Float, clear: Bool, count: float) -> None:
    """Leave a part of (pixels,) samples, `count` in all, to clear pixels alike: no light path tells what is there."""
    behind = int(clear.sum())
    if behind:
        samples *= 1.0 - UNSEEN
        samples[clear] += UNSEEN * count / behind


def no_guide(camera: Camera) -> Guide:
    """Nothing is known of any tile."""
    tiles = -np.ones((-(-camera.height // TILE), -(-camera.width // TILE)), np.int32)
    return Guide(camera.width, tiles, np.zeros((0, BINS + 1)))


def first_guide(samples: Float, camera: Camera) -> Guide:
    """A guide, flat so far, for the tiles with enough camera paths to learn from."""
    tiles = no_guide(camera).row
    count = number_tiles(samples, camera.width, tiles)
    cumulative = np.repeat(np.linspace(0.0, 1.0, BINS + 1)[None], count, axis=0)
    return Guide(camera.width, tiles, cumulative)


@numba.njit(nogil=True, cache=True)
def number_tiles(samples: Float, width: int, tiles: Int) -> int:
    """Number the tiles with enough camera paths to learn from; returns how many they are."""
    down, across = tiles.shape
    height, count = samples.shape[0] // width, 0
    paths = np.empty(across)
    for i in range(down):
        paths[:] = 0.0
        for row in range(i * TILE, min((i + 1) * TILE, height)):
            for column in range(width):
                paths[column // TILE] += samples[row * width + column]
        for j in range(across):
            if paths[j] >= FEWEST_TO_LEARN:
                tiles[i, j] = count
                count += 1
    return count


def learn(guide: Guide, learnt: Float, knowledge: Float, threads: int | None = None) -> Guide:
    """Fold what the passes of a wave learnt (cleared) into `knowledge`; the guide that follows from it."""
    cumulative = np.empty((len(knowledge), BINS + 1))
    map_chunks(partial(learn_rows, learnt, knowledge, cumulative), len(knowledge), GUIDE_ROWS, threads)
    return guide._replace(cumulative=cumulative)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def learn_rows(learnt: Float, knowledge: Float, cumulative: Float, start: int, stop: int) -> None:
    """Rows start .. stop of `learn`.

    The best density is the root of the mean square of what is found; a part stays flat, for what was not found yet.
    """
    root = np.empty(BINS)
    for row in range(start, stop):
        whole = 0.0
        for i in range(BINS):
            found = 0.0
            for k in range(learnt.shape[0]):
                found += learnt[k, row, i]
                learnt[k, row, i] = 0.0
            if math.isfinite(found):
                knowledge[row, i] += found
            root[i] = math.sqrt(knowledge[row, i])
            whole += root[i]
        cumulative[row, 0] = 0.0
        for i in range(BINS):
            near = 0.5 * root[i] + 0.25 * (root[i - 1] + root[(i + 1) % BINS])
            density = near / whole if whole > 0.0 else 1.0 / BINS
            cumulative[row, i + 1] = cumulative[row, i] + (1.0 - FLAT) * density + FLAT / BINS
        for i in range(1, BINS + 1):
            cumulative[row, i] /= cumulative[row, BINS]


@numba.njit(nogil=True, cache=True)
def draw_paths(samples: Float, looked_at: Int, seed: int) -> tuple[Int, Int]:
    """The pixels with camera paths in a pass, and (n + 1,) the number of each one's first path.

    As many as `samples` says up to a whole number, by chance.
    """
    pixels, starts = np.empty(looked_at.shape[0], np.int32), np.empty(looked_at.shape[0] + 1, np.int32)
    n = drawn = 0
    starts[0] = 0
    for pixel in looked_at:
        count = int(samples[pixel] + uniform(seed, pixel, 0, 92))
        if count > 0:
            pixels[n] = pixel
            drawn += count
            n += 1
            starts[n] = drawn
    return pixels[:n], starts[: n + 1]
