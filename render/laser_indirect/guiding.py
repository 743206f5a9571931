"""Guiding of camera paths: how many each pixel gets, and where on the lit curve RIS draws its candidates.

Both follow from earlier passes alone and decide only how often something is sampled, which every MIS weight takes into
account: each pass on its own stays unbiased.
"""

from __future__ import annotations

import math
from functools import partial
from typing import NamedTuple

import numba
import numpy as np
from scipy.ndimage import maximum_filter, uniform_filter

from render.base.arrays import Bool, Float, Float32, Int
from render.base.nonzero import nonzero_places
from render.base.threads import Cancel, map_chunks
from render.camera.camera import Camera
from render.laser_indirect.specular_edges import find_edges
from render.material.bsdf import is_specular_row
from render.world.triangles import Surface
from render.world.world import World

NO_PIXELS: Bool = np.zeros(0, np.bool_)
"""No pixel shows anything specular."""

TILE, BINS = 8, 128
"""Pixels a side of the tiles that share a row of the guide; bins of the lit curve in a row."""
COARSE = 4
"""Pixels a side of the cells in which the radiance about a pixel is averaged."""
WINDOWS = ((3, 0.7), (9, 0.2), (27, 0.1))
"""Sides, in cells, of the neighbourhoods whose mean predicts a pixel without paths of its own, and their weights.
Chosen, not tuned."""
PRIOR_PATHS = 1.0
"""Camera paths that the prediction by the neighbourhood is worth: with as many of its own a pixel counts half. Chosen,
not tuned."""
DIMINISHING_RETURN = 0.15
"""What a pixel's second and further path in a pass count beside its first, as they only lessen the variance within the
pixel. Chosen, not tuned."""
LEAST, MOST_CAMERA_PATHS = 1e-8, 64.0
"""Cells with less than this share of all light get no camera paths; most camera paths of a pixel in a pass."""
SPECULAR_RESERVE = 0.1
"""Share of the camera paths kept for specular pixels, alike: no light path tells what is behind them. Chosen, not
tuned."""
SPECULAR_RAY_SPACING = 4
"""Pixels between the rays that look for specular surfaces."""
CELL_ROWS, GUIDE_ROWS, PIXELS_A_CHUNK = 16, 1024, 1 << 18
"""Rows of cells, of the guide, and pixels that a thread does at a time."""
LEAST_PATHS_TO_LEARN, GUIDE_UNIFORM_FRACTION = 1.0, 0.2
"""Fewest camera paths of a tile in a pass for a row of its own; the share of a row that stays uniform. Chosen, not
tuned."""


class Guide(NamedTuple):
    """Distributions over the lit curve, for each tile of the image."""

    width: int
    """Width of the image."""
    row: Int
    """(tiles down, tiles across) row of `cumulative`; -1: uniform."""
    cumulative: Float
    """(n, BINS + 1) distribution over equal parts of the list of light vertices, from 0 to 1."""


