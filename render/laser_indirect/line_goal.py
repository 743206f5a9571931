"""When one laser's reflected light is known well enough for the line that is measured in it.

Each pass is projected onto what counts: how far its light would move the line of each scan line, and what it would add
to each run of pixels beside the line, where a peak could appear. The passes of a wave differ in their random numbers
alone, so that the spread of these numbers is the variance of a pass, whatever its pixels have in common.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaincinv

from render.base.arrays import Float, Float32, Int, Long
from render.base.nonzero import nonzero_places
from render.base.threads import map_chunks
from render.importance import CELL, Importance
from render.laser_indirect.connection_buffer import BLOCK, PassBuffer
from render.laser_indirect.line_pools import UNMET, pooled, pooled_alike
from render.laser_indirect.line_sums import BLOCKS_A_CHUNK, mean_image, run_means, run_variances, smoothed

Weigh = Callable[[Float32], Importance]
"""Where errors matter, by the reflected light (h, w) of a laser so far."""

CONFIDENCE = 0.95
"""That the deviation is as small as the goal asks, before the render ends. A rare bright path is in the sums of many
lines, so that all of them together may have no more degrees of freedom than one."""
FAR = 8.0
"""Times the light paths after which the render ends in any case: more of them put the goal out of reach. Guided by it
the variance falls sooner than the first passes say, as much as tenfold where rows glitter."""
LOOK_SIGMA = 2.0
"""px; the light of a few passes is smoothed so far before a line is looked for in it."""


@dataclass(frozen=True)
class Projection:
    """Where one laser's light counts: (h, w) weights as the lists of their pixels."""

    pixel: Int
    """(m,) where `weight` is not zero."""
    weight: Float
    """(m,) of the line's position."""
    line: Int
    """(m,) its scan line."""
    lit: NDArray[np.bool_]
    """(lines,) with a line."""
    peaks: Float32
    """(blocks, BLOCK) weights where peaks could appear; (0, BLOCK): nowhere."""
    block_row: Long
    """(blocks,) the row of the image that a block begins in."""

    @classmethod
    def of(cls, importance: Importance, laser: int) -> Projection:
        """Of the weights of one laser."""
        weight = importance.laser[laser]
        height, width = weight.shape
        pixel = nonzero_places(weight)
        line = pixel // width if importance.axis == "rows" else pixel % width
        lines = height if importance.axis == "rows" else width
        lit = np.zeros(lines, np.bool_)
        lit[line] = True
        blocks = -(-weight.size // BLOCK)
        peaks = importance.peaks[laser].ravel() if importance.peaks else np.zeros(0, np.float32)
        if len(peaks) % BLOCK:
            peaks = np.pad(peaks, (0, -len(peaks) % BLOCK))
        rows = np.arange(blocks) * BLOCK // width
        return cls(
            pixel, weight.ravel()[pixel].astype(np.float64), line, lit, peaks.reshape(len(peaks) // BLOCK, BLOCK), rows
        )

    def line_means(self, image: Float | Float32) -> Float:
        """(pixels,) -> (lines,) mean over the pixels that each line is measured on; 0: there are none."""
        counts = np.bincount(self.line, minlength=len(self.lit))
        return np.asarray(np.bincount(self.line, image[self.pixel], len(self.lit)) / np.maximum(counts, 1))

    def moves(self, image: Float32) -> Float:
        """(lines,) how far the light of an image (pixels,) moves each line, over the allowed deviation."""
        moved = self.weight * image[self.pixel]
        return np.bincount(self.line, moved, len(self.lit)).astype(np.float64)


@dataclass
class LineErrors:
    """The variance of what counts, of one laser's light so far; grows by waves."""

    projection: Projection
    shape: tuple[int, int]
    moved: Float
    """(lines,) variance of the weighted sum of the passes, over lines that are alike."""
    alone: Float
    """(lines,) the same of each line alone, on whatever weights: it says which are alike."""
    risen: Float32
    """(blocks, BLOCK / CELL) of the sum of what counts beside the line."""
    waves: int = 0
    measured: float = 0.0
    """What the waves add to the variance whose spread was taken, in that of a pass of unit size and weight."""
    squares: float = 0.0
    """The sum of the squares of what each wave adds, over the degrees of freedom of its spread."""
    all_waves: float = 0.0
    """The same of all waves; some were projected onto other weights."""
    worst_rise: float = 0.0
    """What all rows of the image but the share UNMET have at most in `risen`."""
    out_of_reach: bool = False
    """The goal would take far more than is allowed: the errors of the image are the goal."""

    @classmethod
    def of(cls, importance: Importance, laser: int) -> LineErrors:
        """Before the first wave."""
        projection = Projection.of(importance, laser)
        height, width = importance.laser[laser].shape
        lines, risen = len(projection.lit), np.zeros((len(projection.peaks), BLOCK // CELL), np.float32)
        return cls(projection, (height, width), np.zeros(lines), np.zeros(lines), risen)

    def look(self, buffers: list[PassBuffer], weigh: Weigh, laser: int) -> LineErrors:
        """Projected anew, by the light of some passes, before any wave is added."""
        light = smoothed(mean_image(buffers).reshape(self.shape), LOOK_SIGMA)
        return LineErrors.of(weigh(light), laser)

    def spread(self, buffers: list[PassBuffer]) -> tuple[Float, Float32]:
        """(lines,), (blocks, BLOCK / CELL) variance of a pass, of how far its light moves lines and adds to peaks."""
        moves = np.stack([self.projection.moves(buffer.image) for buffer in buffers])
        rises = np.zeros(self.risen.shape, np.float32)
        if len(self.projection.peaks):
            touched = np.flatnonzero(np.any([buffer.touched for buffer in buffers], axis=0))
            images, weights = tuple(buffer.image for buffer in buffers), self.projection.peaks
            map_chunks(partial(run_variances, images, weights, touched, rises), len(touched), BLOCKS_A_CHUNK)
        return np.var(moves, axis=0, ddof=1), rises

    def add(self, buffers: list[PassBuffer], weight: float, size: float) -> tuple[Float, Float32]:
        """Take the spread of a wave's passes, which is returned; weight: of each of them; size: of a pass, in that of
        the first wave."""
        passes = len(buffers)
        share, lit = weight**2 * passes / size, self.projection.lit
        moves, rises = self.spread(buffers)
        moved = weight**2 * passes * moves
        # three degrees of freedom a wave say little of a single line; a few bad ones are not to speak for all about
        # them, so later waves take those together that were known alike without this one
        self.moved += pooled_alike(moved, self.alone, lit) if self.alone.any() else pooled(moved, lit)
        self.alone = self.alone + moved
        self.waves, self.measured, self.all_waves = self.waves + 1, self.measured + share, self.all_waves + share
        self.squares += share**2 / (passes - 1)
        self.risen += np.float32(weight**2 * passes) * rises
        self.worst_rise = self._worst_rise()
        return moves, rises

    def _worst_rise(self) -> float:
        rows = np.zeros(self.shape[0])
        if len(self.risen):
            # blocks are in the order of the rows that they begin in
            begin = np.flatnonzero(np.diff(self.projection.block_row, prepend=-1))
            rows[self.projection.block_row[begin]] = np.maximum.reduceat(self.risen.max(axis=1), begin)
        return all_but_unmet(rows)

    @property
    def margin(self) -> float:
        """`margin_of` the degrees of freedom of the waves' spreads, weighed as they are (Welch 1947; Satterthwaite
        1946)."""
        return margin_of(self.measured**2 / self.squares)

    def error(self, weights: float) -> float:
        """Deviation that the lines have at most, with `CONFIDENCE`, over the allowed one; as `deviation`."""
        return self.margin * self.deviation(weights) if self.measured else math.inf

    def deviation(self, weights: float) -> float:
        """Estimated deviation, over the allowed one, of all lines but the share UNMET; weights: sum over all passes."""
        if not self.measured:
            return math.inf
        scale = self.all_waves / self.measured / weights**2
        worst = max(all_but_unmet(self.moved[self.projection.lit]), self.worst_rise)
        return math.sqrt(scale * worst)

    def unknown(self, weights: float) -> int:
        """Lit lines whose own estimated deviation is above the allowed one; weights: as for `deviation`."""
        lit = self.projection.lit
        if not self.measured:
            return int(lit.sum())
        return int(np.sum(self.moved[lit] * self.all_waves / self.measured > weights**2))

    def judge(self, error: float, image_error: float, paths: int, most: float) -> None:
        """Whether the goal is out of reach, from how far it and that of the image are exceeded after so many light
        paths; the render ends by the image's error or after `most`."""
        end = min(most, paths * image_error**2)
        self.out_of_reach |= math.isfinite(error) and paths * error**2 > FAR * end

    def arrays(self) -> dict[str, NDArray[Any]]:
        """What a checkpoint keeps."""
        weight = np.zeros(self.shape, np.float32)
        weight.ravel()[self.projection.pixel] = self.projection.weight
        peaks = self.projection.peaks.ravel()[: weight.size].reshape(self.shape) if len(self.projection.peaks) else None
        return {
            "line_weight": weight,
            "line_peaks": np.zeros((0, 0), np.float32) if peaks is None else peaks,
            "line_moved": self.moved,
            "line_alone": self.alone,
            "line_risen": self.risen,
            "line_numbers": np.array([self.waves, self.measured, self.squares, self.all_waves, self.out_of_reach]),
        }

    @classmethod
    def of_arrays(cls, arrays: dict[str, NDArray[Any]]) -> LineErrors:
        """The inverse. KeyError, ValueError: they are of something else."""
        weight, peaks, moved = arrays["line_weight"], arrays["line_peaks"], arrays["line_moved"]
        axis: Literal["rows", "columns"] = "rows" if len(moved) == len(weight) else "columns"
        importance = Importance((weight,), weight, axis, (peaks,) if peaks.size else ())
        waves, measured, squares, all_waves, out_of_reach = arrays["line_numbers"].tolist()
        found = cls.of(importance, 0)
        found.moved, found.alone, found.risen = moved.copy(), arrays["line_alone"].copy(), arrays["line_risen"].copy()
        found.waves, found.measured, found.all_waves = int(waves), measured, all_waves
        found.squares = squares
        found.out_of_reach, found.worst_rise = bool(out_of_reach), found._worst_rise()
        return found


def margin_of(freedom: float) -> float:
    """What a deviation is at most, over one told by so many degrees of freedom, with `CONFIDENCE`: by chi-square."""
    return math.sqrt(0.5 * freedom / float(gammaincinv(0.5 * freedom, 1.0 - CONFIDENCE)))


@dataclass(frozen=True)
class Effect:
    """What light of a kind does to the line and its rivals, by a few passes alike."""

    projection: Projection
    moves: list[Float]
    """(lines,) of each pass."""
    rises: Float
    """(blocks, BLOCK / CELL) of all passes, their mean."""

    @classmethod
    def of(cls, projection: Projection, buffers: list[PassBuffer]) -> Effect:
        """Of some passes."""
        moves, rises = [projection.moves(buffer.image) for buffer in buffers], np.zeros((1, 1))
        if len(projection.peaks):
            touched = np.flatnonzero(np.any([buffer.touched for buffer in buffers], axis=0))
            rises = np.zeros((len(projection.peaks), BLOCK // CELL))
            images, weights = tuple(buffer.image for buffer in buffers), projection.peaks
            map_chunks(partial(run_means, images, weights, touched, rises), len(touched), BLOCKS_A_CHUNK)
        return cls(projection, moves, rises)

    def most(self, without: Effect | None = None) -> float:
        """The most that the light may well move any line, by its standard error, or add to a peak, over what is
        allowed; without: less what other passes of the same random numbers do."""
        moves, rises = np.stack(self.moves), self.rises
        if without is not None:
            moves, rises = moves - np.stack(without.moves), rises - without.rises
        lit = self.projection.lit
        moves = np.stack([pooled(one, lit) for one in moves])
        error = moves.std(axis=0, ddof=1) / math.sqrt(len(moves))
        moved = (np.abs(moves.mean(axis=0)) + 2.0 * error)[lit]
        return max(float(moved.max(initial=0.0)), float(rises.max(initial=0.0)))


def all_but_unmet(values: Float) -> float:
    """What all but the share UNMET of some values are at most; 0: there are none."""
    return float(np.quantile(values, 1.0 - UNMET, method="lower")) if len(values) else 0.0
