"""Two renders against each other: on one grid of pixels, as pictures and as a signed difference. Qt-free."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from analysis.report.colour import DIVERGING
from render.base.arrays import Float32
from render.frame import Frame
from render.output.tone_mapping import Picture, colour_table, grey, mapped, white_level
from render.sensor.develop import Image

Quantity = Literal["image", "laser", "reflected", "ambient"]
UNITS = {"image": "e-", "laser": "W/(m² sr)", "reflected": "W/(m² sr)", "ambient": "W/(m² sr)"}


@dataclass(frozen=True)
class Comparison:
    """Two arrays (h, w) on the grid of the first, and their difference."""

    a: Float32
    b: Float32
    unit: str

    @property
    def difference(self) -> Float32:
        """(h, w) b minus a."""
        return self.b - self.a

    @property
    def rms(self) -> float:
        """Root of the mean squared difference, in the unit."""
        return float(np.sqrt(np.mean(np.square(self.difference, dtype=np.float64))))

    def pictures(self) -> tuple[Picture, Picture]:
        """Both with the same white."""
        white = max(white_level(self.a), white_level(self.b))
        return grey(self.a, 0.0, white, bright=True), grey(self.b, 0.0, white, bright=True)

    def difference_picture(self) -> tuple[Picture, float]:
        """Diverging colours about zero, and the difference that has the full colour: 99.9 % are smaller."""
        size = np.abs(self.difference)
        some = size[size > 0.0]
        limit = float(np.percentile(some, 99.9)) if len(some) else 1.0
        return mapped(self.difference, -limit, limit, colour_table(DIVERGING)), limit


def quantities(frame: Frame) -> list[Quantity]:
    """What of a frame can be compared."""
    found: list[Quantity] = ["image"]
    if frame.laser_direct:
        found.append("laser")
    if frame.laser_indirect:
        found.append("reflected")
    if frame.ambient is not None:
        found.append("ambient")
    return found


def compare(quantity: Quantity, a: tuple[Frame, list[Image]], b: tuple[Frame, list[Image]]) -> Comparison | None:
    """The second is taken to the grid of the first; None: one of them does not have it."""
    first, second = _array(quantity, *a), _array(quantity, *b)
    if first is None or second is None:
        return None
    return Comparison(first, resampled(second, (first.shape[0], first.shape[1])), UNITS[quantity])


def resampled(image: Float32, shape: tuple[int, int]) -> Float32:
    """(h, w) -> shape by the nearest pixel: both cover the same field of view."""
    if image.shape == shape:
        return image
    rows = ((np.arange(shape[0]) + 0.5) * image.shape[0] / shape[0]).astype(np.intp)
    columns = ((np.arange(shape[1]) + 0.5) * image.shape[1] / shape[1]).astype(np.intp)
    return np.ascontiguousarray(image[rows][:, columns])


def _array(quantity: Quantity, frame: Frame, images: list[Image]) -> Float32 | None:
    if quantity == "image":
        return sum_of([electrons(image) for image in images])
    if quantity == "laser":
        return sum_of([frame.laser(i) for i in range(len(frame.laser_direct))])
    if quantity == "reflected":
        return sum_of(list(frame.laser_indirect))
    return None if frame.ambient is None else frame.ambient.mean(axis=2)


def electrons(image: Image) -> Float32:
    """(h, w) e- of a developed image."""
    return (image.grey.astype(np.float32) - np.float32(image.black_level)) / np.float32(image.gain)


def sum_of(arrays: list[NDArray[Any]]) -> Float32 | None:
    """(h, w) sum; None of nothing."""
    if not arrays:
        return None
    total = arrays[0]
    for array in arrays[1:]:
        total = total + array
    return np.ascontiguousarray(total, np.float32)
