"""The image that is measured, and which of its pixels are the photograph's own."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.line.detection.noise import image_saturation


@dataclass(frozen=True)
class Light:
    """A mono image and the DN from which on it is clipped; None: nothing is, or its type tells."""

    image: NDArray[Any]
    saturation: float | None
    open: NDArray[np.bool_] | None = None
    """(h, w) where the image is the photograph's own; None: everywhere."""
    around: NDArray[Any] | None = None
    """(h, w) with what is beside the line and was levelled out of the image; None: nothing was."""

    @property
    def seen(self) -> NDArray[Any]:
        """The image with NaN where it is not the photograph's own: what its noise is told by."""
        whole = self.image if self.around is None else self.around
        return whole if self.open is None else np.where(self.open, whole, np.float32(np.nan))


def without(light: Light, closed: NDArray[np.bool_]) -> Light:
    """The light with what a mask closes (h, w) taken out."""
    pixels = np.array(light.image, np.float32)
    pixels[closed] = np.nan
    full = image_saturation(light.image) if light.saturation is None else light.saturation
    return Light(pixels, full, ~closed if light.open is None else light.open & ~closed, light.around)
