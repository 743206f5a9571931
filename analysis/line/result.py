"""What every line extraction returns: up to K peaks for each scan line, each with its sigma or its reason."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]
Axis = Literal["rows", "columns"]


class Flag(IntEnum):
    """Why a peak is as it is. OK and SATURATED carry a position, every other flag a reason for there being none."""

    OK = 0
    SATURATED = 1
    """Measured from the unsaturated wings or the plateau's centre."""
    NO_PEAK = 2
    """Nothing rises above the noise."""
    AT_BORDER = 3
    """The peak is cut by the image's edge."""
    TOO_FEW_PIXELS = 4
    """Fewer usable pixels than unknowns."""
    NOT_CONVERGED = 5
    OUT_OF_WINDOW = 6
    """The fit left the window around the peak."""
    TOO_WIDE = 7
    """Wider than a line can be."""
    NO_PIXELS = 8
    """The scan line holds no usable pixel: none of the laser's colour, or none that is a number."""


@dataclass(frozen=True)
class Line:
    """Peaks by scan line: arrays (n, k), n image rows (axis "rows") or columns, k peaks, strongest first.

    `u` is the sub-pixel position along the scan line in px (the column on axis "rows"), NaN where the flag gives a
    reason, `sigma_u` its standard deviation, `width` the Gaussian sigma of the line, both px; `amplitude` and
    `background` in electrons (DN / gain); `chi2` the reduced chi-square of the fit, NaN for methods without one.
    """

    axis: Axis
    method: str
    u: Float
    sigma_u: Float
    width: Float
    amplitude: Float
    background: Float
    chi2: Float
    flag: NDArray[np.uint8]

    @property
    def valid(self) -> NDArray[np.bool_]:
        """(n, k): has a position."""
        return self.flag <= Flag.SATURATED

    def pixels(self) -> tuple[Float, NDArray[np.intp], NDArray[np.intp]]:
        """Valid peaks as (m, 2) pixels (u, v) in the image, with their scan line (m,) and rank (m,)."""
        index, rank = np.nonzero(self.valid)
        along = self.u[index, rank]
        pairs = (along, index.astype(np.float64)) if self.axis == "rows" else (index.astype(np.float64), along)
        return np.stack(pairs, axis=1), index, rank
