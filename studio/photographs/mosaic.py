"""What a colour camera's mosaic and JPEG add to sigma: an error that no scatter along an upright line can show.

Red and blue are seen on every other pixel of a row, and filled in between. Tone curve, sharpening and JPEG after that
leave a profile that is wrong in the same way on all scan lines that cross the image's blocks at one place. What a JPEG
rounds moves a line the less the higher it is, at any width; what the mosaic does, the less the wider it is, and more
where it is clipped. Of upright lines of 1.1 to 8 px (as seen) in red, green and blue, at 0.05 to 25 times the full well
and random places of the mosaics, tone curves and JPEGs (quality 70 to 95) of a webcam and a phone, 95 % were off on
average by no more than twice

                               by height, px DN    by width, px^2    clipped, px^2
    luminance                  0.5 to 0.8          0.02 to 0.05      0.06 to 0.15
    green                      1.3 to 2.5          0.03              0.02 to 0.15
    the laser's red or blue    2.7 to 3.8          0.06 to 0.15      0.16 to 0.4

A line that crosses the mosaic slantwise meets all of its places: what a cubic does not follow of that wave has told
itself by the scatter along the line (`analysis/line/shared_noise.py`).
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from analysis.line.result import Flag, Line
from analysis.line.shared_noise import DEGREE, FEWEST_RUNS, RUNS
from studio.photographs.laser_light import Channel

Floats = NDArray[np.float64]

ROUNDED: dict[Channel, float] = {
    "luminance": 0.7,
    "green": 1.8,
    "mono": 2.0,
    "red": 3.4,
    "blue": 3.4,
    "difference": 6.8,
}
"""px DN over the line's height in DN, by the channel that measures."""
FILLED_IN: dict[Channel, float] = {
    "luminance": 0.04,
    "green": 0.03,
    "mono": 0.04,
    "red": 0.15,
    "blue": 0.15,
    "difference": 0.15,
}
"""px^2 over the line's width in px; the larger where some of its grains of speckle are clipped."""
CLIPPED, CLIPPED_ALONE = 0.15, 0.25
"""The same where the mosaic is clipped before it is filled in; in red or blue alone."""
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
    by_width = FILLED_IN[channel]
    if clipped:
        by_width = CLIPPED_ALONE if channel in ("red", "blue", "difference") else CLIPPED
    by_height = ROUNDED[channel] / np.maximum(height, 1.0)
    return np.asarray(np.hypot(by_width / np.maximum(width, FINEST), by_height), np.float64)


def with_mosaic(line: Line, channel: Channel, gain: float) -> Line:
    """A line measured in a channel of an image whose colour is coarse -> the same with larger sigmas; gain: DN/e-.

    All scan lines err alike by that much: so the correlation length becomes as long as the line, in its share.
    """
    open_, clipped = (moved_by(channel, line.width, gain * line.amplitude, clipped) for clipped in (False, True))
    full = line.flag == Flag.SATURATED
    # before colours are filled in and noise is smoothed, more is clipped than shows
    near = full.sum() > NEARLY * max(int(line.valid.sum()), 1)
    extra = np.where(full | near, clipped, open_) ** 2 * _alike(line)
    told = np.ones_like(line.u) if line.length_apart is None else line.length_apart
    variance = line.variance_apart
    length = (variance * told + extra * max(int(line.valid.sum()), 1)) / (variance + extra)
    return replace(line, sigma_u=np.sqrt(line.sigma_u**2 + extra), length_apart=length)


def _alike(line: Line) -> Floats:
    """(n, k) share of the variance by a mosaic that neighbours have in common; the rest scatters along the line."""
    out = np.ones(line.u.shape)
    for k in range(line.u.shape[1]):
        rows = np.flatnonzero(line.valid[:, k])
        if len(rows) >= FEWEST_RUNS * RUNS[0]:
            slope = np.gradient(np.interp(np.arange(len(out)), rows, line.u[rows, k]))
            slope = np.abs(median_filter(slope, RUNS[0], mode="nearest"))
            out[:, k] = np.interp(np.mod(slope, PERIOD), SLOPES, _followed())
    return out


@cache
def _followed() -> Floats:
    """(SLOPES,) share of the variance of a wave of `PERIOD`, across which a line runs, that a run's cubic holds."""
    rows = np.arange(RUNS[0])
    cubic = np.linalg.qr(np.vander(rows / RUNS[0] - 0.5, DEGREE + 1))[0]
    wave = np.exp(2j * np.pi * rows * SLOPES[:, None] / PERIOD)
    return np.asarray((np.abs(wave @ cubic) ** 2).sum(axis=1) / RUNS[0])
