"""What turns out to be no line is passed over: the next peak of its scan line is measured in its place.

The strongest peak of a scan line may be the edge of something lit, a window or a white part, which rises higher than
the line and which no fit takes for one. The line stands beside it. What is lit has bumps of its own noise, many of them
on every scan line, so that the next peak has to stand out of the light that it stands on, and more clearly than the
strongest has to.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from analysis.line.detection.channel import Mask
from analysis.line.detection.detect import SEED_COLUMNS, Limits, detect
from analysis.line.methods.seed_loop import CHI2, WIDTH
from analysis.line.result import Flag
from render.base.arrays import Bool, Float, Float32, Long

MOST = 4
"""Peaks of a scan line that are passed over."""
NO_LINE = (Flag.TOO_WIDE, Flag.NOT_CONVERGED, Flag.OUT_OF_WINDOW)
"""What is measured and is none. A line that the border cuts off is one, and what is beside it is not."""
CLEAR = 2.0
"""Times the detection threshold: at 1.0 bumps of a lit part were lines in 0.5 % of its scan lines, at 2.0 in 0.1 %."""
ALIKE = math.sqrt(8.0)
"""Times the same where neighbouring pixels share noise: of a colour that a mosaic sees at every other pixel, the rest
their means, a sum over many has 8 times the variance that the differences of neighbours tell."""
LINES = (Flag.OK, Flag.SATURATED, Flag.UNRESOLVED)
"""What the next peak may be."""


def pass_over(
    out: Float,
    flags: NDArray[np.uint8],
    passed: Long,
    threshold: float,
    alike: bool,
    measure: Callable[[Bool], None],
) -> None:
    """Strongest peaks that were measured, out (n, 1, columns) and flags (n, 1), and how many are passed over (n,): in
    place those that come next, where the strongest is none.

    measure: measures scan lines (n, 1) again, where some peaks are passed over. threshold: of the detection.
    alike: neighbouring pixels share noise.
    """
    refused: Bool = np.isin(flags[:, 0], NO_LINE)
    if not refused.any():
        return
    before, why, clear = out.copy(), flags.copy(), CLEAR * threshold * (ALIKE if alike else 1.0)
    sought, found = refused.copy(), np.zeros_like(refused)
    for count in range(1, MOST + 1):
        passed[sought] = count
        measure(sought[:, None])
        found |= sought & np.isin(flags[:, 0], LINES) & (_response(out[:, 0]) >= clear)
        sought &= ~found & (flags[:, 0] != Flag.NO_PEAK)
        if not sought.any():
            break
    lost = refused & ~found
    out[lost], flags[lost], passed[lost] = before[lost], why[lost], 0


def _response(out: Float) -> Float:
    """(n, columns) of a kernel -> (n,) what a matched filter responds with, in standard deviations; it knows the place
    to sqrt(2) widths over that. Noise that the fit finds larger than it was told to be counts as it is found."""
    sigma = out[:, 1] * np.sqrt(np.fmax(out[:, CHI2], 1.0))
    return np.asarray(math.sqrt(2.0) * out[:, WIDTH] / sigma)


def seeds_of(
    pixels: tuple[Float32, Mask, Float32], limits: Limits, peaks: int, passed: Long
) -> tuple[Float, NDArray[np.uint8]]:
    """What `detect` finds of scan lines (n, w): seeds (n, peaks, columns) and flags (n, peaks), where some of the
    strongest are passed over (n,), which leaves one."""
    count, most = len(passed), int(passed.max(initial=0))
    seeds, flags = np.zeros((count, peaks + most, SEED_COLUMNS)), np.empty((count, peaks + most), np.uint8)
    detect(*pixels, limits, seeds, flags)
    if most:
        rows = np.flatnonzero(passed)
        seeds[rows, 0], flags[rows, 0] = seeds[rows, passed[rows]], flags[rows, passed[rows]]
        return np.ascontiguousarray(seeds[:, :peaks]), np.ascontiguousarray(flags[:, :peaks])
    return seeds, flags
