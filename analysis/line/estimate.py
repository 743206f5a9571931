"""The noise of an image whose sensor is not known: read noise from neighbouring pixels, the rest from the line itself.

Its fit leaves residuals: as large as chi-square says, and, where they grow faster than a count's would, split into
what is a count and what multiplies the light (`residuals.py`).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.line.detection.channel import COLOURS, MISSING, Lines, scan_lines
from analysis.line.detection.noise import FULL_SCALES, NoiseModel, finite_of, image_saturation
from analysis.line.ground_noise import ground_noise
from analysis.line.measure import measure
from analysis.line.mosaic import seen_only, seen_rows, some_runs
from analysis.line.residuals import RUN, scatter
from analysis.line.response_spread import response_spread
from analysis.line.result import Flag, Line
from analysis.line.settings import ExtractionSettings
from render.base.arrays import Float
from render.base.errors import InputError

ROUNDS, SPLITS = 6, 6
CHANCE = 32
"""Fewer pixels may share one number, with no other but the dark's, by chance."""
FARTHEST, FARTHEST_SCALED = (5.0, 15.0), (150.0, 150.0)
"""Times the gain of `FULL_WELL`, up or down, beside scintillation, beside which little may be a count, and without; of
whole numbers, and of others."""
NARROW, FEWEST_BENDS, EXCESS = 1.1, 64, 1.3
"""px; below it a line is told by its neighbours, by so many second differences, from that ratio of variances on."""
STRAY = 4.0
"""Robust sigmas of second differences beyond which they are edges."""
TRIAL = 0.01
"""Relative variance of the light whose effect is tried."""
BESIDE, FAR, MORE = 6.0, 3, 1.25
"""Widths of the line beside which there is only background; pixels apart whose noise is as good as independent; and
times the mean square difference of neighbours from which that of such pixels says that neighbours are alike."""
APART = 9
"""Pixels between two of which not both are in one block of a JPEG, nor within reach of a smoothing filter."""
STEADY = 0.1
"""Change of the gain's logarithm at which splitting ends."""
ENOUGH = 2**17
"""Pixels, of which a variance is told to 0.4 %, or to 2 % where a camera has made neighbours alike."""
PLAUSIBLE = 1.6
"""Times that what the fits leave over may differ from what the ground tells."""
FULL_WELL = 1e4
"""Electrons taken for the highest number when no line says better."""


def estimate_noise(
    image: NDArray[Any],
    settings: ExtractionSettings,
    saturation: float | None = None,
    *,
    processed: bool = False,
    threads: int | None = 1,
) -> NoiseModel:
    """Checked image (h, w) or (h, w, 3) -> NoiseModel that explains the noise of its background and its line.

    Noise without light is that of the differences of neighbours along the scan line, edges clipped out. The gain is
    the photon transfer of the line's own fit: the one that makes the typical reduced chi-square of likelihood fits 1.
    Speckle and other noise that multiplies the light, and how alike neighbouring pixels have it, become the model's
    scintillation. What the Gaussian model cannot follow (a lens with tails) counts as noise. Of fewer than 32 scan
    lines all of it is taken for a count. saturation: DN, of an image that does not tell it by its type.
    processed: a camera has smoothed the image, so that neighbours differ by less than its noise; pixels apart tell it.

    InputError: the image has two numbers only, which say nothing of noise or of the line's profile.
    """
    _check_levels(image)
    along = image if settings.axis == "rows" else image.swapaxes(0, 1)
    sample = some_runs(along)
    if settings.axis == "columns":
        sample = sample.swapaxes(0, 1)
    settings = settings.model_copy(update={"method": "likelihood", "peaks": 1, "smoothing": 0.0})
    integer = image.dtype.kind == "u" or _are_whole(image)  # so is the difference of two integer images
    numbers = NoiseModel(
        step=1.0 if integer else 0.0,
        saturation=image_saturation(image) if saturation is None else saturation,
    )
    lines = scan_lines(sample, settings, numbers)
    start = _full_scale(image) / FULL_WELL
    if not processed:
        read_noise = math.sqrt(_dark_variance(lines, (1, 2))) / start
        rough = numbers.model_copy(update={"gain": start, "read_noise": read_noise})
        lines = seen_only(replace(lines, noise=rough), along, settings, threads)
        lines = replace(seen_rows(lines, along), noise=numbers)
    dark_variance = _dark_variance(lines, (1, 2))
    if processed:
        dark_variance = max(dark_variance, _dark_variance(lines, (APART,)))
    level = max(float(np.median(sample[np.isfinite(sample)])), 0.0)

    still = max(dark_variance - numbers.step**2 / 12.0, 0.0)

    def model(gain: float) -> NoiseModel:
        read_noise = math.sqrt(max(still - gain * level, 0.0)) / gain
        return numbers.model_copy(update={"gain": gain, "read_noise": read_noise})

    def raised(gain: float) -> NoiseModel:
        """Where a count of the background would scatter more than it does, the line alone is a count."""
        if gain * level <= still:
            return model(gain)
        return numbers.model_copy(update={"gain": gain, "black_level": level, "read_noise": math.sqrt(still) / gain})

    def fitted(noise: NoiseModel) -> Line:
        return measure(replace(lines, noise=noise), settings, threads)

    # of a processed image neighbouring pixels tell too little
    told = None if processed or image.ndim == 3 else _told_by_ground(lines, numbers, raised(start), fitted)
    # numbers that are not whole have no full scale, and the line's peak may be far below it
    farthest = FARTHEST if integer else FARTHEST_SCALED
    split = _split(lines, raised, start, farthest, fitted) if told is None else told
    noise = model(_balanced(model, start, fitted)) if split is None else split
    noise, line = _told_by_neighbours(lines, noise, fitted)
    # a photograph in colour is demosaiced, one that was processed smoothed, whatever its background tells
    alike = processed or image.ndim == 3 or lines.seen is not None or _alike(lines, noise, line)
    spread = response_spread(replace(lines, noise=noise)) if alike and lines.seen is None else 1.0
    return noise.model_copy(update={"alike": alike, "filled_in": lines.seen is not None, "spread": spread})


