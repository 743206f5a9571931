"""The noise of an image whose sensor is not known: read noise from neighbouring pixels, gain from the line itself."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.line.channel import COLOURS, MISSING, scan_lines
from analysis.line.measure import measure
from analysis.line.noise import FULL_SCALES, NoiseModel, image_saturation
from analysis.line.settings import ExtractionSettings

LINES = 256
"""Scan lines looked at."""
ROUNDS = 4
FULL_WELL = 1e4
"""Electrons taken for the highest number when no line says better."""


def estimate_noise(image: NDArray[Any], settings: ExtractionSettings) -> NoiseModel:
    """Checked image (h, w) or (h, w, 3) -> NoiseModel whose black level is 0 and whose gain is that of the residuals.

    Noise without light is that of the differences of neighbours along the scan line, edges clipped out. The gain is the photon transfer of the line's own fit: where shot noise rules, the
    median reduced chi-square of likelihood fits is the gain over the one assumed, and four rounds settle it. What the
    Gaussian model cannot follow (speckle, a lens with tails) counts as noise, so that sigma_u stays honest.
    """
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
    gain = _full_scale(image) / FULL_WELL
    for _ in range(ROUNDS):
        read_noise = np.sqrt(max(dark_variance - gain * level, 0.0)) / gain
        noise = numbers.model_copy(update={"gain": gain, "read_noise": read_noise})
        chi2 = measure(replace(lines, noise=noise), settings, threads=1).chi2
        chi2 = chi2[np.isfinite(chi2)]
        if chi2.size < 8:
            break
        gain *= float(np.clip(np.median(chi2), 1e-2, 1e2))
    read_noise = np.sqrt(max(dark_variance - gain * level, 0.0)) / gain
    return numbers.model_copy(update={"gain": gain, "read_noise": read_noise})


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
