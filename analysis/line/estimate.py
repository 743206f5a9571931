"""The noise of an image whose sensor is not known: read noise from neighbouring pixels, gain from the line itself."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.line.detection.channel import COLOURS, MISSING, scan_lines
from analysis.line.detection.noise import FULL_SCALES, NoiseModel, image_saturation
from analysis.line.measure import measure
from analysis.line.result import Line
from analysis.line.settings import ExtractionSettings
from render.base.errors import InputError

LINES = 256
"""Scan lines looked at."""
ROUNDS = 6
CHANCE = 32
"""Fewer pixels may share one number, with no other but the dark's, by chance."""
FULL_WELL = 1e4
"""Electrons taken for the highest number when no line says better."""


def estimate_noise(image: NDArray[Any], settings: ExtractionSettings) -> NoiseModel:
    """Checked image (h, w) or (h, w, 3) -> NoiseModel whose black level is 0 and whose gain is that of the residuals.

    Noise without light is that of the differences of neighbours along the scan line, edges clipped out. The gain is
    the photon transfer of the line's own fit: the one that makes the typical reduced chi-square of likelihood fits 1.
    What the Gaussian model cannot follow (speckle, a lens with tails) counts as noise, so that sigma_u stays honest.

    InputError: the image has two numbers only, which say nothing of noise or of the line's profile.
    """
    _check_levels(image)
    axis = 0 if settings.axis == "rows" else 1
    stride = max(1, image.shape[axis] // LINES) | 1  # odd: keeps the rows of a Bayer pattern alternating
    sample = image[::stride] if axis == 0 else image[:, ::stride]
    settings = settings.model_copy(update={"method": "likelihood", "peaks": 1, "smoothing": 0.0})
    integer = image.dtype.kind == "u"
    numbers = NoiseModel(step=1.0 if integer else 0.0, saturation=image_saturation(image))
    lines = scan_lines(sample, settings, numbers)
    signal, mask, _ = lines.read(0, lines.count)
    colours = 1.5 if lines.channel in COLOURS and image.ndim == 3 else 1.0  # variance of a colour difference
    dark_variance = _difference_variance(np.where(mask & MISSING, np.nan, signal), numbers.step) / colours
    level = max(float(np.median(sample[np.isfinite(sample)])), 0.0)

    def model(gain: float) -> NoiseModel:
        read_variance = max(dark_variance - gain * level - numbers.step**2 / 12.0, 0.0)
        return numbers.model_copy(update={"gain": gain, "read_noise": math.sqrt(read_variance) / gain})

    log_gain, slope, before = math.log(_full_scale(image) / FULL_WELL), -1.0, (0.0, 0.0)
    for number in range(ROUNDS):
        ratio = residual_ratio(measure(replace(lines, noise=model(math.exp(log_gain))), settings, threads=1))
        if ratio is None:
            break
        # secant on log(chi2) against log(gain): -1 where shot noise is all, flatter where read noise holds part of it
        if number > 0 and abs(log_gain - before[0]) > 1e-3:
            slope = float(np.clip((math.log(ratio) - before[1]) / (log_gain - before[0]), -1.0, -0.2))
        before = (log_gain, math.log(ratio))
        log_gain -= float(np.clip(before[1] / slope, -5.0, 5.0))
        if abs(before[1]) < 0.01:
            break
    return model(math.exp(log_gain))


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


def _full_scale(image: NDArray[Any]) -> float:
    highest = float(np.max(image[np.isfinite(image)]))
    if image.dtype.kind != "u":
        return highest if highest > 0 else 1.0
    return float(min(scale for scale in FULL_SCALES if scale >= highest))


def _difference_variance(values: NDArray[np.float32], step: float) -> float:
    """(n, w), NaN where not usable -> variance of a pixel, from neighbours or, on a Bayer row, next but one."""
    for lag in (1, 2):
        steps = np.abs(values[:, lag:] - values[:, :-lag], dtype=np.float64)
        steps = steps[np.isfinite(steps)]
        if steps.size:
            # half a step more, since the median of whole numbers may well be 0
            sigma = 1.4826 * (float(np.median(steps)) + 0.5 * step)
            for _ in range(3):
                sigma = float(np.sqrt(np.mean(steps[steps <= 4.0 * sigma] ** 2)))
            return 0.5 * sigma**2
    return 0.0
