"""Learns from which directions light comes that moves the lines which need most samples (`directions.py`).

What counts is not how bright a direction is but how far it moves the line: all pixels of a line have the same random
numbers, so that the sum M of their weighted lights, sample by sample, is what one direction does. A pdf in proportion
to the root of the mean of (M p)^2, p the pdf with which the direction was drawn, leaves least variance; it is averaged
over cells and over GROUP lines. The samples that are learned from are no others' and serve for nothing else.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.ndimage import gaussian_filter

from render.ambient.directions import BANDS, CELLS, SECTORS, Draws, Guide, cells_of
from render.ambient.path_kernels import Film
from render.ambient.path_tracer import WAVEFRONT, CameraPaths, FirstWays
from render.base.arrays import Bool, Float, Float32, Int, Long
from render.run import Run

SAMPLES, ROUNDS = 64, 2
"""Of each half of every pixel in a round; rounds, all but the first guided by those before."""
SHARE = 0.7
"""Of the directions that are drawn by the guide. Least variance of 0.5, 0.7, 0.8 on the shiny weld seam."""
GROUP = 16
"""Scan lines that share a distribution. From 8 to 64 it hardly matters on the shiny weld seam."""
SMOOTHED, UNIFORM = 0.7, 0.02
"""Cells, standard deviation of the filter over what is learned; share that stays uniform. Chosen, not tuned."""
GAIN = 1.2
"""Of the variance without a guide, up to which the lines of a group are guided: few samples tell it to some tenths, and
of the guide before the last. Chosen, not tuned."""
MOST_PIXELS = WAVEFRONT // (2 * SAMPLES)
"""Of a line: one with more is not guided."""


class Moved(NamedTuple):
    """What the samples of some lines do to them, one by one."""

    squares: Float
    """(lines, samples) of how far what comes by way of two and more surfaces moves the line."""
    direction: Float32
    """(lines, samples, 3) from the first surface, of the heaviest pixel."""
    pdf: Float32
    """(lines, samples) of that, 1/sr."""
    variance: Float
    """(lines,) of how far the light of single samples moves the line."""


@dataclass(frozen=True)
class GuidedPixels:
    """The pixels of the lines to be guided, line by line."""

    pixels: Int
    """(n,) of the image."""
    keys: Int
    """(n,) the same for all of a line."""
    line: Long
    """(n,) numbered from 0, ascending."""
    group: Int
    """(lines,) the row of the guide."""
    weights: tuple[Float, ...]
    """For each laser (n,) how far light in a pixel moves its line."""
    heaviest: Long
    """(lines,) place of the pixel with the largest weight."""


def learned_guide(paths: CameraPaths, lines: GuidedPixels, rounds: list[int], run: Run) -> tuple[Float, Bool]:
    """(groups, CELLS + 1) cumulative distributions over directions, and (groups,) whether their lines scatter less.

    rounds: what the keys are raised by in each. Raises Cancelled.
    """
    groups = int(lines.group.max()) + 1
    size = np.bincount(lines.line)
    chunk = (np.cumsum(size) - size) // max(1, MOST_PIXELS - int(size.max()) + 1)
    edges = np.append(np.flatnonzero(np.diff(chunk, prepend=-1)), len(size))
    guide, scattered = Draws(lines.keys).guide, []
    for raised in rounds:
        moments, variance = np.zeros((groups, CELLS)), np.zeros(groups)
        draws = Draws((lines.keys + np.int32(raised)).astype(np.int32), guide)
        for (start, stop), moved in zip(pairwise(edges), _moved_by(paths, lines, edges, draws, run), strict=True):
            group = lines.group[start:stop]
            _add_moments(moved, group, moments)
            np.add.at(variance, group, moved.variance)
        scattered.append(variance)
        guide = Guide(cumulative_of(moments), lines.group[lines.line].astype(np.int32), SHARE)
    return guide.cumulative, moments.any(axis=1) & (scattered[-1] < GAIN * scattered[0])


def _moved_by(paths: CameraPaths, lines: GuidedPixels, edges: Long, draws: Draws, run: Run) -> list[Moved]:
    """`_moved` of the lines between edges (n + 1,), in their order. Raises Cancelled."""
    found: dict[int, Moved] = {}

    def work(start: int, stop: int) -> None:
        for i in range(start, stop):
            found[i] = _moved(paths, lines, int(edges[i]), int(edges[i + 1]), draws, run)

    run.map(work, len(edges) - 1, 1)
    return [found[i] for i in range(len(edges) - 1)]


def _moved(paths: CameraPaths, lines: GuidedPixels, start: int, stop: int, draws: Draws, run: Run) -> Moved:
    some = np.arange(*np.searchsorted(lines.line, (start, stop)))
    each = np.repeat(some, SAMPLES)
    first = np.tile(np.arange(SAMPLES, dtype=np.int32), len(some))[:, None].repeat(2, axis=1)
    film, ways = Film(np.zeros((2 * len(each), 4)), np.zeros(2)), FirstWays(2 * len(each))
    paths.add(lines.pixels[each], first, np.ones_like(first), film, run.cancelled, draws.of(each), ways)
    light = film.sums[:, :3].sum(axis=1)
    onward, line = light - ways.before, lines.line[some] - start
    squares, variance = np.zeros((stop - start, 2 * SAMPLES)), np.zeros(stop - start)
    for weight in lines.weights:
        of_line = [_of_lines(weight[some], one.reshape(len(some), -1), line, stop - start) for one in (onward, light)]
        squares += of_line[0] ** 2
        variance += of_line[1].var(axis=1)
    heaviest = lines.heaviest[start:stop] - some[0]
    direction = ways.direction.reshape(len(some), -1, 3)[heaviest]
    return Moved(squares, direction, ways.pdf.reshape(len(some), -1)[heaviest], variance)


def _of_lines(weight: Float, light: Float, line: Long, lines: int) -> Float:
    """(lines, samples) how far the light (n, samples) of pixels moves their lines."""
    moved = np.zeros((lines, light.shape[1]))
    np.add.at(moved, line, weight[:, None] * light)
    return moved


def _add_moments(moved: Moved, group: Int, moments: Float) -> None:
    """Add what samples do to the second moments (groups, CELLS) of the directions that they took."""
    # a direction that was drawn with density p is met p times as often: of (M p)^2 one p is left
    there = (moved.pdf > 0.0) & (moved.squares > 0.0)
    of_group = np.broadcast_to(group[:, None], there.shape)[there]
    np.add.at(moments, (of_group, cells_of(moved.direction[there])), moved.squares[there] * moved.pdf[there])


def cumulative_of(moments: Float) -> Float:
    """Second moments (groups, CELLS) -> cumulative distributions (groups, CELLS + 1), even where nothing was met."""
    root = np.sqrt(moments).reshape(-1, BANDS, SECTORS)
    smooth = gaussian_filter(root, (0.0, SMOOTHED, SMOOTHED), mode=("nearest", "nearest", "wrap")).reshape(
        moments.shape
    )
    total = smooth.sum(axis=1, keepdims=True)
    share = np.where(total > 0.0, smooth / np.where(total > 0.0, total, 1.0), 1.0 / CELLS)
    cumulative = np.cumsum((1.0 - UNIFORM) * share + UNIFORM / CELLS, axis=1)
    return np.concatenate([np.zeros((len(moments), 1)), cumulative / cumulative[:, -1:]], axis=1)
