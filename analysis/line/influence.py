"""How far each pixel moves the measured line: the derivative of every scan line's position by its pixels' electrons.

Of maximum likelihood in closed form. With p = amplitude, centre, width, background, mu_i the model and v_i the variance
of pixel i, a fit moves by

    dp / dy_i  =  H^-1  dmu_i/dp  / v_i,        H = sum over i of dmu_i/dp (dmu_i/dp)^T / v_i

(the influence function of an M-estimator at its own model; Huber, Robust Statistics, 1981, section 3.2). What is
flagged as no single line moves about as the one that is fitted to it. Lines too narrow for their pixels have the
position of a posterior (`posterior_influence`). Of all other methods by central differences of the method itself.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.special import erf

from analysis.line.detection.channel import Lines, scan_lines
from analysis.line.detection.detect import CENTRE, PLATEAU, SEED_COLUMNS, WIDTH, Limits, detect
from analysis.line.detection.detect import REACH as SEED_REACH
from analysis.line.detection.noise import NoiseModel
from analysis.line.measure import METHODS, limits_of, measure, measure_with_neighbours
from analysis.line.methods.narrow_line import COARSE, NARROWEST
from analysis.line.mosaic import seen_only
from analysis.line.posterior_influence import posterior_influence
from analysis.line.result import NEIGHBOURS, Flag, Line
from analysis.line.settings import ExtractionSettings
from render.base.arrays import Float, Float32
from render.base.threads import map_chunks, rows_of

Int = NDArray[np.int64]
Flags = NDArray[np.uint8]

REACH, PLATEAU_REACH, EDGE = 4.0, 2.5, 1.5
"""Sigmas, sigmas from a saturated plateau, and pixels on either side of a line that its fit looks at
(`methods.gaussian_fit`)."""
SEEDS = 5
"""Peaks of a scan line among which the one that was measured is found again."""
WIDEST = 64
"""px; farther from a line no pixel is tried."""
STEP = 0.01
"""Of the line's amplitude: the differences' step."""
AT_ONCE = 1024
"""Scan lines that are held with one pixel changed: 20 MB of 2448 px."""
ROWS = 64
PIXELS = 1 << 17
"""Scan lines that are read at a time, at least, and their pixels."""
TRIED = 64
"""Scan lines on which differences are taken; others take their nearest one's, at their own place and brightness."""


def influence(
    image: NDArray[Any],
    line: Line,
    settings: ExtractionSettings,
    noise: NoiseModel,
    threads: int | None = None,
    *,
    shared: bool = False,
) -> Float32:
    """Image (h, w) of DN, Line measured in it -> (h, w) px / e-, summed over its peaks; zero far from any.

    settings: those that the line was measured with; `line.method` tells what "auto" picked. Methods that look at
    neighbouring scan lines, or smooth over them, are taken to move with all of these at once. shared: the pixels of a
    narrow line stand for those of the neighbours too that tell its width, as if all had errors of one size.
    """
    chosen = settings.model_copy(update={"method": line.method})
    if line.method == "likelihood":
        chosen = chosen.model_copy(update={"smoothing": 0.0})
    lines = scan_lines(image, chosen, noise)
    if (noise.alike or noise.filled_in) and line.method == "likelihood":
        lines = seen_only(lines, lines.image, chosen, threads)
    found = np.zeros(lines.image.shape, np.float32)
    for k in range(line.u.shape[1]):
        rows = np.flatnonzero(line.valid[:, k])
        if len(rows) and line.method == "likelihood":
            _scatter(found, rows, *likelihood_influence(lines, line, chosen, rows, k, threads, shared=shared))
        elif len(rows):
            alone = _alone(lines, chosen)
            tried = rows[np.unique(np.linspace(0, len(rows) - 1, TRIED).astype(int))] if alone else rows
            place, measured = difference_influence(lines, line, chosen, tried, k, threads)
            # what is twice as bright is moved by twice the light
            measured *= line.amplitude[tried, k][:, None]
            first, weight = _of_nearest(line.u[rows, k], rows, line.u[tried, k], tried, place, measured)
            _scatter(found, rows, first, weight / line.amplitude[rows, k][:, None])
    return found if line.axis == "rows" else np.ascontiguousarray(found.swapaxes(0, 1))


