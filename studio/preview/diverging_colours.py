"""The colours of a signed error: blue through white to red, told apart by every common colour vision. Qt-free."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from render.base.arrays import Float

# RdBu of ColorBrewer (Harrower & Brewer 2003), reversed: what `analysis.report.colour.DIVERGING` names
STOPS = np.array(
    [
        (5, 48, 97), (33, 102, 172), (67, 147, 195), (146, 197, 222), (209, 229, 240), (247, 247, 247),
        (253, 219, 199), (244, 165, 130), (214, 96, 77), (178, 24, 43), (103, 0, 31),
    ],
    dtype=np.float64,
)  # fmt: skip
NONE = (140, 140, 140)
"""Of a value that is not there."""


def diverging(values: Float, limit: float) -> NDArray[np.uint8]:
    """(n,) values -> (n, 3) RGB; -limit is the darkest blue, 0 white, limit the darkest red, NaN grey."""
    place = np.clip(np.nan_to_num(values / limit), -1.0, 1.0) * 5.0 + 5.0
    steps = np.arange(len(STOPS))
    colours = np.stack([np.interp(place, steps, STOPS[:, k]) for k in range(3)], axis=1)
    colours[~np.isfinite(values)] = NONE
    return np.asarray(np.round(colours), dtype=np.uint8)
