"""A whole image of a grid of points (`guided_interpolation.py`), which sees what is between few of its pixels.

Every second pixel of every second row is looked at by a ray of its own. Where the same plain surface, bent little, is
seen at all four corners of a cell the others follow from these; elsewhere each has a ray of its own as well.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numba
import numpy as np

from render.ambient.guided_interpolation import NOTHING, SEEN, grid_of, interpolate, likeness, seen_at
from render.ambient.path_tracer import CameraPaths
from render.base.arrays import Bool, Float, Float32, Int
from render.run import Run
from render.world.embree import CHUNK
from render.world.triangles import Surface

SPACING = 2
"""Pixels from one that has a ray of its own to the next."""
ALIKE = 0.98
"""Weight of likeness of two corners of a cell that is not looked into: normals 7 degrees apart have 0.98."""
CELL_ROWS = 64
"""Rows of cells that a thread does at a time."""


@dataclass(frozen=True)
class LightGrid:
    """Points of a grid, what is seen there, and their light."""

    shape: tuple[int, int]
    """Height and width of the image that it is a grid of."""
    block: int
    """Pixels from point to point."""
    seen: Float32
    item: Int
    light: Float32
    """As `render.ambient.guided_interpolation.interpolate` takes them."""

    def at(self, places: Float, seen: Float32, item: Int, out: Float32) -> Float32:
        """Radiance -> out (n, c) at rows and columns (n, 2), where (n, SEEN) and (n,) is seen; how well (n,) of each
        the grid knows it, at most 1."""
        fit = np.empty(len(places), np.float32)
        interpolate(places, self.shape, self.block, seen, item, (self.seen, self.item, self.light), out, fit)
        return fit


Places = Callable[[Int, Float32, Int], Float]
"""Rows and columns (n, 2) of a grid at which some pixels (n,) are, where (n, SEEN) and (n,) is seen."""


def places_of(pixels: Int, width: int) -> Float:
    """(n, 2) rows and columns of an image's own pixels."""
    return np.stack([pixels // width, pixels % width], axis=1).astype(np.float64)


def guided_image(grid: LightGrid, paths: CameraPaths, height: int, places: Places, run: Run) -> Float32:
    """(h, w, 3) radiance of an image as a grid, of its own or of another, has it. Raises Cancelled."""
    width = paths.view.width
    image = np.empty((height * width, 3), np.float32)
    nodes, across = grid_of(width, height, SPACING)
    item = np.empty(len(nodes), np.int32)
    facing = np.empty((len(nodes), SEEN), np.float32)

    def look(pixels: Int, seen_item: tuple[Float32, Int] | None, start: int, stop: int) -> None:
        some = pixels[start:stop]
        seen, there = seen_at(some, paths.view, paths.surface, paths.lights, paths.rays)
        radiance = np.empty((len(some), 3), np.float32)
        grid.at(places(some, seen, there), seen, there, radiance)
        image[some] = radiance
        if seen_item is not None:
            seen_item[0][start:stop], seen_item[1][start:stop] = seen, there

    run.between(0.0, 0.5).map(lambda a, b: look(nodes, (facing, item), a, b), len(nodes), CHUNK)
    single = np.zeros(height * width, np.bool_)
    lines = nodes[::across] // width, nodes[:across] % width
    plain = plain_items(paths.surface)

    def fill(start: int, stop: int) -> None:
        fill_cells(start, stop, lines, (facing, item), plain, width, image, single)

    run.between(0.5, 0.6).map(fill, len(lines[0]) - 1, CELL_ROWS)
    left = np.flatnonzero(single).astype(np.int32)
    run.between(0.6, 1.0).map(lambda a, b: look(left, None, a, b), len(left), CHUNK)
    return image.reshape(height, width, 3)


def plain_items(surface: Surface) -> Bool:
    """(s,) objects of one colour all over."""
    return np.asarray((surface.texture_shape[:, 1] == 0) & (surface.second < 0))


@numba.njit(nogil=True, cache=True, error_model="numpy")
def fill_cells(
    start: int,
    stop: int,
    lines: tuple[Int, Int],
    known: tuple[Float32, Int],
    plain: Bool,
    width: int,
    image: Float32,
    single: Bool,
) -> None:
    """Rows start .. stop of the cells between some rows and columns, lines, of an image (pixels, 3), at whose crossings
    it is known, with what is seen there -> the pixels between, or that they are to be looked at singly."""
    (rows, columns), (seen, item) = lines, known
    across = columns.shape[0]
    for i in range(start, stop):
        for j in range(across - 1):
            a = i * across + j
            b, c, d = a + 1, a + across, a + across + 1
            it, same = item[a], True
            # also at the next crossings: beside an edge a pixel may hold light of both sides
            for row in range(max(i - 1, 0), min(i + 3, rows.shape[0])):
                for column in range(max(j - 1, 0), min(j + 3, across)):
                    same = same and item[row * across + column] == it
            if same and it >= 0:
                same = plain[it]
                for q in (b, c, d):
                    same = same and likeness(seen, a, it, seen, q, it) >= ALIKE
            elif same:
                same = it == NOTHING
            top, bottom, left, right = rows[i], rows[i + 1], columns[j], columns[j + 1]
            # a cell has the pixels down to its lower and right edge, but for those that are crossings
            for row in range(top if i == 0 else top + 1, bottom + 1):
                for column in range(left if j == 0 else left + 1, right + 1):
                    if row in (top, bottom) and column in (left, right):
                        continue
                    pixel = row * width + column
                    single[pixel] = not same
                    if same:
                        v, u = (row - top) / max(bottom - top, 1), (column - left) / max(right - left, 1)
                        for band in range(3):
                            upper = (1.0 - u) * image[top * width + left, band] + u * image[top * width + right, band]
                            lower = (1.0 - u) * image[bottom * width + left, band] + u * image[
                                bottom * width + right, band
                            ]
                            image[pixel, band] = (1.0 - v) * upper + v * lower