def likelihood_influence(
    lines: Lines,
    line: Line,
    settings: ExtractionSettings,
    rows: Int,
    peak: int,
    threads: int | None = None,
    *,
    shared: bool = False,
) -> tuple[Int, Float]:
    """Rows (n,) of a likelihood line -> first pixel (n,) and weight (n, m) px / e-; zero where a pixel is not used.
    shared: as for `influence`."""
    u, width, height = line.u[rows, peak], line.width[rows, peak], line.amplitude[rows, peak]
    narrow = line.flag[rows, peak] == Flag.UNRESOLVED
    middle, half, windows = _read_windows(lines, limits_of(lines, settings), rows, u, width, threads)
    m = 2 * (int(half.max()) + 1) + 1
    first = np.rint(u).astype(np.int64) - m // 2
    x = first[:, None] + np.arange(m, dtype=np.float64)
    # where no window was read nothing is used, and any noise but none will do
    light, held, covered = np.zeros((len(u), m), np.float32), np.ones((len(u), m)), np.zeros((len(u), m), np.bool_)
    for start, window in windows:
        n, wide = window.electrons.shape
        some = slice(start, start + n), slice((m - wide) // 2, (m + wide) // 2)
        light[some], held[some], covered[some] = window
    used = (np.abs(x - middle[:, None]) <= half[:, None]) & covered
    background, integrated = line.background[rows, peak][:, None], settings.profile == "integrated"
    by_centre, by_background = _fit_influence(
        (x - u[:, None], width[:, None], height[:, None], background, held), used, settings.width is None, integrated
    )
    if narrow.any():
        # their neighbours tell the width that they share, too
        lit = np.zeros(lines.count, np.bool_)
        lit[np.clip(rows[narrow][:, None] + np.arange(-NEIGHBOURS, NEIGHBOURS + 1), 0, lines.count - 1)] = True
        near = np.flatnonzero(narrow | (lit[rows] & (width < COARSE)))
        seen = m // 2 + np.arange(-(reach := int(half[near].max()) + 1), reach + 1)
        part = tuple(array[near][:, seen].astype(np.float64) for array in (x, light, held, used))
        pixels = *part, background[near]
        told = u[near], line.sigma_u[rows[near], peak]
        moved, widened = posterior_influence(pixels, *told, by_background[near][:, seen], settings.width, integrated)
        if shared and line.shared_u is not None:
            variance = np.maximum(part[1] + part[2], 1e-2)
            moved = _with_neighbours(moved, widened, variance, line.shared_u[rows[near], peak])
        by_centre[narrow] = 0.0
        by_centre[np.ix_(narrow, seen)] = moved[narrow[near]]
    return first, by_centre


def _with_neighbours(moved: Float, widened: Float, variance: Float, shared_u: Float) -> Float:
    """How far each pixel moves place and width (n, m), and its variance, e-^2 -> weight (n, m) px / e-, with that of
    the neighbours' pixels as if they were the own ones, whose noise moves the place by shared_u (n,) px.

    They move the place by the width that they tell, so that what changes no line's width has no such effect.
    """
    noise = np.sqrt(np.sum(widened**2 * variance, axis=1))
    more = np.divide(np.abs(shared_u), noise, out=np.zeros_like(noise), where=noise > 0.0)[:, None] * widened
    # of one sign with the own ones, so that together they count for no less
    return moved + np.copysign(1.0, np.sum(moved * more * variance, axis=1))[:, None] * more


class _Window(NamedTuple):
    """What is read about lines, (n, m): all that their fits may look at."""

    electrons: Float32
    floor: Float
    known: NDArray[np.bool_]
    """The pixel is within the image, and nothing is wrong with it."""


def _read_windows(
    lines: Lines, limits: Limits, rows: Int, u: Float, width: Float, threads: int | None
) -> tuple[Float, Float, list[tuple[int, _Window]]]:
    """Rows, positions and widths (n,) -> middle and half (n,) of the pixels that each fit looked at, and those pixels,
    about u, of some rows at a time, with the number of the first."""
    middle, half = np.empty(len(rows)), np.empty(len(rows))
    found: list[tuple[int, _Window]] = []

    def work(start: int, stop: int) -> None:
        part, first = slice(start, stop), rows[start]
        electrons, mask, floor = (array[rows[part] - first] for array in lines.read(first, rows[stop - 1] + 1))
        times = lines.summed(first, rows[stop - 1] + 1)[rows[part] - first, None]
        electrons, floor = electrons / times, floor / times
        middle[part], half[part] = _fit_windows((electrons, mask, floor), limits, u[part], width[part])
        reach = int(half[part].max()) + 1
        x = np.rint(u[part]).astype(np.int64)[:, None] + np.arange(-reach, reach + 1)
        inside = np.clip(x, 0, mask.shape[1] - 1)
        light, wrong = (np.take_along_axis(array, inside, axis=1) for array in (electrons, mask))
        held = np.take_along_axis(floor, np.minimum(inside, floor.shape[1] - 1), axis=1).astype(np.float64)
        found.append((start, _Window(light, held, (x == inside) & (wrong == 0))))

    map_chunks(work, len(rows), rows_of(lines.image.shape[1], ROWS, PIXELS), threads)
    return middle, half, found


def _fit_windows(light: tuple[Float32, Flags, Float32], limits: Limits, u: Float, width: Float) -> tuple[Float, Float]:
    """Electrons, masks and floors of scan lines (n, w), positions and widths (n,) -> middle and half (n,) of the pixels
    that each fit looked at: those of its seed, unless the fit is much narrower or wider (`methods.gaussian_fit`)."""
    seeds, flags = np.zeros((len(u), SEEDS, SEED_COLUMNS)), np.empty((len(u), SEEDS), np.uint8)
    detect(*light, limits, seeds, flags)
    apart = np.abs(seeds[:, :, CENTRE] - u[:, None])
    seed = seeds[np.arange(len(u)), np.argmin(np.where(np.isnan(apart), np.inf, apart), axis=1)]

    def half(sigma: Float) -> Float:
        wanted = np.maximum(REACH * sigma + EDGE, seed[:, PLATEAU] + PLATEAU_REACH * sigma + EDGE)
        return np.asarray(np.ceil(np.minimum(np.minimum(wanted, seed[:, SEED_REACH]), 6.0 * limits.max_width)))

    first, again = half(seed[:, WIDTH]), half(np.maximum(width, NARROWEST))
    kept = (limits.width > 0.0) | ((0.5 * first <= again) & (again <= 1.15 * first + 1.0))
    return np.where(kept, seed[:, CENTRE], u), np.where(kept, first, again)


def _fit_influence(
    model: tuple[Float, Float, Float, Float, Float], used: NDArray[np.bool_], free: bool, integrated: bool
) -> tuple[Float, Float]:
    """Distance (n, m), width, height, background (n, 1), floor (n, m); free: the width is fitted as well -> (n, m) how
    far each pixel moves the centre, px / e-, and the background."""
    distance, width, height, background, floor = model
    g, by_centre, by_width = _profile(distance, width, integrated)
    mu = height * g + background
    weight = np.where(used, 1.0 / np.maximum(np.maximum(mu + floor, 0.1 * np.abs(floor)), 1e-9), 0.0)
    slopes = [g, height * by_centre, np.ones_like(g), *([height * by_width] if free else [])]
    jacobian = np.stack(slopes, axis=2)
    information = np.einsum("nij,nik,ni->njk", jacobian, jacobian, weight)
    scale = np.sqrt(np.maximum(np.einsum("njj->nj", information), 1e-300))
    information /= scale[:, :, None] * scale[:, None, :]
    rows = np.linalg.pinv(information, hermitian=True)[:, 1:3] / scale[:, None, :] / scale[:, 1:3, None]
    moved = np.einsum("npj,nij,ni->pni", rows, jacobian, weight)
    return moved[0], moved[1]


def difference_influence(
    lines: Lines, line: Line, settings: ExtractionSettings, rows: Int, peak: int, threads: int | None = None
) -> tuple[Int, Float]:
    """As `likelihood_influence`, of any method, by central differences of its position."""
    u, width = line.u[rows, peak], line.width[rows, peak]
    reach = REACH * width + EDGE + 1.0
    reach = np.ceil(np.minimum(np.where(np.isnan(reach), np.nanmax(reach), reach), WIDEST)).astype(np.int64)
    widest = int(reach.max())
    first = np.rint(u).astype(np.int64) - widest
    wanted = settings.model_copy(update={"peaks": max(settings.peaks, peak + 1, 5)})
    step = np.maximum(STEP * line.amplitude[rows, peak], 1e-3) * lines.noise.gain
    moves = _moves_of_each if _alone(lines, settings) else _moves_of_all
    weight = np.zeros((len(rows), 2 * widest + 1))
    i, j = np.nonzero(np.abs(np.arange(2 * widest + 1) - widest) <= reach[:, None])
    pixel = first[i] + j
    inside = (pixel >= 0) & (pixel < lines.image.shape[1])
    i, j, pixel = i[inside], j[inside], pixel[inside]
    if lines.noise.saturation is not None:
        below = lines.image[rows[i], pixel] + step[i] < lines.noise.saturation
        i, j, pixel = i[below], j[below], pixel[below]
    # each pixel brighter, then each darker
    both = np.tile(i, 2)
    turn = np.concatenate((j, j + 2 * widest + 1))
    steps = np.concatenate((step[i], -step[i]))
    there, flags = moves(lines, wanted, rows[both], np.tile(pixel, 2), steps, turn, threads)
    nearest = np.argmin(np.abs(there - u[both][:, None]), axis=1)[:, None]
    found = np.take_along_axis(there, nearest, axis=1)[:, 0]
    # what takes the peak for another thing does so by chance, and moves it by no small step
    steady = np.take_along_axis(flags, nearest, axis=1)[:, 0] == line.flag[rows[both], peak]
    up, down = np.split(np.where(steady & np.isfinite(found), found, np.nan), 2)
    weight[i, j] = np.nan_to_num((up - down) / (2.0 * step[i] / lines.noise.gain))
    return first, weight


def _moves_of_each(
    lines: Lines, settings: ExtractionSettings, rows: Int, pixel: Int, step: Float, turn: Int, threads: int | None
) -> tuple[Float, Flags]:
    """Peaks (n, k) px, infinite where none is, and their flags, of scan lines each of which has one pixel changed.

    The neighbours that a narrow line shares its width with stay as they are: they are told nothing by its own pixels.
    """
    tried = np.unique(rows)
    near = np.unique(np.clip(tried[:, None] + np.arange(-NEIGHBOURS, NEIGHBOURS + 1), 0, lines.count - 1))
    _, neighbours = measure_with_neighbours(
        replace(lines, image=lines.image[near]), settings, threads, judge=True, passing=True
    )
    place = np.searchsorted(near, rows)
    peaks, flags = [], []
    for start in range(0, len(rows), AT_ONCE):
        some = slice(start, start + AT_ONCE)
        image = np.ascontiguousarray(lines.image[rows[some]], np.float64)
        image[np.arange(len(image)), pixel[some]] += step[some]
        told = neighbours.of(place[some])
        found, _ = measure_with_neighbours(replace(lines, image=image), settings, threads, judge=True, told=told)
        peaks.append(np.where(found.valid, found.u, np.inf))
        flags.append(found.flag)
    return np.concatenate(peaks), np.concatenate(flags)


def _moves_of_all(
    lines: Lines, settings: ExtractionSettings, rows: Int, pixel: Int, step: Float, turn: Int, threads: int | None
) -> tuple[Float, Flags]:
    """As `_moves_of_each`, of methods that look at neighbours too: the pixels of one `turn` change at once."""
    peaks, flags = np.empty((len(rows), settings.peaks)), np.empty((len(rows), settings.peaks), np.uint8)
    for now in np.unique(turn):
        some = np.flatnonzero(turn == now)
        image = lines.image.astype(np.float64)
        image[rows[some], pixel[some]] += step[some]
        found = measure(replace(lines, image=image), settings, threads, judge=True, passing=True)
        peaks[some], flags[some] = np.where(found.valid, found.u, np.inf)[rows[some]], found.flag[rows[some]]
    return peaks, flags


def _alone(lines: Lines, settings: ExtractionSettings) -> bool:
    """Each scan line is measured by itself, wherever it is in the image."""
    return METHODS[settings.method].halo == 0 and settings.smoothing == 0.0 and lines.pattern is None


def _profile(distance: Float, width: Float, integrated: bool) -> tuple[Float, Float, Float]:
    """A line of unit amplitude at some distances from its centre, and its derivatives by centre and width."""
    if not integrated:
        z = distance / width
        g = np.exp(-0.5 * z * z)
        return g, g * z / width, g * z * z / width
    right, left = (distance + 0.5) / width, (distance - 0.5) / width
    unit = np.sqrt(0.5 * np.pi) * (erf(right * np.sqrt(0.5)) - erf(left * np.sqrt(0.5)))
    at_right, at_left = np.exp(-0.5 * right**2), np.exp(-0.5 * left**2)
    return width * unit, at_left - at_right, unit - (right * at_right - left * at_left)


@njit(nogil=True, cache=True, error_model="numpy")
def _scatter(image: Float32, rows: Int, first: Int, weight: Float) -> None:
    """Add weights (n, m) from pixel `first` (n,) on to rows (n,) of an image."""
    for n in range(weight.shape[0]):
        for k in range(weight.shape[1]):
            x = first[n] + k
            if 0 <= x < image.shape[1] and weight[n, k] != 0.0:
                image[rows[n], x] += np.float32(weight[n, k])


def _of_nearest(u: Float, rows: Int, tried_u: Float, tried: Int, first: Int, weight: Float) -> tuple[Int, Float]:
    """The weights (k, m) of the scan lines that were tried -> those of all (n,), each about its own position."""
    if len(rows) == len(tried):
        return first, weight
    right = np.clip(np.searchsorted(tried, rows), 1, max(len(tried) - 1, 1))
    left = right - 1
    right = np.minimum(right, len(tried) - 1)
    near = np.where(np.abs(tried[left] - rows) <= np.abs(tried[right] - rows), left, right)
    own_first = np.rint(u).astype(np.int64) - weight.shape[1] // 2
    # where in the nearest one's pixels the own ones lie, by their distance from the line
    place = (own_first - u) - (first[near] - tried_u[near])
    whole = np.floor(place).astype(np.int64)
    t = (place - whole)[:, None]
    index = whole[:, None] + np.arange(weight.shape[1])

    def at(index: Int) -> Float:
        inside = (index >= 0) & (index < weight.shape[1])
        return np.where(inside, weight[near[:, None], np.clip(index, 0, weight.shape[1] - 1)], 0.0)

    return own_first, (1.0 - t) * at(index) + t * at(index + 1)