def _told_by_ground(
    lines: Lines, numbers: NoiseModel, first: NoiseModel, fitted: Callable[[NoiseModel], Line]
) -> NoiseModel | None:
    """The noise model by uneven ground, whose many levels tell more than what the fits leave over; None: it is even."""
    line = fitted(first)
    if not line.valid.any():
        return None
    found = ground_noise(_ground(lines, line))
    if found is None:
        return None
    gain, still = found
    read_noise = math.sqrt(max(still - numbers.step**2 / 12.0, 0.0)) / gain
    noise = numbers.model_copy(update={"gain": gain, "read_noise": read_noise})
    ratio = residual_ratio(fitted(noise))
    return noise if ratio is not None and 1.0 / PLAUSIBLE < ratio < PLAUSIBLE else None


def _ground(lines: Lines, line: Line) -> NDArray[np.float32]:
    """Pixels (n, m) beside the line, and of scan lines that none rises on, NaN elsewhere; of a mosaic those seen."""
    signal, mask, _ = lines.read(0, lines.count)
    far = np.abs(np.arange(signal.shape[1]) - line.u[:, :1]) > BESIDE * line.width[:, :1] + 2.0
    far |= line.flag[:, :1] == Flag.NO_PEAK
    ground = np.where(far & (mask == 0), signal, np.nan)
    if lines.seen is None:
        return ground
    rows, pairs = np.arange(lines.count), signal.shape[1] // 2
    columns = np.argmax(lines.seen, axis=1)[rows % 2][:, None] + 2 * np.arange(pairs)
    return np.take_along_axis(ground, columns, axis=1)


