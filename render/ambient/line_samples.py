"""Samples where errors of the ambient light move a measured line, until each scan line is known well enough.

What moves a line is the difference between the light on its two sides. All pixels that a line is measured on therefore
have the same random numbers and as many samples (common random numbers; Glasserman, Monte Carlo Methods in Financial
Engineering, 2004, section 4.2): what their errors have in common moves no line. How far that leaves a line to be moved
is told by batches of samples (`line_moves.py`).

A pixel's own error counts too, where it may make a peak. With weights w (`render.importance`), the variance v of one
sample of a pixel and n samples on it, a scan line is known once the sum of w^2 v / n over its pixels is at most 1. The
fewest samples that do so are, by Lagrange's multipliers,

    n_p = w_p sqrt(v_p)  sum over q of w_q sqrt(v_q)

v is found from the samples themselves: of a half, the squared difference between its last samples and those before,
averaged over neighbouring pixels. That of one half decides where the other is sampled, so that this does not depend on
the values that are averaged there.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import count as count_from

import numba
import numpy as np

from render.ambient.coarse_image import TILE, CoarseImage
from render.ambient.directions import NO_GUIDE, Draws, Guide
from render.ambient.integrator import CONVERGENCE
from render.ambient.line_directions import GROUP, MOST_PIXELS, ROUNDS, SAMPLES, SHARE, GuidedPixels, learned_guide
from render.ambient.line_moves import LineMoves
from render.ambient.path_tracer import CameraPaths
from render.ambient.pixel_samples import PixelSamples
from render.base.arrays import Bool, Float, Int, Long
from render.base.threads import map_chunks
from render.importance import Importance, known_below
from render.run import Run

MARGIN = 1.4
"""By which the variance of a scan line is to be less than allowed: it is known to about a sixth only."""
ENOUGH = 0.05
"""Of what a scan line may be off, by the error of the coarse image in one pixel: where it is less, that is enough."""
AROUND = 3
"""Pixels on each side of those with weight that are sampled as well, so that what a lens blurs into them is no mere
interpolation."""
REACH, POOLED = 2, 1 << 14
"""Pixels on each side over which variances are averaged, and pixels that a thread does so for at a time."""
PILOT, GROWTH, PASSES = 2, 4.0, 12
"""Samples of each half on every pixel at first; most by which a pass multiplies those of a scan line; most passes."""
LEARNS, WORTH, AGAIN = 2, 256, 3
"""Pass after which a guide of directions is learned; samples of each half on every pixel of a line from which it is
worth its own; batches in which as many guided samples are drawn as there were before."""
FAR = 8.0
"""Times the samples of a line that may just not miss the goal: lines that need more are out of its reach."""
LITTLE = 0.005
"""Of all samples so far: a pass that asked for no more is the last. Chosen, not tuned."""
SURE, SURE_LINES = 0.05, 0.99
"""Of the variance that a scan line may have, and share of the lines: where a single sample of each half tells less of
so many, no more are drawn. Of one line they tell little, as light through a gap is met by one sample in many."""


@dataclass(frozen=True)
class Band:
    """The pixels that are sampled one by one."""

    pixels: Int
    """(m,), in the order of the image."""
    weight: Float
    """(m,) of a pixel's own error, 1 / (W/(m^2 sr)), 0 beside those that matter."""
    moves: tuple[Float, ...]
    """For each laser (m,) how far light moves its line, with its sign; 0 where its line is not measured."""
    line: Int
    """(m,) the scan line of each."""
    keys: Int
    """(m,) the numbers that random numbers follow from, in the first batch: above those of the pixels, the same for all
    that a line is measured on."""
    place: Int
    """(h, w) of each pixel in `pixels`, -1: it is none of them."""


