"""What blur along the line does to sigma: an image is as unsharp along the line as across it, and rounds its corners.

Lens, filled-in colours and denoising mix the light of neighbouring scan lines by a kernel G, and with it the line's
middle: where a line u bends, it is seen at G u, off by u - G u. That is nothing on a straight line, 0.4 s times the
change of slope at a corner (s: sigma of G), and half of a step. u is not known. What is seen, v = G u, is off its own
mean G v by as much where the line bends over more scan lines than s, and by 2^(1/2) - 1 of it at a corner, so that this
distance, taken as one standard deviation, makes two hold the error, or nearly.
"""

from __future__ import annotations

import math

import numpy as np

from analysis.line.result import Line
from render.base.arrays import Float
from studio.photographs.line_arrays import less_sure

BLUR = 1.4
"""px: a lens of 0.6 px, filling in of 0.7 px (`analysis.line.shared_noise.FINEST`) and denoising of 1 px, in
quadrature."""
REACH = 4
"""Scan lines on either side, 3 sigma."""
ANOTHER = 3.0
"""Widths of the line from one scan line to the next from which the next is another line's, whose light is not mixed
with this one's."""


def with_blur_along(line: Line, course: Line) -> Line:
    """A line (n, k) -> the same with what blur may move it by in sigma; course: the same line, smoothed along."""
    return less_sure(line, _rounded_by(course) ** 2, 2.0 * math.sqrt(math.pi) * BLUR)


def _rounded_by(line: Line) -> Float:
    """(n, k) px that the line is aside from its mean over the kernel, 0 where it has no position."""
    u = np.where(line.valid, line.u, np.nan)
    total, weights = np.zeros_like(u), np.ones_like(u)
    joined = np.abs(np.diff(u, axis=0)) < ANOTHER * np.minimum(line.width[1:], line.width[:-1])
    reached = np.ones_like(line.valid)
    for distance in range(1, min(REACH, len(u) - 1) + 1):
        reached = reached[:-1] & joined[distance - 1 :]  # each scan line to the one so far on
        weight = math.exp(-0.5 * (distance / BLUR) ** 2)
        aside = np.where(reached, weight * (u[distance:] - u[:-distance]), 0.0)
        total[:-distance] += aside
        total[distance:] -= aside
        weights[:-distance] += np.where(reached, weight, 0.0)
        weights[distance:] += np.where(reached, weight, 0.0)
    return np.asarray(np.abs(total / weights))
