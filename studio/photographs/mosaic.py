"""What a colour camera's mosaic and JPEG add to sigma: an error that no scatter along an upright line can show.

Red and blue are seen on every other pixel of a row, and filled in between. Tone curve, sharpening and JPEG after that
leave a profile that is wrong in the same way on all scan lines that cross the image's blocks at one place. What a JPEG
rounds is so much of an image, wherever the line is: it moves the line by its moment over the line's light, which is its
width times its height. Where a colour is clipped before it is filled in, the profile has kinks, and pixels two apart do
not tell where a kink is: it moves the line the less the wider it is, and the more the steeper the profile is clipped.

Told by 4,000 upright lines of 0.9 to 5 px in red, green and blue, at 0.05 to 25 times the full well, with and without
speckle, at random places of the mosaics and blocks, through the steps of a webcam and a phone with sharpening of 0 to
1, denoising of 0 to 1.5 px and a JPEG of quality 70 to 95, by the mean product of the errors of their upper and their
lower half, in which noise has no part. In px, with one standard error of the fit in brackets,

                   rounded, px^2 DN    filled in, px^2    clipped up to 255 DN, px^2    at 510 DN and more
    luminance      0 to 1.2 (0.4)      0.018 (0.012)      0.084 (0.003)                 0.129 (0.011)
    green          3.4 (0.3)           0.000 (0.009)      0.060 (0.007)                 0.148 (0.013)
    red            6.9 (0.9)           0.076 (0.024)      0.300 (0.013)                 0.353 (0.032)
    blue           7.6 (1.0)           0.105 (0.022)      0.302 (0.013)                 0.377 (0.035)

luminance and green of all lasers together, red and blue of their own.

A line that crosses the mosaic slantwise meets all of its places: what a cubic does not follow of that wave has told
itself by the scatter along the line (`analysis/line/shared_noise.py`).
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from analysis.line.result import Flag, Line
from analysis.line.shared_noise import DEGREE, FEWEST_RUNS, RUNS
from studio.photographs.laser_light import Channel
from studio.photographs.line_arrays import less_sure

Floats = NDArray[np.float64]

ROUNDED: dict[Channel, tuple[float, float]] = {
    "luminance": (1.0, 0.02),
    "green": (3.4, 0.02),
    "mono": (3.4, 0.02),
    "red": (7.3, 0.09),
    "blue": (7.3, 0.09),
    "difference": (14.6, 0.18),
}
"""px^2 DN over the line's width in px and its height in DN, and px^2 over its width, by the channel that measures. A
sum of colours was not measured and is taken as green, a difference of them as twice the worse."""
CLIPPED: dict[Channel, tuple[float, float]] = {
    "luminance": (0.084, 0.129),
    "green": (0.060, 0.148),
    "mono": (0.084, 0.148),
    "red": (0.30, 0.36),
    "blue": (0.30, 0.36),
    "difference": (0.30, 0.36),
}
"""px^2 over the line's width in px, where some of its grains of speckle are clipped, and where it is at twice what
clips."""
FULL = 255.0
"""DN that clips; between it and twice as much the logarithm of the height counts."""
NEARLY = 0.05
"""Share of the scan lines that are clipped, from which the others have clipped grains of speckle as well."""
FINEST = 1.0
"""px; no line is seen as narrower through a mosaic."""
PERIOD = 2.0
"""px after which a mosaic is the same again."""
SLOPES = np.linspace(0.0, PERIOD, 257)
"""px a scan line."""


def moved_by(channel: Channel, width: Floats | float, height: Floats | float, clipped: bool = False) -> Floats:
    """px that a mosaic and a JPEG move lines of widths (...), px, and heights (...), DN, by, measured in a channel."""
    wide, high = np.maximum(width, FINEST), np.maximum(height, 1.0)
    if not clipped:
        rounded, filled_in = ROUNDED[channel]
        return np.asarray(np.hypot(rounded / high, filled_in) / wide, np.float64)
    least, most = CLIPPED[channel]
    above = np.clip(np.log2(high / FULL), 0.0, 1.0)
    return np.asarray(np.sqrt(least**2 + (most**2 - least**2) * above) / wide, np.float64)


def with_mosaic(line: Line, channel: Channel, gain: float) -> Line:
    """A line measured in a channel of an image whose colour is coarse -> the same with larger sigmas; gain: DN/e-.

    All scan lines that cross the mosaic at nearly one place err alike by that much: the correlation length becomes, in
    that share, as long as an upright line, and half a wave of the mosaic of one that leans.
    """
    open_, clipped = (moved_by(channel, line.width, gain * line.amplitude, clipped) for clipped in (False, True))
    full = line.flag == Flag.SATURATED
    # before colours are filled in and noise is smoothed, more is clipped than shows
    near = full.sum() > NEARLY * max(int(line.valid.sum()), 1)
    slope = _slope(line)
    share = np.interp(np.mod(slope, PERIOD), SLOPES, _followed())
    extra = np.where(full | near, clipped, open_) ** 2 * share
    longest = max(int(line.valid.sum()), 1)
    return less_sure(line, extra, np.clip(0.5 * PERIOD / np.maximum(slope, 1e-9), 1.0, longest))


def _slope(line: Line) -> Floats:
    """(n, k) px a scan line that a line leans by; 0 where it is too short to tell."""
    out = np.zeros(line.u.shape)
    for k in range(line.u.shape[1]):
        rows = np.flatnonzero(line.valid[:, k])
        if len(rows) >= FEWEST_RUNS * RUNS[0]:
            u = np.interp(np.arange(len(out)), rows, line.u[rows, k])
            slope = np.pad((u[RUNS[0] :] - u[: -RUNS[0]]) / RUNS[0], (RUNS[0] // 2, RUNS[0] // 2), mode="edge")
            out[:, k] = np.abs(median_filter(slope, 2 * RUNS[0] + 1, mode="nearest"))  # not that of a step
    return out


@cache
def _followed() -> Floats:
    """(SLOPES,) share of the variance of a wave of `PERIOD`, across which a line runs, that a run's cubic holds."""
    rows = np.arange(RUNS[0])
    cubic = np.linalg.qr(np.vander(rows / RUNS[0] - 0.5, DEGREE + 1))[0]
    wave = np.exp(2j * np.pi * rows * SLOPES[:, None] / PERIOD)
    return np.asarray((np.abs(wave @ cubic) ** 2).sum(axis=1) / RUNS[0])