def band_of(importance: Importance, coarse: CoarseImage, threads: int | None = None) -> Band:
    """Where the error of the coarse image would matter, and all that a line is measured on which it matters to."""
    weight, (height, width) = importance.ambient, importance.ambient.shape
    column, lines = np.arange(width) // TILE, height if importance.axis == "rows" else width
    wide = np.empty((height, width), np.bool_)

    def work(start: int, stop: int) -> None:
        off = coarse.deviation[np.arange(start, stop) // TILE][:, column]
        wide[start:stop] = np.abs(weight[start:stop]) * off > ENOUGH

    map_chunks(work, height, TILE, threads)
    matters = np.flatnonzero(wide)
    moves, measured = [], []
    for move in importance.ambient_moves:
        on = np.flatnonzero(move)
        line = on // width if importance.axis == "rows" else on % width
        off = coarse.deviation[on // width // TILE, on % width // TILE]
        unknown = np.bincount(line, np.abs(move.ravel()[on]) * off > ENOUGH, lines) > 0.0
        unknown |= coarse.taken_over
        measured.append(on[unknown[line]])
    near = _around(np.concatenate([np.zeros(0, np.int64), *measured]), wide.shape)
    pixels = np.flatnonzero(near | _around(matters, wide.shape)).astype(np.int32)
    place = np.full(weight.shape, -1, np.int32)
    place.ravel()[pixels] = np.arange(len(pixels), dtype=np.int32)
    line = pixels // width if importance.axis == "rows" else pixels % width
    keys = np.where(near[pixels], np.int32(weight.size) + line, pixels).astype(np.int32)
    alone = np.where(wide.ravel()[pixels], np.abs(weight.ravel()[pixels]), 0.0).astype(np.float64)
    for move, on in zip(importance.ambient_moves, measured, strict=True):
        moves.append(np.zeros(len(pixels)))
        moves[-1][place.ravel()[on]] = move.ravel()[on]
    return Band(pixels, alone, tuple(moves), line, keys, place)


def _around(pixels: Long, shape: tuple[int, int]) -> Bool:
    """(h * w,) the pixels (n,) of an image and all within AROUND of them, along rows and columns taken together."""
    height, width = shape
    mask, row, column = np.zeros(height * width, np.bool_), pixels // width, pixels % width
    for down in range(-AROUND, AROUND + 1):
        for right in range(-AROUND + abs(down), AROUND - abs(down) + 1):
            there = (row + down >= 0) & (row + down < height) & (column + right >= 0) & (column + right < width)
            mask[(pixels + down * width + right)[there]] = True
    return mask


def sample_band(film: PixelSamples, paths: CameraPaths, band: Band, most: int, run: Run) -> Float:
    """Samples of the band, of whose pixels the film is, until each scan line meets the goal, or `most` are spent.

    Returns (n,) standard deviation of each line with weight over the allowed one, in the colour that is known worst.
    Raises Cancelled.
    """
    lines = max(band.place.shape)
    moves, guide, batches = LineMoves(band.moves, band.line, lines), NO_GUIDE, count_from(0)

    def add(count: Int, part: Run) -> None:
        sums, more = film.sums.copy(), count - film.done
        new = np.flatnonzero(more.any(axis=1))
        film.add(paths, band.pixels[new], count[new], part, _draws(band, next(batches), guide).of(new))
        settled = film.means(band.pixels[moves.on[~moves.open]]).mean(axis=1)
        moves.add(film.sums - sums, more, settled)

    def known() -> Float:
        some = np.unique(band.line[(band.weight > 0.0) | moves.measured])
        return np.asarray(np.maximum(_moments(film, band, run.threads), moves.variance)[some])

    for level in range(PILOT):
        add(np.full((len(band.pixels), 2), level + 1, np.int32), run.between(0.0, 0.3))
        if level == 0 and np.mean(known() <= SURE) >= SURE_LINES:
            return np.sqrt(known())
    for level in range(PASSES):
        count = _wanted(film, band, moves, run.threads)
        more = count - film.done
        left, asked = max(most - film.total, 0), more.sum(dtype=np.int64)
        if asked > left:
            count = film.done + (more * (left / asked)).astype(np.int32)
        add(count, run.between(0.3, 1.0))
        if asked <= LITTLE * film.total:
            break
        if level == LEARNS:
            learned = _learn(film, paths, band, moves, [next(batches) for _ in range(ROUNDS)], run.between(0.3, 0.5))
            if learned is not None:
                guide, anew = learned
                for part in range(1, AGAIN + 1):
                    add(np.maximum(film.done, anew * part // AGAIN), run.between(0.3, 1.0))
    return np.sqrt(known())


def _draws(band: Band, batch: int, guide: Guide) -> Draws:
    """Of the band's pixels in a batch: those that a line is measured on have other random numbers in each."""
    raised = band.keys + np.int32(batch * max(band.place.shape))
    return Draws(np.where(band.keys < band.place.size, band.keys, raised), guide)


def _learn(
    film: PixelSamples, paths: CameraPaths, band: Band, moves: LineMoves, batches: list[int], run: Run
) -> tuple[Guide, Int] | None:
    """A guide for the lines that need so many samples that it is worth it; None: there are none.

    Their samples so far, far more scattered than guided ones, are forgotten: (m, 2) as many are to be drawn anew.
    Raises Cancelled.
    """
    now = film.done[moves.first_pixel, 0].astype(np.float64)
    needed = np.where(moves.pixels > 0, _needed(now, MARGIN * moves.variance, np.inf), 0.0)
    guided = (needed >= WORTH) & (moves.pixels <= MOST_PIXELS)
    if not guided.any():
        return None
    some = moves.on[guided[moves.line] & moves.open]
    some = some[np.argsort(band.line[some], kind="stable")]
    of_lines, line = np.unique(band.line[some], return_inverse=True)
    _, group = np.unique(of_lines // GROUP, return_inverse=True)
    heaviest = np.argsort(some)[np.searchsorted(np.sort(some), moves.first_pixel[of_lines])]
    weights = tuple(move[some] for move in band.moves)
    lines = GuidedPixels(band.pixels[some], band.keys[some], line, group.astype(np.int32), weights, heaviest)
    cumulative, worth = learned_guide(paths, lines, [batch * max(band.place.shape) for batch in batches], run)
    film.apart += 2 * ROUNDS * SAMPLES * len(some)
    if not worth.any():
        return None
    some, group = some[worth[group][line]], group[line][worth[group][line]]
    guided[of_lines[~worth[lines.group]]] = False
    row, anew = np.full(len(band.pixels), -1, np.int32), np.zeros_like(film.done)
    row[some], anew[some] = group, film.done[some]
    film.forget(band.pixels[some])
    moves.forget(guided)
    return Guide(cumulative, row, SHARE), anew


def _moments(film: PixelSamples, band: Band, threads: int | None) -> Float:
    """Of each scan line of the image the sum of weight^2 times variance, in the colour that is known worst."""
    heavy = np.flatnonzero(band.weight)
    if not len(heavy):
        return np.zeros(max(band.place.shape))
    variance = _variance(film, band, heavy, threads)
    weight, line = band.weight[heavy] ** 2, band.line[heavy]
    return np.max([np.bincount(line, weight * colour, max(band.place.shape)) for colour in variance.T], axis=0)


def _variance(film: PixelSamples, band: Band, some: Long, threads: int | None) -> Float:
    """(n, 3) of the means of some of the band's pixels, by what both halves differ by there and beside them."""
    halves, count = film.means().astype(np.float64), 1.0 / film.done
    single = (halves[:, 0] - halves[:, 1]) ** 2 / count.sum(axis=1)[:, None]
    return _pooled(single, band, some, threads) * count[some].sum(axis=1)[:, None] / 4.0


def _wanted(film: PixelSamples, band: Band, moves: LineMoves, threads: int | None) -> Int:
    """(m, 2) samples of each half for the scan lines to meet the goal: as many on all pixels that a line is measured
    on, beside them as the other half's variance says."""
    done, heavy = film.done, np.flatnonzero(band.weight)
    moments, moved = MARGIN * _moments(film, band, threads), MARGIN * moves.variance
    lines = len(moments)
    alone, spent_alone, deviation = np.zeros((2, lines)), np.zeros((2, lines)), np.zeros((2, 0))
    if len(heavy):
        spread = film.spread.astype(np.float64)
        deviation = np.sqrt([_pooled(spread[:, other], band, heavy, threads).max(axis=1) for other in (1, 0)])
        deviation *= band.weight[heavy]
        total = _of_lines(deviation, band.line[heavy], lines)
        spent_alone = _of_lines(done[heavy].T, band.line[heavy], lines)
        alone = _needed(spent_alone, moments, MARGIN * total**2 / 2.0)
    pixels = np.bincount(moves.line[moves.open], minlength=lines)
    each_now = np.where(moves.pixels > 0, done[moves.first_pixel, 0], 0).astype(np.float64)
    each = _needed(each_now, moved, np.inf)
    # those that may miss the goal get as much as the others at most; where that is nothing beside what they need, and
    # most of all samples would not get them there, as much as the others have
    asked = alone.sum(axis=0) + 2.0 * pixels * each
    spent = spent_alone.sum(axis=0) + 2.0 * pixels * each_now
    some = spent > 0.0
    most = known_below(asked[some])
    far = asked > FAR * most
    share = np.where(far, spent[some & ~far].mean() if some.any() else 0.0, most)
    capped = np.minimum(1.0, share / np.maximum(asked, 1.0))
    each = _step(each_now, each, moved, capped)
    wanted = done.copy()
    if len(heavy):
        alone = _step(spent_alone, alone, moments, capped)
        each_pixel = (alone / np.maximum(total, 1e-300))[:, band.line[heavy]] * deviation
        wanted[heavy] = np.maximum(done[heavy], np.ceil(each_pixel).T.astype(np.int32))
        np.maximum.at(each, moves.line[moves.open], wanted[moves.on[moves.open]].max(axis=1))
    each = np.maximum(each_now, np.ceil(each))
    more = np.flatnonzero(moves.open & (each > each_now)[moves.line])
    moves.settle(more, _variance(film, band, moves.on[more], threads).max(axis=1))
    # as many of both halves, on all that a line is measured on and that is not settled
    wanted[moves.on[moves.open]] = each[moves.line[moves.open], None]
    return wanted


def _of_lines(halves: Float | Int, line: Int, lines: int) -> Float:
    """Sums (2, lines) of both halves (2, n) of pixels."""
    return np.array([np.bincount(line, half, lines) for half in halves])


def _needed(now: Float, moments: Float, most: Float | float) -> Float:
    """(..., lines) samples for the lines whose variance is `moments` by those so far to have 1."""
    return np.minimum(most, now * np.maximum(moments, 1.0) ** (0.5 / CONVERGENCE))


def _step(now: Float, needed: Float, moments: Float, capped: Float) -> Float:
    """(..., lines) samples after the next pass, 0: no more are asked; a few at least, unless the line is capped."""
    some = np.clip(needed, 1.25 * now, GROWTH * now)
    left = np.where(capped * needed > now, np.minimum(capped * needed, some), 0.0)
    return np.where(moments > 1.0, np.where(capped < 1.0, left, some), 0.0)


def _pooled(values: Float, band: Band, some: Long, threads: int | None) -> Float:
    """Values (m, 3) of the band's pixels -> (n, 3) of some of them, each averaged with its neighbours'."""
    out = np.empty((len(some), 3))
    values, pixels = np.ascontiguousarray(values), band.pixels[some]
    map_chunks(lambda a, b: pool(values, pixels[a:b], band.place, out[a:b]), len(some), POOLED, threads)
    return out


@numba.njit(nogil=True, cache=True, error_model="numpy")
def pool(values: Float, pixels: Int, place: Int, out: Float) -> None:
    """Values (m, c) -> out (n, c): of the pixels (n,), averaged over those within REACH; place (h, w) as in `Band`."""
    height, width = place.shape
    for r in range(pixels.shape[0]):
        row, column, count = pixels[r] // width, pixels[r] % width, 0
        out[r] = 0.0
        for i in range(max(row - REACH, 0), min(row + REACH + 1, height)):
            for j in range(max(column - REACH, 0), min(column + REACH + 1, width)):
                q = place[i, j]
                if q >= 0:
                    count += 1
                    for c in range(values.shape[1]):
                        out[r, c] += values[q, c]
        for c in range(values.shape[1]):
            out[r, c] /= count
