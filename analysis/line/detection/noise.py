"""From digital numbers to electrons and their variance: EMVA 1288's linear model, given or estimated."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from render.base.model import Model, quantity

FULL_SCALES = (255, 1023, 4095, 16383, 65535, 65472, 65520, 65532)
"""Highest numbers of 8 to 16 bit images, right- and left-justified."""


class NoiseModel(Model):
    """electrons = (DN - black_level) / gain; variance = electrons + read_noise^2 + (step / gain)^2 / 12."""

    gain: float = quantity(1.0, unit="DN/e-", label="Gain", help="EMVA's K.", gt=0, le=1e9)
    black_level: float = quantity(0.0, unit="DN", label="Black level", ge=-1e6, le=1e6)
    read_noise: float = quantity(0.0, unit="e-", label="Read noise", help="Standard deviation.", ge=0, le=1e7)
    saturation: float | None = quantity(
        None, unit="DN", label="Saturation", help="Pixels at or above it only say 'at least this much'."
    )
    step: float = quantity(1.0, unit="DN", label="Quantisation step", help="0 for a float image.", ge=0, le=1e6)

    @property
    def floor(self) -> float:
        """Variance in e-^2 of a pixel without light."""
        return max(self.read_noise**2 + (self.step / self.gain) ** 2 / 12.0, 0.01)


def image_saturation(image: NDArray[Any]) -> float | None:
    """The full scale that an integer image touches in DN, None if it touches none."""
    if not np.issubdtype(image.dtype, np.integer):
        return None
    highest = int(image.max())
    return float(highest) if highest in FULL_SCALES else None