def _alike(lines: Lines, noise: NoiseModel, line: Line) -> bool:
    """The noise beside the line differs less between neighbouring pixels than between those that are apart."""
    ground = _ground(lines, line)
    step = noise.step / noise.gain
    for values in (ground, ground[: len(ground) // RUN * RUN].reshape(-1, RUN, ground.shape[1]).swapaxes(1, 2)):
        near, apart = (_mean_square_step(values, lag, step) for lag in (1, FAR))
        if near is not None and apart is not None and apart > MORE * near:
            return True
    return False


def _balanced(model: Callable[[float], NoiseModel], start: float, fitted: Callable[[NoiseModel], Line]) -> float:
    """The gain at which the reduced chi-square of the fits is 1."""
    log_gain, slope, before = math.log(start), -1.0, (0.0, 0.0)
    most = math.log(max(FARTHEST_SCALED))
    for number in range(ROUNDS):
        ratio = residual_ratio(fitted(model(math.exp(log_gain))))
        if ratio is None:
            break
        # secant on log(chi2) against log(gain): -1 where shot noise is all, flatter where read noise holds part of it
        if number > 0 and abs(log_gain - before[0]) > 1e-3:
            slope = float(np.clip((math.log(ratio) - before[1]) / (log_gain - before[0]), -1.0, -0.2))
        before = (log_gain, math.log(ratio))
        log_gain -= float(np.clip(before[1] / slope, -5.0, 5.0))
        # of a line that is clipped nearly everywhere, or processed, the fits may leave the same at any gain
        log_gain = float(np.clip(log_gain, math.log(start) - most, math.log(start) + most))
        if abs(before[1]) < 0.01:
            break
    return math.exp(log_gain)


def _split(
    lines: Lines,
    model: Callable[[float], NoiseModel],
    start: float,
    farthest: tuple[float, float],
    fitted: Callable[[NoiseModel], Line],
) -> NoiseModel | None:
    """The noise model whose residuals are in part a count and in part scintillation; None: too few lines tell."""
    gain, noise = start, model(start)
    for _ in range(SPLITS):
        found = scatter(replace(lines, noise=noise), fitted(noise))
        if found is None:
            return None
        most = farthest[0] if found.scintillation else farthest[1]
        before, gain = gain, min(max(gain * found.gain, start / most), start * most)
        settled = bool(noise.scintillation) == bool(found.scintillation) and abs(math.log(gain / before)) < STEADY
        noise = model(gain).model_copy(update={"scintillation": found.scintillation})
        if settled:
            break
    return noise


def _told_by_neighbours(
    lines: Lines, noise: NoiseModel, fitted: Callable[[NoiseModel], Line]
) -> tuple[NoiseModel, Line]:
    """The noise model of a narrow line, whose fit follows what multiplies the light of its three pixels; and the line.

    What scatters the position from row to row, beyond what is told, then counts as scintillation, as far as the light
    itself scatters along the line: second differences, to which a smooth surface adds nothing.
    """

    def look(model: NoiseModel) -> tuple[Line, float]:
        line = fitted(model)
        known = line.sigma_u[line.valid]
        return line, float(np.median(known**2)) if len(known) else math.nan

    line, told = look(noise)
    scattered, count = _scattered(np.where(line.valid, line.u, np.nan)[:, 0])
    if count < FEWEST_BENDS or np.nanmedian(line.width) > NARROW or not scattered > EXCESS * told:
        return noise, line
    # rounding moves a line as well, and may leave its light as it is
    coarse = noise.read_noise * noise.gain < noise.step / math.sqrt(12.0)
    most = 1.0 if coarse else _uneven_light(replace(lines, noise=noise), line)
    if most <= noise.contrast**2:
        return noise, line
    table = noise.table if noise.scintillation else np.zeros((1, 1))
    tried = table.copy()
    tried[0, 0] += TRIAL
    _, more = look(noise.model_copy(update={"scintillation": _rows_of(tried)}))
    table = table.copy()
    table[0, 0] = min(table[0, 0] + TRIAL * (scattered - told) / max(more - told, 1e-12), most)
    noise = noise.model_copy(update={"scintillation": _rows_of(table)})
    return noise, fitted(noise)


def _scattered(values: NDArray[np.float64]) -> tuple[float, int]:
    """Variance from row to row of what runs smoothly along the line (n,), NaN where unknown; by so many differences."""
    runs = values[: len(values) // RUN * RUN].reshape(-1, RUN)
    bends = runs[:, :-2] - 2.0 * runs[:, 1:-1] + runs[:, 2:]
    bends = np.abs(bends[np.isfinite(bends)])
    if len(bends) == 0:
        return 0.0, 0
    usual = bends[bends <= STRAY * 1.4826 * np.median(bends)]
    return float(np.mean(usual**2)) / 6.0, len(bends)


def _uneven_light(lines: Lines, line: Line) -> float:
    """The most that a pixel's light can vary, over its squared mean: what varies the sum of it along the line.

    A rough surface moves the line and leaves its light as it is; what multiplies the light does both.
    """
    signal, mask, floor = lines.read(0, lines.count)
    here = np.where(line.valid[:, 0], line.u[:, 0], np.nan)
    half = np.ceil(4.0 * np.nanmedian(line.width[:, 0]) + 1.0)
    x = np.arange(signal.shape[1])
    near = (np.abs(x - here[:, None]) <= half) & (mask == 0)
    light = np.where(
        near, signal - line.background[:, :1] - _slope(signal, mask, here, half) * (x - here[:, None]), 0.0
    )
    total = light.sum(axis=1)
    total[~(total > 0.0)] = np.nan
    share = (np.where(near, np.maximum(light, 0.0), 0.0) ** 2).sum(axis=1) / total**2
    counted = np.where(near, np.maximum(signal + floor, 0.0), 0.0).sum(axis=1)
    pixels, dark = near.sum(axis=1), np.maximum(line.background[:, 0] + np.median(floor), 0.0)
    counted += pixels**2 / np.maximum(pixels - 4.0 * line.width[:, 0] - 1.0, 1.0) * dark  # of the level under it all
    varied, count = _scattered(np.log(total))
    spare = varied * math.sqrt(4.0 / max(count, 1))  # one standard error: differences overlap
    most = float((varied + spare - np.nanmedian(counted / total**2)) / np.nanmedian(share))
    return min(max(most, 0.0), 1.0)


def _slope(signal: NDArray[np.float32], mask: NDArray[np.uint8], here: Float, half: float) -> Float:
    """(n, 1) e-/px: of the ground of pixels (n, w) at distances of `half` to three times as far from the line (n,)."""
    x = np.arange(signal.shape[1]) - here[:, None]
    beside = (np.abs(x) > half) & (np.abs(x) <= 3.0 * half) & (mask == 0)
    count = np.maximum(beside.sum(axis=1, keepdims=True), 1)
    x = np.where(beside, x - np.where(beside, x, 0.0).sum(axis=1, keepdims=True) / count, 0.0)
    return np.asarray((x * signal).sum(axis=1, keepdims=True) / np.maximum((x**2).sum(axis=1, keepdims=True), 1.0))


def _rows_of(table: NDArray[np.float64]) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(row) for row in table.tolist())


def residual_ratio(line: Line) -> float | None:
    """Typical residual variance over the one assumed: median reduced chi-square over that of its distribution."""
    valid = np.isfinite(line.chi2)
    if valid.sum() < 8:
        return None
    freedom = np.maximum(2.0 * np.ceil(4.0 * line.width[valid] + 1.5) - 3.0, 1.0)
    # Wilson and Hilferty (1931): median of chi2 / f is (1 - 2 / 9f)^3
    return max(float(np.median(line.chi2[valid] / (1.0 - 2.0 / (9.0 * freedom)) ** 3)), 1e-3)


def _check_levels(image: NDArray[Any]) -> None:
    low, high = np.nanmin(image), np.nanmax(image)
    if low == high or np.count_nonzero(image == high) < CHANCE:
        return
    if bool(((image == low) | (image == high)).all()):
        raise InputError(
            "the image is black and white, without the line's profile",
            where="image",
            found=f"no numbers but {low:g} and {high:g}",
            allowed="8 bits or more a pixel",
            cure="save the image as the camera gave it, before any threshold",
        )


def _are_whole(image: NDArray[Any]) -> bool:
    """Whether all numbers that are finite are whole; a remainder takes ten times as long as rounding."""
    return np.count_nonzero(np.rint(image) != image) == np.count_nonzero(np.isnan(image))


def _full_scale(image: NDArray[Any]) -> float:
    highest = float(np.max(finite_of(image)))
    if image.dtype.kind != "u":
        return highest if highest > 0 else 1.0
    return float(min(scale for scale in FULL_SCALES if scale >= highest))


def _mean_square_step(values: NDArray[np.float32], lag: int, step: float) -> float | None:
    """(..., n), NaN where not usable -> mean square of steps to the `lag`th neighbour, edges clipped; None: too few."""
    steps = np.subtract(values[..., lag:], values[..., :-lag], dtype=np.float64)
    steps = steps[np.isfinite(steps)]
    if steps.size < CHANCE**2:
        return None
    steps = np.abs(steps - np.median(steps))  # a slope is no noise
    sigma = 1.4826 * (float(np.median(steps)) + 0.5 * step)
    return float(np.mean(steps[steps <= STRAY * sigma] ** 2))


def _dark_variance(lines: Lines, lags: tuple[int, ...]) -> float:
    """DN^2, of a pixel without light, of lines in DN: from the first of some lags at which pixels are known."""
    signal, mask, _ = lines.read(0, lines.count)
    every = signal.size // ENOUGH | 1  # odd: a mosaic's rows are of two kinds
    signal, mask = signal[::every], mask[::every]
    colours = 1.5 if lines.channel in COLOURS and lines.image.ndim == 3 else 1.0  # variance of a colour difference
    return _difference_variance(np.where(mask & MISSING, np.nan, signal), lines.noise.step, lags) / colours


def _difference_variance(values: NDArray[np.float32], step: float, lags: tuple[int, ...]) -> float:
    """(n, w), NaN where not usable -> variance of a pixel, from the first of some lags at which pixels are known."""
    for lag in lags:
        steps = values[:, lag:] - values[:, :-lag]
        known = np.isfinite(steps)
        if not known.any():
            continue
        steps = steps[known.any(axis=1)]
        # a median without NaN is many times faster
        middle = np.median if known.all() else np.nanmedian
        steps = np.abs(steps - middle(steps, axis=1, keepdims=True))  # a slope is no noise
        steps = steps[np.isfinite(steps)]
        if steps.size:
            squares = np.square(steps, dtype=np.float64)
            # half a step more, since the median of whole numbers may well be 0
            sigma = 1.4826 * (float(np.median(steps)) + 0.5 * step)
            for _ in range(3):
                sigma = float(np.sqrt(np.mean(squares, where=steps <= 4.0 * sigma)))
            return 0.5 * sigma**2
    return 0.0
