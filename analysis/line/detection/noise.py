"""From digital numbers to electrons and their variance: EMVA 1288's linear model, given or estimated.

    Cov(i, j) = (electrons_i + read_noise^2 + (step / gain)^2 / 12) [i = j] + scintillation(i - j) L_i L_j

L is the line's light above its background. The second part multiplies it: speckle, and pixels of uneven gain.
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import field_validator

from render.base.arrays import Float
from render.base.model import Model, quantity

FULL_SCALES = (255, 1023, 4095, 16383, 65535, 65472, 65520, 65532)
"""Highest numbers of 8 to 16 bit images, right- and left-justified."""
PILE, STEEP = 32, 4
"""Pixels with the highest number, and how many times those of the next lower one, that only clipping piles up."""


class NoiseModel(Model):
    """electrons = (DN - black_level) / gain; their covariance as above."""

    gain: float = quantity(1.0, unit="DN/e-", label="Gain", help="EMVA's K.", gt=0, le=1e9)
    black_level: float = quantity(0.0, unit="DN", label="Black level", ge=-1e6, le=1e6)
    read_noise: float = quantity(0.0, unit="e-", label="Read noise", help="Standard deviation.", ge=0, le=1e7)
    saturation: float | None = quantity(
        None, unit="DN", label="Saturation", help="Pixels at or above it only say 'at least this much'."
    )
    step: float = quantity(1.0, unit="DN", label="Quantisation step", help="0 for a float image.", ge=0, le=1e6)
    scintillation: tuple[tuple[float, ...], ...] = quantity(
        (),
        label="Scintillation",
        help="Covariance of the light over its squared mean, [k][d] of pixels k scan lines and d pixels apart, the "
        "same to either side. Empty: none.",
    )
    fineness: float = quantity(
        0.0,
        label="Fineness",
        help="How much uneven light within a pixel adds to its scintillation: 1 for a grain finer than the pixels, 0 "
        "for a coarser one and for uneven gain.",
        ge=0,
        le=1,
    )

    alike: bool = quantity(
        False,
        label="Alike in neighbours",
        help="Neighbouring pixels share noise, as demosaicing, denoising and JPEG make them: how much of it moves the "
        "line is asked of the positions.",
    )

    spread: float = quantity(
        1.0,
        label="Spread of sums",
        help="How much more a mean over neighbouring pixels scatters than if each had noise of its own: what is taken "
        "for a line has to rise above that.",
        ge=1,
        le=10,
    )

    filled_in: bool = quantity(
        False,
        label="Filled in",
        help="The colours of a mosaic are filled in: where it can be told which pixels were seen, the likelihood is of "
        "these alone. Asked of the pixels as well where neighbours are alike.",
    )

    @field_validator("scintillation")
    @classmethod
    def _is_a_covariance(cls, table: tuple[tuple[float, ...], ...]) -> tuple[tuple[float, ...], ...]:
        if table and (not table[0] or any(len(row) != len(table[0]) for row in table)):
            raise ValueError("scintillation has rows of different lengths; allowed: a rectangle, or none")
        if any(abs(value) > table[0][0] for row in table for value in row):
            raise ValueError("scintillation is largest at other distances than 0; allowed: none above [0][0]")
        return table

    @property
    def floor(self) -> float:
        """Variance in e-^2 of a pixel without light."""
        return max(self.read_noise**2 + (self.step / self.gain) ** 2 / 12.0, 0.01)

    @property
    def contrast(self) -> float:
        """Standard deviation over mean of a pixel's light, shot noise aside."""
        return math.sqrt(self.scintillation[0][0]) if self.scintillation else 0.0

    @cached_property
    def table(self) -> Float:
        """(k, m) of `scintillation`, (0, 0) where there is none."""
        return np.array(self.scintillation) if self.scintillation else np.zeros((0, 0))

    @cached_property
    def covariances(self) -> Float:
        """(2, m) of light d pixels apart over its squared mean: on the same scan line, and summed over all scan lines.

        The second is what is left of it in the mean of many scan lines. (2, 0) without scintillation.
        """
        if not self.scintillation:
            return np.zeros((2, 0))
        return np.stack([self.table[0], 2.0 * self.table.sum(axis=0) - self.table[0]])


def finite_of(image: NDArray[Any]) -> NDArray[Any]:
    """The numbers of an image that are finite; itself, if all are."""
    if image.dtype.kind != "f":
        return image
    finite = np.isfinite(image)
    return image if finite.all() else np.asarray(image[finite])


def image_saturation(image: NDArray[Any]) -> float | None:
    """The full scale in DN that an image touches, or the number that clips it; None if there is neither."""
    image = finite_of(image)
    highest = float(image.max())
    if np.issubdtype(image.dtype, np.integer) and int(highest) in FULL_SCALES:
        return highest
    at_top = np.count_nonzero(image == highest)
    lowest = image.min()
    if at_top < PILE or lowest == image.max():
        return None
    if image.dtype.kind == "u":  # what is below the highest wraps, the highest becomes 0
        wrapped = int(np.subtract(image, image.max()).max())
        lower: Any = wrapped + int(highest) - int(np.iinfo(image.dtype).max) - 1
    else:
        lower = np.where(image < highest, image, lowest).max()
    next_lower = np.count_nonzero(image == lower)
    return highest if at_top > STEEP * next_lower else None
