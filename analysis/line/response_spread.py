"""How much more the matched filter's response scatters beside the line than if each pixel had noise of its own.

Demosaicing, denoising and JPEG make the noise of neighbouring pixels alike, so that a mean over them keeps more of it:
at most that of one pixel, of which the filter leaves sqrt(NOISE_GAIN). The response itself tells it, against the level
about it, as the detection has both: the typical scan line's median, of which neither line nor edges are half.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import correlate1d, median_filter

from analysis.line.detection.channel import MISSING, Lines
from analysis.line.detection.matched_filter import NOISE_GAIN, TAPS, block_size

ENOUGH = 2**17
"""Pixels, of which some thousands are independent."""
ABOUT = 7
"""Blocks of a scan line about one whose median is its level."""


def response_spread(lines: Lines) -> float:
    """Scan lines (n, w) with their noise -> standard deviation of the response beside the line, over what the same
    noise would make of it if no pixels shared it: 1 to NOISE_GAIN^-1/2."""
    signal, mask, floor = lines.read(0, lines.count)
    every = signal.size // ENOUGH | 1  # odd: a mosaic's rows are of two kinds
    signal, mask, floor = signal[::every], mask[::every], floor[::every]
    width = signal.shape[1]
    size = block_size(width)
    if width < size:
        return 1.0
    response = correlate1d(np.where(mask & MISSING, np.nan, signal), TAPS.astype(np.float32), axis=1)
    means = response[:, : width // size * size].reshape(len(response), -1, size).mean(axis=2)
    levels = median_filter(means, (1, ABOUT), mode="nearest")
    at = np.clip((np.arange(width) + 0.5) / size - 0.5, 0.0, levels.shape[1] - 1.0)
    left = np.minimum(at.astype(np.intp), max(levels.shape[1] - 2, 0))
    right = np.minimum(left + 1, levels.shape[1] - 1)
    level = levels[:, left] + (at - left).astype(np.float32) * (levels[:, right] - levels[:, left])
    apart = np.abs(response - level) / np.sqrt(NOISE_GAIN * (np.maximum(level, 0.0) + floor))
    known = np.isfinite(apart).any(axis=1)
    typical = 1.4826 * float(np.median(np.nanmedian(apart[known], axis=1))) if known.any() else 1.0
    return min(max(typical, 1.0), NOISE_GAIN**-0.5)
