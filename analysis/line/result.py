"""What every line extraction returns: up to K peaks for each scan line, each with its sigma or its reason."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import IntEnum
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from render.base.arrays import Float

Axis = Literal["rows", "columns"]


class Flag(IntEnum):
    """Why a peak is as it is. OK and those of `CAUTIOUS` carry a position, others a reason for there being none."""

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
    """The fit left the window around the peak, or is wider."""
    TOO_WIDE = 7
    """Wider than a line can be."""
    NO_PIXELS = 8
    """The scan line holds no usable pixel: none of the laser's colour, or none that is a number."""
    NOT_POSITIVE = 9
    """A pixel that the method takes the logarithm of, or the sum that it divides by, is not above the background."""
    ALONG_SCAN_LINE = 10
    """The line runs along the scan line, so that it has no crossing with it."""
    REJECTED = 11
    """There are peaks, but none that continuity and geometry allow."""
    UNRESOLVED = 12
    """The line is too narrow for its pixels: the position is a mean over where in the pixel it may be."""
    BLENDED = 13
    """Two lines closer than they can be told apart; the position is that of a single one, or of the brighter one where
    they have two peaks or the other is faint."""
    MISFIT = 14
    """The profile is not that of a line, nor of two; sigma_u holds what that may cost."""
    SPECKLED = 15
    """A few grains of speckle make up the line, and one may be taken for all of it; sigma_u is up to 40 % small."""
    UNSURE = 16
    """sigma_u is above the line's own width: where the line is, the pixels do not say."""
    PAST_END = 17
    """Less than half of the light beside it, or of another width: blur past the line's end."""


NEIGHBOURS = 32
"""Scan lines on either side that a narrow line shares its width with."""

CAUTIOUS = (Flag.SATURATED, Flag.UNRESOLVED, Flag.BLENDED, Flag.MISFIT, Flag.SPECKLED)
"""Flags of positions that the model of a line on level ground does not hold for; sigma_u says what that costs."""
SYSTEMATIC = (Flag.BLENDED, Flag.MISFIT)
"""Those whose errors neighbours have in common by what is there, not by chance."""


def overlap(distance: NDArray[np.int64] | int) -> Float:
    """Correlation of the width that scan lines so far apart share: the part of their neighbours that both have."""
    return np.asarray(np.maximum(1.0 - np.abs(distance) / (2.0 * NEIGHBOURS + 1.0), 0.0))


def positioned(flag: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """Which flags carry a position."""
    return np.isin(flag, (Flag.OK, *CAUTIOUS))


@dataclass(frozen=True)
class Line:
    """Peaks by scan line: arrays (n, k), n image rows (axis "rows") or columns, k peaks, strongest first.

    `u` is the sub-pixel position along the scan line in px (the column on axis "rows"), NaN where the flag gives a
    reason, `sigma_u` its standard deviation, NaN where a method cannot say, `width` the line's Gaussian sigma, both
    px; `amplitude` and `background` in electrons (DN / gain); `chi2` the reduced chi-square of the fit, NaN for methods
    without one. Neighbouring scan lines may err alike, by speckle or smoothing: the variance of a mean over many, n, is
    sigma_u^2 `correlation_length` / n; 1 where they do not, None where it is not known. It is made of two parts:
    `shared_u`, px, is how far, and to which side, one standard deviation of what neighbours share moves the position,
    the width of narrow lines, the less the farther apart they are, and what the model of `SYSTEMATIC` ones does not
    hold, which lasts from one to the next; None where they share nothing;
    `length_apart` is the correlation length of what is left of sigma_u. `note` tells what "auto" picked and why;
    `candidates` are the peaks that one was selected from.
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
    note: str = ""
    length_apart: Float | None = None
    shared_u: Float | None = None
    candidates: Line | None = None

    @property
    def v(self) -> Float:
        """(n, k): the scan line itself, px, the other coordinate of `u`."""
        return np.broadcast_to(np.arange(len(self.u), dtype=np.float64)[:, None], self.u.shape)

    @property
    def valid(self) -> NDArray[np.bool_]:
        """(n, k): has a position."""
        return positioned(self.flag)

    @property
    def variance_apart(self) -> Float:
        """(n, k) px^2: of sigma_u what scan lines do not share by their width."""
        return self.sigma_u**2 if self.shared_u is None else np.maximum(self.sigma_u**2 - self.shared_u**2, 0.0)

    @property
    def correlation_length(self) -> Float | None:
        """(n, k) scan lines that err alike, of all that sigma_u holds; None: not known."""
        if self.length_apart is None or self.shared_u is None:
            return self.length_apart
        shared = np.nan_to_num(self.shared_u)
        lasting = np.isin(self.flag, SYSTEMATIC)
        reach, rows = 2 * NEIGHBOURS, len(shared)
        padded = [np.pad(one, ((reach, reach), (0, 0))) for one in (shared, np.where(lasting, shared, 0.0))]
        total = shared.copy()
        for distance in range(1, reach + 1):  # both sides at once: upside down it is the same to the last bit
            every, last = (one[reach - distance :][:rows] + one[reach + distance :][:rows] for one in padded)
            alike = overlap(distance)
            total += alike * every + np.where(lasting, (1.0 - alike) * last, 0.0)
        # neighbours that err to the other side may leave less than nothing of a single one
        own = self.variance_apart * self.length_apart
        both = (own + np.maximum(shared * total, 0.0)) / self.sigma_u**2
        return np.asarray(np.where(shared == 0.0, self.length_apart, both))

    def pixels(self) -> tuple[Float, NDArray[np.intp], NDArray[np.intp]]:
        """Valid peaks as (m, 2) pixels (u, v) in the image, with their scan line (m,) and rank (m,)."""
        index, rank = np.nonzero(self.valid)
        along = self.u[index, rank]
        pairs = (along, index.astype(np.float64)) if self.axis == "rows" else (index.astype(np.float64), along)
        return np.stack(pairs, axis=1), index, rank


NUMBERS = ("u", "sigma_u", "width", "amplitude", "background", "chi2", "length_apart", "shared_u")
"""Of a line, (n, k) each or None."""


def exact_line(axis: Axis, position: Float) -> Line:
    """Peaks at positions (n, k) px that are known without error; NaN where there is none."""
    known = np.where(np.isfinite(position), 1.0, np.nan)
    flag = np.where(np.isfinite(position), Flag.OK, Flag.NO_PEAK).astype(np.uint8)
    return Line(axis, "likelihood", position, 0.0 * known, known, known, known, known, flag)


def side_by_side(lines: Sequence[Line]) -> Line:
    """Lines (n, k), (n, m) .. of the same scan lines -> (n, k + m ..), in all else the first one."""
    together: dict[str, Any] = {"flag": np.concatenate([one.flag for one in lines], axis=1)}
    for name in NUMBERS:
        values = [getattr(one, name) for one in lines]
        nothing = 0.0 if name == "shared_u" else np.nan
        if any(one is not None for one in values):
            filled = [np.full(lines[k].u.shape, nothing) if one is None else one for k, one in enumerate(values)]
            together[name] = np.concatenate(filled, axis=1)
    return replace(lines[0], **together)
