"""Which value has which colour: limits by hand or by a share of the values, of errors and of heights. Qt-free."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from render.base.arrays import Float
from studio.preview.diverging_colours import NONE, diverging
from studio.scan.result_series import symmetric_limit

LengthUnit = Literal["µm", "mm"]
SHARES = (90.0, 95.0, 98.0, 99.5, 100.0)
"""Percent of the values that the limits may hold by themselves."""
PER_METRE: dict[str, float] = {"µm": 1e6, "mm": 1e3}
# viridis (van der Walt & Smith 2015): ascends in lightness, told apart by every common colour vision
VIRIDIS = np.array(
    [
        (68, 1, 84), (72, 36, 117), (65, 68, 135), (53, 95, 141), (42, 120, 142), (33, 145, 140),
        (34, 168, 132), (68, 191, 112), (122, 209, 81), (189, 223, 38), (253, 231, 37),
    ],
    dtype=np.float64,
)  # fmt: skip


@dataclass(frozen=True)
class ColourScale:
    """Limits in the unit of the values; `about_zero`: of a signed error, white at zero, and both limits alike."""

    about_zero: bool = True
    share: float = 98.0
    """Percent of the values within the limits, where no hand has set these."""
    by_hand: tuple[float, float] | None = None
    by_share: bool = False
    """A person has chosen the share, also where others are the first limits."""

    def limits(self, values: Float, first: tuple[float, float] | None = None) -> tuple[float, float]:
        """Lowest and highest value of its own colour; first: until a person chooses others, None: by the share."""
        if self.by_hand is not None:
            return self.by_hand
        if first is not None and not self.by_share:
            return first
        finite = values[np.isfinite(values)]
        if self.about_zero:
            top = symmetric_limit(finite, self.share)
            return -top, top
        if len(finite) == 0:
            return 0.0, 1.0
        low, high = np.percentile(finite, (50.0 - 0.5 * self.share, 50.0 + 0.5 * self.share)).tolist()
        return (low, high) if high > low else (low - 0.5, low + 0.5)

    def colours(self, values: Float, low: float, high: float) -> NDArray[np.uint8]:
        """(n,) -> (n, 3) RGB; beyond the limits as at them, NaN grey."""
        if self.about_zero:
            return diverging(values - 0.5 * (low + high), 0.5 * (high - low))
        place = np.clip(np.nan_to_num((values - low) / (high - low)), 0.0, 1.0) * (len(VIRIDIS) - 1)
        stops = np.arange(len(VIRIDIS))
        found = np.stack([np.interp(place, stops, VIRIDIS[:, k]) for k in range(3)], axis=1)
        found[~np.isfinite(values)] = NONE
        return np.asarray(np.round(found), dtype=np.uint8)

    def dragged(self, limits: tuple[float, float], upper: bool, to: float) -> ColourScale:
        """One limit brought to a value by hand; about zero the other goes with it, and none passes the other."""
        low, high = limits
        least = 1e-3 * (high - low)
        if self.about_zero:
            top = max(to if upper else -to, least)
            return replace(self, by_hand=(-top, top))
        return replace(self, by_hand=(low, max(to, low + least)) if upper else (min(to, high - least), high))

    def at(self, low: float, high: float) -> ColourScale:
        """With these limits."""
        return replace(self, by_hand=(low, high))

    def automatic(self, share: float) -> ColourScale:
        """By the values again."""
        return replace(self, share=share, by_hand=None, by_share=True)

    def as_before(self) -> ColourScale:
        """Without what a hand has set."""
        return replace(self, by_hand=None)


def tick(value: float) -> str:
    """Three digits with its sign."""
    if value == 0.0 or not math.isfinite(value):
        return "0"
    return f"{value:+.3g}".replace("-", "\u2212") if abs(value) < 1000.0 else f"{value:+.0f}".replace("-", "\u2212")
