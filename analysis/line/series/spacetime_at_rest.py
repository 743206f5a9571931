"""Spacetime analysis: when the middle of the sheet passes over each pixel of a sweep, fitted along time.

Curless and Levoy, ICCV 1995. Along time a pixel looks at one patch of surface, so that albedo, corners and occlusion,
which pull a line's position in the image by up to a pixel, change the height of its Gaussian and not its middle. A
surface that moves in the image is followed along its own path, the tilted slice of the paper.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.line.detection.channel import Lines, check_image
from analysis.line.detection.noise import NoiseModel
from analysis.line.measure import measure
from analysis.line.result import positioned
from analysis.line.settings import ExtractionSettings
from render.base.arrays import Float
from render.base.errors import InputError

FEWEST = 8
"""Frames."""


@dataclass(frozen=True)
class Passage:
    """The sheet's passage over each pixel, (h, w); times in frames from the first, NaN where the flag says why."""

    time: Float
    sigma_time: Float
    width: Float
    """Gaussian sigma along time, frames."""
    amplitude: Float
    """Electrons."""
    flag: NDArray[np.uint8]

    @property
    def valid(self) -> NDArray[np.bool_]:
        """(h, w): has a time."""
        return positioned(self.flag)


def passage(
    frames: Sequence[NDArray[Any]] | NDArray[Any],
    noise: NoiseModel,
    *,
    settings: ExtractionSettings | None = None,
    motion: tuple[float, float] = (0.0, 0.0),
    threads: int | None = None,
) -> Passage:
    """Mono frames (t, h, w) of a sweep, evenly spaced -> Passage.

    motion: px per frame that the surface moves in the image along u and v; pixels are then those of the middle frame.
    Raises InputError: fewer than 8 frames, frames of different shape or type, colour.
    """
    stack = [check_image(frame) for frame in frames]
    if len(stack) < FEWEST:
        raise InputError("a sweep needs more frames", where="frames", found=len(stack), allowed=f"{FEWEST} or more")
    if any(frame.ndim != 2 or frame.shape != stack[0].shape or frame.dtype != stack[0].dtype for frame in stack):
        found = ", ".join(sorted({f"{frame.shape} {frame.dtype}" for frame in stack}))
        raise InputError("the frames are not of one shape and type", where="frames", found=found, allowed="all (h, w)")
    height, width = stack[0].shape
    if motion != (0.0, 0.0):
        stack = [_align(frame, motion, t - 0.5 * (len(stack) - 1), noise) for t, frame in enumerate(stack)]
    chosen = (settings or ExtractionSettings()).model_copy(update={"peaks": 1, "smoothing": 0.0, "axis": "rows"})
    series = np.ascontiguousarray(np.stack(stack, axis=2)).reshape(height * width, len(stack))
    line = measure(Lines(series, "mono", None, noise), chosen, threads)
    shape = (height, width)
    u, sigma_u, spread, amplitude = (a.reshape(shape) for a in (line.u, line.sigma_u, line.width, line.amplitude))
    return Passage(u, sigma_u, spread, amplitude, line.flag.reshape(shape))


def _align(frame: NDArray[Any], motion: tuple[float, float], time: float, noise: NoiseModel) -> NDArray[np.float32]:
    """The frame shifted so that a moving surface stands still; NaN where it would look beyond the image."""
    from scipy.ndimage import shift

    offset = (-motion[1] * time, -motion[0] * time)
    values = frame.astype(np.float32)
    bad = ~np.isfinite(values)
    values[bad] = 0.0
    moved = np.asarray(shift(values, offset, order=3, mode="constant", cval=np.nan))
    if noise.saturation is not None:  # a mean of saturated and other pixels is not a measurement
        full = shift((frame >= noise.saturation).astype(np.float32), offset, order=1)
        moved[full > 0.0] = noise.saturation
    if bad.any():
        moved[shift(bad.astype(np.float32), offset, order=1) > 0.0] = np.nan
    return moved