def allocate_camera_paths(
    image: Float32,
    width: int,
    count: float | None,
    camera_paths: Float32 | None = None,
    drawn: float = 0.0,
    threads: int | None = None,
    cancelled: Cancel | None = None,
) -> Float32:
    """(pixels,) radiance so far -> expected camera paths of each pixel, about `count` in all; into `camera_paths`.

    In proportion to a pixel's radiance as its own paths so far know it, `drawn` times `camera_paths`, and before there
    are any as its neighbourhood does; without a count that radiance itself. More than one path a pass only lessens the
    variance within the pixel, and is given less. Raises Cancelled.
    """
    if camera_paths is None:
        camera_paths = np.zeros(len(image), np.float32)
    cells = np.zeros((-(-(len(image) // width) // COARSE), -(-width // COARSE)), np.float32)
    sums = np.zeros(len(cells))
    map_chunks(partial(sum_cells, image, width, cells, sums), len(cells), CELL_ROWS, threads, cancelled)
    total = float(sums.sum())
    if total <= 0.0 or (count is not None and count <= 0.0):
        camera_paths[:] = 0.0
        return camera_paths
    about = np.zeros_like(cells)
    for window, share in WINDOWS:
        about += uniform_filter(cells, window, mode="constant") * np.float32(share / COARSE**2)
    work = partial(predict_radiance, image, width, about, drawn, LEAST * total, camera_paths)
    map_chunks(work, len(cells), CELL_ROWS, threads, cancelled)
    if count is not None:
        scale(camera_paths, active_pixels(camera_paths), count, threads)
    return camera_paths


def active_pixels(camera_paths: Float32) -> Int:
    """(n,) the pixels that may have camera paths, in order."""
    return nonzero_places(camera_paths)


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
def predict_radiance(
    image: Float32,
    width: int,
    about: Float32,
    drawn: float,
    least: float,
    camera_paths: Float32,
    start: int,
    stop: int,
) -> None:
    """Radiance that is expected of each pixel, by its own and its cell's neighbourhood -> camera_paths (pixels,).

    In rows start .. stop of cells.
    """
    for row in range(start * COARSE, min(stop * COARSE, image.shape[0] // width)):
        for column in range(width):
            pixel = row * width + column
            near = about[row // COARSE, column // COARSE]
            if near <= least:
                if camera_paths[pixel] != 0.0:
                    camera_paths[pixel] = 0.0
                continue
            known = camera_paths[pixel] * drawn
            camera_paths[pixel] = (known * image[pixel] + PRIOR_PATHS * near) / (known + PRIOR_PATHS)


def scale(camera_paths: Float32, active: Int, count: float, threads: int | None = None) -> None:
    """Scale camera paths (pixels,) to `count` in all, whereby what exceeds 1 grows more slowly."""
    sums = np.zeros(-(-len(active) // PIXELS_A_CHUNK))

    def total(factor: float) -> float:
        map_chunks(partial(sum_scaled, camera_paths, active, factor, sums), len(active), PIXELS_A_CHUNK, threads)
        return float(sums.sum())

    factor = count / total(0.0)
    for _ in range(3):
        factor *= count / total(factor)
    map_chunks(partial(set_scaled, camera_paths, active, factor), len(active), PIXELS_A_CHUNK, threads)


@numba.njit(nogil=True, cache=True)
def sum_scaled(camera_paths: Float32, active: Int, factor: float, sums: Float, start: int, stop: int) -> None:
    """The sum over active[start .. stop], scaled, or as it is where the factor is 0, into the chunk's place."""
    total = 0.0
    for i in range(start, stop):
        value = camera_paths[active[i]] * (factor if factor > 0.0 else 1.0)
        total += value if value < 1.0 or factor == 0.0 else 1.0 + DIMINISHING_RETURN * (value - 1.0)
    sums[start // PIXELS_A_CHUNK] = total


@numba.njit(nogil=True, cache=True)
def set_scaled(camera_paths: Float32, active: Int, factor: float, start: int, stop: int) -> None:
    """Scale the pixels active[start .. stop]."""
    for i in range(start, stop):
        value = factor * camera_paths[active[i]]
        camera_paths[active[i]] = min(
            value if value < 1.0 else 1.0 + DIMINISHING_RETURN * (value - 1.0), MOST_CAMERA_PATHS
        )


def any_specular(surface: Surface) -> bool:
    """Some material scatters into single directions only."""
    return any(is_specular_row(row) for row in surface.rows)


def find_specular_pixels(world: World, surface: Surface, camera: Camera, T_world_camera: Float) -> Bool:
    """(pixels,) whether the camera sees a mirror or clear glass, to the nearest few pixels."""
    v, u = np.mgrid[0 : camera.height : SPECULAR_RAY_SPACING, 0 : camera.width : SPECULAR_RAY_SPACING]
    rays, known = camera.rays(np.stack([u.ravel(), v.ravel()], axis=1).astype(np.float64))
    hit = world.rays.from_point(T_world_camera[:3, 3], (rays @ T_world_camera[:3, :3].T).astype(np.float32))
    specular = np.array([is_specular_row(row) for row in surface.rows]) | (surface.second >= 0)
    found = ((hit >= 0) & known & specular[world.object_id[hit]]).reshape(v.shape)
    # a part too thin for these rays is no farther than that from its edges
    find_edges(world, specular, camera, T_world_camera, SPECULAR_RAY_SPACING, found)
    found = maximum_filter(found, 3)
    return np.kron(found, np.ones((SPECULAR_RAY_SPACING, SPECULAR_RAY_SPACING), np.bool_))[
        : camera.height, : camera.width
    ].ravel()


def reserve_for_specular(camera_paths: Float32, specular: Bool, count: float) -> None:
    """Leave a share of (pixels,) camera paths, `count` in all, to specular pixels alike."""
    behind = np.count_nonzero(specular)
    if behind:
        more = SPECULAR_RESERVE * count / behind
        map_chunks(partial(add_reserve, camera_paths, specular, more), len(camera_paths), PIXELS_A_CHUNK)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def add_reserve(camera_paths: Float32, specular: Bool, more: float, start: int, stop: int) -> None:
    """Take the reserve from (pixels,) camera paths start .. stop, and add to those of specular pixels."""
    for i in range(start, stop):
        # what is zero is only read: its memory may not have been given by the system yet
        if camera_paths[i] != 0.0 or specular[i]:
            camera_paths[i] = (1.0 - SPECULAR_RESERVE) * camera_paths[i] + (more if specular[i] else 0.0)


def no_guide(camera: Camera) -> Guide:
    """A guide that is uniform everywhere."""
    tiles = -np.ones((-(-camera.height // TILE), -(-camera.width // TILE)), np.int32)
    return Guide(camera.width, tiles, np.zeros((0, BINS + 1)))


def first_guide(camera_paths: Float32, camera: Camera) -> Guide:
    """A guide, uniform so far, with a row for every tile with enough camera paths to learn from."""
    tiles = no_guide(camera).row
    count = number_tiles(camera_paths, camera.width, tiles)
    cumulative = np.repeat(np.linspace(0.0, 1.0, BINS + 1)[None], count, axis=0)
    return Guide(camera.width, tiles, cumulative)


@numba.njit(nogil=True, cache=True)
def number_tiles(camera_paths: Float32, width: int, tiles: Int) -> int:
    """Number the tiles with enough camera paths to learn from; returns how many they are."""
    down, across = tiles.shape
    height, count = camera_paths.shape[0] // width, 0
    paths = np.empty(across)
    for i in range(down):
        paths[:] = 0.0
        for row in range(i * TILE, min((i + 1) * TILE, height)):
            for column in range(width):
                paths[column // TILE] += camera_paths[row * width + column]
        for j in range(across):
            if paths[j] >= LEAST_PATHS_TO_LEARN:
                tiles[i, j] = count
                count += 1
    return count


def update_guide(guide: Guide, wave_moments: Float, guide_moments: Float, threads: int | None = None) -> Guide:
    """Add the moments of a wave, which are zeroed, to `guide_moments`; the guide that follows from them."""
    cumulative = np.empty((len(guide_moments), BINS + 1))
    map_chunks(
        partial(update_guide_rows, wave_moments, guide_moments, cumulative), len(guide_moments), GUIDE_ROWS, threads
    )
    return guide._replace(cumulative=cumulative)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def update_guide_rows(wave_moments: Float, guide_moments: Float, cumulative: Float, start: int, stop: int) -> None:
    """Rows start .. stop of `update_guide`.

    The pdf of least variance goes with the root of the second moment; a share stays uniform, for what no candidate has
    met yet.
    """
    root = np.empty(BINS)
    for row in range(start, stop):
        total = 0.0
        for i in range(BINS):
            found = 0.0
            for k in range(wave_moments.shape[0]):
                found += wave_moments[k, row, i]
                wave_moments[k, row, i] = 0.0
            if math.isfinite(found):
                guide_moments[row, i] += found
            root[i] = math.sqrt(guide_moments[row, i])
            total += root[i]
        cumulative[row, 0] = 0.0
        for i in range(BINS):
            near = 0.5 * root[i] + 0.25 * (root[i - 1] + root[(i + 1) % BINS])
            density = near / total if total > 0.0 else 1.0 / BINS
            cumulative[row, i + 1] = (
                cumulative[row, i] + (1.0 - GUIDE_UNIFORM_FRACTION) * density + GUIDE_UNIFORM_FRACTION / BINS
            )
        for i in range(1, BINS + 1):
            cumulative[row, i] /= cumulative[row, BINS]
