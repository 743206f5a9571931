"""A laser's light through windows and off plane mirrors: one rough surface alone, integrated pixel by pixel.

What plane mirrors and faces of clear glass make of the laser on its way to a surface is known in closed form, and what
these and others make of it on its way to the camera follows from rays (`laser_walks`). This light is the measured line
itself where a scanner looks through a window; it needs no random paths. With cells of width h a side,

    v_h  =  mean - h^2 / 24 (d^2/du^2 + d^2/dv^2) L + O(h^4),

so that pixels of one and of four cells say what the mean is (Richardson 1911), and whether it is smooth there: how far
they differ is then known from the pixels beside them as well. Where it is not, at edges and shadows, cells are smaller,
with a ray anywhere in each.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numba
import numpy as np
from scipy.ndimage import binary_dilation

from render.base.arrays import Bool, Float, Float32, Long
from render.base.threads import map_chunks
from render.importance import known_below
from render.laser_indirect.accumulator import Accumulator
from render.laser_indirect.bdpt_pass import CHUNK_PATHS, BdptPass
from render.laser_indirect.camera_tree import SEED, camera_tree
from render.laser_indirect.chain_connections import empty_walks
from render.laser_indirect.connection_buffer import BLOCK, PassBuffer
from render.laser_indirect.connections import LaserSampling
from render.laser_indirect.laser_walks import (
    AFTER_NONE,
    add_walks,
    mark_near,
    walk_to_laser,
)
from render.laser_indirect.line_goal import Projection
from render.laser_indirect.path_vertex import CAUSTIC, SPECULAR_CHAIN, PassContext, Records
from render.laser_indirect.photon_emission import uniform_fan
from render.laser_indirect.specular_chains import ChainIndex
from render.run import Run

SPACING = 4
"""Pixels between the rays that look for lit surfaces; what these miss is left to random paths."""
SMOOTH = 0.01
"""Of the brightest pixel beside one: what it may differ from a smooth one, whose mean is then known to a twentieth of
that, the share of the fourth derivatives that remains. Chosen, not tuned."""
REMAINS = 0.05
FAINT = 0.01
"""Of the RMS of lit pixels: what is too little to be looked at more closely. Chosen, not tuned."""
LEAST_SIGMA = 0.2
"""px, of the sheet in the image: light paths find a thinner one sooner than rays through pixels. Chosen, not tuned."""
SOME = 4096
"""Rays of a list, at most, that tell how far away lit surfaces are."""
FINER = (4, 8)
"""Cells a side where a pixel is not smooth, with a ray anywhere in each."""


@dataclass(frozen=True)
class ClearLight:
    """Radiance, by whether the camera sees the lit surface itself or over mirrors and glass."""

    pixels: Long
    """(n,) ascending, where it is known."""
    radiance: Float
    """(n, 2) W/(m^2 sr): `AFTER_NONE`, `AFTER_SOME`."""
    error: Float
    """(n,) estimated."""
    invalid: int
    """Contributions that were NaN, infinite or negative, and count as 0."""

    def mask(self, pixels: int) -> Bool:
        """(pixels,) where it is known."""
        known = np.zeros(pixels, np.bool_)
        known[self.pixels] = True
        return known

    def of_kinds(self, kinds: int) -> Float:
        """(n,) radiance of the kinds of light (`path_vertex`) that are wanted."""
        if not kinds & CAUSTIC:
            return np.zeros(len(self.pixels))
        return self.radiance.sum(axis=1) if kinds & SPECULAR_CHAIN else self.radiance[:, AFTER_NONE]

    def add_to(self, buffer: PassBuffer, kinds: int) -> None:
        """Add what is wanted to a pass."""
        light = self.of_kinds(kinds)
        buffer.image[self.pixels] += light.astype(np.float32)
        buffer.touched[np.unique(self.pixels // BLOCK)] = True
        direct = float(self.of_kinds(kinds & CAUSTIC).sum())
        buffer.sums[CAUSTIC] += direct
        buffer.sums[SPECULAR_CHAIN] += float(light.sum()) - direct

    def added_to(self, image: Float32, kinds: int) -> Float32:
        """(h, w) radiance of other light, to which what is wanted is added in place."""
        image.ravel()[self.pixels] += self.of_kinds(kinds).astype(np.float32)
        return image

    def error_with(self, other: Accumulator, kinds: int) -> float:
        """Relative RMS error of the image of both, of all pixels."""
        if not len(self.pixels) or not other.passes:
            return other.error
        squares, variance = np.square(self.of_kinds(kinds)).sum(), np.square(self.error).sum()
        signal = (other.squares - other.variance_sum) / other.weight**2 + float(squares)
        noise = other.variance_sum / other.weight**2 + float(variance)
        return math.sqrt(noise / max(signal, 1e-300)) if noise > 0.0 else 0.0

    def line_deviation(self, projection: Projection) -> float:
        """By how much its error moves nearly all lines at most, over what is allowed."""
        place = np.minimum(np.searchsorted(self.pixels, projection.pixel), max(len(self.pixels) - 1, 0))
        known = self.pixels[place] == projection.pixel if len(self.pixels) else np.zeros(len(place), np.bool_)
        moved = np.square(projection.weight[known] * self.error[place[known]])
        variance = np.bincount(projection.line[known], moved, len(projection.lit))
        return known_below(np.sqrt(variance[projection.lit]))


NO_LIGHT = ClearLight(np.zeros(0, np.int64), np.zeros((0, 2)), np.zeros(0), 0)


def clear_light(task: BdptPass, run: Run) -> ClearLight:
    """The light over chains that are listed before the laser; the seed changes nothing. Raises Cancelled."""
    if not task.lit_chains or sheet_pixels(task) < LEAST_SIGMA:
        return NO_LIGHT
    made_of = task.view.T_world_camera.tobytes(), task.camera, task.T_world_laser.tobytes(), task.laser
    part = f"clear light of {task.laser.name}"
    return run.remembered(part, task.world, made_of, lambda: integrated(Integral(task, run, [])))


def sheet_pixels(task: BdptPass) -> float:
    """About the sigma of the sheet in the image where it comes over chains, px."""
    places = np.concatenate([chains.seen["o"][:: -(-len(chains.seen) // SOME)] for chains in task.lit_chains])
    from_laser, from_camera = (
        float(np.median(np.linalg.norm(places - pose[:3, 3], axis=1)))
        for pose in (task.T_world_laser, task.view.T_world_camera)
    )
    return float(task.laser.packed()[3]) * from_laser * max(task.camera.fx, task.camera.fy) / max(from_camera, 1e-9)


def integrated(integral: Integral) -> ClearLight:
    """All that is lit. Raises Cancelled."""
    pixels, one = integral.found()
    n = len(pixels)
    beside = _beside(pixels, integral.task.camera.width, integral.task.camera.height)
    middle = one.sum(axis=1)
    near = np.where(beside >= 0, middle[beside], 0.0)
    lit, radiance, error, off = _about(middle > 0.0, beside), np.zeros((n, 2)), np.zeros(n), np.zeros(n)
    smooth, dark = np.flatnonzero(lit), np.flatnonzero(~lit)
    four = integral.sampled(pixels[smooth], 2)
    more = four - one[smooth]
    radiance[smooth] = four + more / 3.0
    # beside what the second derivatives make of it
    off[smooth] = np.abs(more.sum(axis=1) - (near.sum(axis=1) - 4.0 * middle)[smooth] / 32.0)
    error[smooth] = REMAINS * off[smooth]
    # what is too thin for the middles of pixels, as a line that is seen in a ball, is met by some of these
    radiance[dark] = integral.sampled(pixels[dark], 2, jitter=True)
    off[dark] = radiance[dark].sum(axis=1)
    found = radiance.sum(axis=1)
    if not np.any(found):
        return NO_LIGHT
    largest = np.maximum(np.maximum(near.max(axis=1), middle), found)
    faint = FAINT * math.sqrt(np.square(found).sum() / np.count_nonzero(found))
    known, rough = lit & (off <= SMOOTH * largest), _about(off > SMOOTH * largest + faint, beside)
    for cells in FINER:
        known &= ~rough
        left = np.flatnonzero(rough)
        finer = integral.sampled(pixels[left], cells, jitter=True)
        off = np.zeros(n)
        off[left] = np.abs((finer - radiance[left]).sum(axis=1))
        # at an edge the error falls as the power 3/2 of the cells' size (Mitchell 1996)
        radiance[left], error[left] = finer, off[left] / 3.0
        met = radiance.sum(axis=1) > 0.0
        known |= rough & met & (off <= SMOOTH * largest)
        rough = _about(off > SMOOTH * largest + faint, beside) & met
    # no pixel is known by rays that met little there, which others may have met: such are left to random paths
    known[left] = True
    return ClearLight(pixels[known], np.maximum(radiance[known], 0.0), error[known], sum(integral.invalid))


@numba.njit(nogil=True, cache=True, error_model="numpy")
def unknown_near(pixels: Long, known: Bool, out: Long) -> int:
    """Those within SPACING rows and columns of pixels (n,) that are not known (h, w) -> out; how many. They are now."""
    height, width = known.shape
    count = 0
    for pixel in pixels:
        row, column = pixel // width, pixel % width
        for i in range(max(row - SPACING, 0), min(row + SPACING + 1, height)):
            for j in range(max(column - SPACING, 0), min(column + SPACING + 1, width)):
                if not known[i, j]:
                    known[i, j] = True
                    out[count] = i * width + j
                    count += 1
    return count


def _about(some: Bool, beside: Long) -> Bool:
    """(n,) pixels, and those beside them."""
    return some | np.where(beside >= 0, some[beside], False).any(axis=1)


def _beside(pixels: Long, width: int, height: int) -> Long:
    """(n, 4) the numbers of the pixels left, right, above and below; -1: they are not among those (n,)."""
    place = np.full(height * width + 1, -1, np.int64)
    place[pixels] = np.arange(len(pixels))
    column, none = pixels % width, height * width
    ends = (
        np.where(column > 0, pixels - 1, none),
        np.where(column < width - 1, pixels + 1, none),
        np.where(pixels >= width, pixels - width, none),
        np.minimum(pixels + width, none),
    )
    return np.stack([place[end] for end in ends], axis=1)


@dataclass(frozen=True)
class Integral:
    """What sampling pixels needs; contributions that are no numbers are counted."""

    task: BdptPass
    run: Run
    invalid: list[int]

    def found(self) -> tuple[Long, Float]:
        """(n,) ascending pixels about what is lit, (n, 2) radiance by the ray through the middle of each."""
        shape = self.task.camera.height, self.task.camera.width
        pixels = self.candidates()
        known, radiance = np.zeros(shape, np.bool_), np.zeros((shape[0] * shape[1], 2))
        while len(pixels):
            known.ravel()[pixels] = True
            radiance[pixels] = self.sampled(pixels, 1)
            # what was too thin for the look goes on where it was met
            met = pixels[radiance[pixels].any(axis=1)]
            room = np.empty(min(len(met) * (2 * SPACING + 1) ** 2, known.size), np.int64)
            pixels = np.sort(room[: unknown_near(met, known, room)])
        pixels = np.flatnonzero(known)
        return pixels, radiance[pixels]

    def candidates(self) -> Long:
        """(n,) pixels about those that see what may be lit."""
        task, spacing = self.task, SPACING
        width, height = task.camera.width, task.camera.height
        v, u = np.mgrid[0:height:spacing, 0:width:spacing]
        pixels = (v * width + u).ravel()
        near = np.zeros(len(pixels), np.bool_)

        def work(start: int, stop: int) -> None:
            self._trace(pixels[start:stop], 1, False, near=near[start:stop])

        map_chunks(work, len(pixels), CHUNK_PATHS, self.run.threads, self.run.cancelled)
        blocks = binary_dilation(near.reshape(v.shape), np.ones((3, 3)))
        return np.flatnonzero(np.kron(blocks, np.ones((spacing, spacing), np.bool_))[:height, :width])

    def sampled(self, pixels: Long, cells: int, jitter: bool = False) -> Float:
        """(n, 2) radiance of pixels (n,) by rays through cells x cells parts of each."""
        values = np.zeros((len(pixels), 2))

        def work(start: int, stop: int) -> None:
            self._trace(pixels[start:stop], cells, jitter, values=values[start:stop])

        chunk = max(1, CHUNK_PATHS // cells**2)
        map_chunks(work, len(pixels), chunk, self.run.threads, self.run.cancelled)
        return values

    def _trace(
        self, pixels: Long, cells: int, jitter: bool, values: Float | None = None, near: Bool | None = None
    ) -> None:
        """Camera paths of pixels (n,) -> values (n, 2), or near (n,): whether they come to what may be lit."""
        task = self.task
        context, laser = task.context(SEED), task.laser_sampling(uniform_fan(0.0, 1.0))
        for vertices, paths in camera_tree(task, pixels, cells, jitter):
            for chains in task.lit_chains:
                if near is not None:
                    mark_near(vertices, paths, context.rows, chains, near)
                if values is not None:
                    self._walk(vertices, paths, chains, context, laser, values)

    def _walk(
        self,
        vertices: Records,
        paths: Records,
        chains: ChainIndex,
        context: PassContext,
        laser: LaserSampling,
        values: Float,
    ) -> None:
        """Camera vertices (n,) -> values (pixels, 2), by walks to the laser over listed chains."""
        task, first, counts = self.task, 0, np.zeros(2, np.int64)
        walks = empty_walks(max(len(vertices), chains.most))
        while first < len(vertices):
            first = walk_to_laser(first, vertices, paths, chains, task.surface, context, laser, counts, walks)
            self.invalid.append(add_walks(walks, task.occluded(walks, counts), int(counts[0]), values))
