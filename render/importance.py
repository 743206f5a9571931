"""What an error of the light in each pixel does to the measured lines: where a render is to spend its work.

The renderer knows nothing of line extraction: whoever measures the image works this out, from the derivative of each
row's position by its pixels and the sigma that the sensor's own noise gives that row.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from render.base.arrays import Float, Float32, Int


@dataclass(frozen=True)
class Importance:
    """Weights by which the deviations of a rendered image become deviations of what is measured in it.

    Where `s` is the standard deviation of a pixel's radiance, a scan line (a row on axis "rows") is known well enough
    once the sum of (weight s)^2 over its pixels is at most 1: its position is then moved by less than the goal's share
    of its own sigma, and no peak appears or vanishes by the error of the render.
    """

    laser: tuple[Float32, ...]
    """For each laser (h, w) weight of its own light, 1 / (W/(m^2 sr)), with its sign: the sum of weight and radiance
    along a scan line is how far that light moves the line. Zero where no error matters."""
    ambient: Float32
    """(h, w) weight of a pixel's own error of ambient light, for each of its bands alike, 1 / (W/(m^2 sr)): by that
    peaks appear or vanish, or a line is told otherwise."""
    axis: Literal["rows", "columns"] = "rows"
    peaks: tuple[Float32, ...] = ()
    """For each laser (h, w) weight of its own light: of a run of CELL pixels along a row, the sum of weight and error
    is at most 1 where no peak appears or vanishes by it."""
    allowed: float = 1.0
    """Deviation of a line that such a sum of 1 stands for, over the line's own sigma: the share of the goal that
    reflected light has, and ambient light."""
    ambient_moves: tuple[Float32, ...] = ()
    """For each laser (h, w) weight of ambient light, with its sign, as `laser`; (): it moves no line."""
    direct: float = 1.0
    """The share that direct light has, likewise over the line's own sigma."""

    def line_deviations(self, laser: int, pixels: Int, deviation: Float) -> Float:
        """Standard deviations (n,) of independent pixels of a laser's light, by their flat index (n,) -> (lines,) those
        of the lines that it moves, over their own sigma."""
        weight = self.laser[laser]
        height, width = weight.shape
        rows = self.axis == "rows"
        measured = np.any(weight, axis=1 if rows else 0)
        moved = np.square(weight.ravel()[pixels] * deviation, dtype=np.float64)
        variance = np.bincount(pixels // width if rows else pixels % width, moved, height if rows else width)
        return np.asarray(self.allowed * np.sqrt(variance[measured]))


LEAST_SAMPLES = 4
"""Of ambient light, a pixel, with which lines can be looked at: the first of both halves."""
LINES_KNOWN = 0.95
"""Share of the lines that a goal is met for: a few about bright corners or hidden edges would keep all others waiting.
What is told of them all is the deviation that so many are below."""
CELL = 4
"""Pixels; about as many as peaks are looked for with."""


def known_below(deviations: Float) -> float:
    """Of scan lines (n,): what `LINES_KNOWN` of them are below."""
    return float(np.quantile(deviations, LINES_KNOWN)) if len(deviations) else 0.0
