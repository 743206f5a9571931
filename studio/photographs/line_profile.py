"""What photographs show of a laser line beside its place: profile across it, noise against light, noise along it.

Every scan line is looked at about its own position: thousands of them sample one profile far finer than a pixel.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from analysis.line.result import Flag, Line
from render.base.arrays import Float

BIN = 0.25
"""px of the profile's bins."""
CORE = 3.5
"""Widths of the line within which a scan line is compared with the mean profile."""
SAMPLES = 8
"""Pixels of a profile's bin below which it says nothing."""
BRIGHTEST = 0.998
"""Quantile of the light up to which there are bins."""
ODD = 4.0
"""Times the usual that the noise of a whole scan line may be."""
LEVELS, FEWEST = 24, 30
"""Bins of light for the noise, and pixels below which one says nothing."""
DARK = 3.0
"""DN above the lowest number from which a mean is not cut off by it."""
BESIDE = 8
"""px beyond these that tell the noise of the ground."""
LEAST_FREE = 0.1
"""Share of a pixel's noise that the fit of its scan line leaves, below which it says nothing."""


@dataclass(frozen=True)
class Stretch:
    """Scan lines of one photograph: windows (n, w) of DN about the line and the distance of each pixel from it, px."""

    values: Float
    distance: Float
    sigma_u: Float
    """(n,) of the positions, px."""
    row: NDArray[np.intp]
    """(n,) scan line."""
    column: NDArray[np.intp]
    """(n,) of the window's first pixel."""

    def of(self, some: NDArray[np.bool_] | NDArray[np.intp]) -> Stretch:
        """Some of its scan lines."""
        return Stretch(self.values[some], self.distance[some], self.sigma_u[some], self.row[some], self.column[some])


class Profile(NamedTuple):
    """Mean of many scan lines by distance from the line, (m,)."""

    distance: Float
    """px."""
    value: Float
    """Share of the line's light in a pixel there."""
    sigma: Float
    """Of that mean."""


@dataclass(frozen=True)
class Transfer:
    """Photon transfer: (k,) mean DN, DN of that from the laser, variance DN^2 and the variance's own sigma."""

    mean: Float
    light: Float
    variance: Float
    sigma: Float
    edges: Float
    """(k + 1,) DN of the laser's light between which each is."""
    alike: float
    """Correlation of the noise of neighbouring scan lines."""
    alike_sigma: float


def stretch_of(image: NDArray[np.generic], line: Line, half: int, saturation: float) -> Stretch:
    """Image (h, w) DN and its line -> the scan lines whose window of 2 half + 1 px is whole and nowhere saturated."""
    upright = np.asarray(image if line.axis == "rows" else image.T, np.float64)
    rows = np.flatnonzero(np.isin(line.flag[:, 0], (Flag.OK, Flag.MISFIT, Flag.SPECKLED)))
    middle = np.rint(line.u[rows, 0]).astype(np.intp)
    whole = (middle >= half) & (middle + half < upright.shape[1])
    rows, middle = rows[whole], middle[whole]
    columns = middle[:, None] + np.arange(-half, half + 1)
    values = upright[rows[:, None], columns]
    free = values.max(axis=1, initial=0.0) < saturation
    rows, columns, values = rows[free], columns[free], values[free]
    return Stretch(values, columns - line.u[rows, :1], line.sigma_u[rows, 0], rows, columns[:, 0])


def mean_profile(stretch: Stretch, rows: NDArray[np.intp], width: float) -> Profile:
    """The mean of some of its scan lines; width: the line's sigma, px, beyond six of which is ground."""
    values, distance = stretch.values[rows], stretch.distance[rows]
    ground = np.median(values[:, _beside(distance, width)], axis=1)
    light = (values - ground[:, None]) / (values - ground[:, None]).sum(axis=1, keepdims=True)
    number = np.rint(distance / BIN).astype(np.intp)
    first = int(number.min())
    place, flat = (number - first).ravel(), light.ravel()
    count = np.bincount(place)
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = np.bincount(place, flat) / count
        spread = np.sqrt(np.maximum(np.bincount(place, flat**2) / count - mean**2, 0.0) / (count - 1))
        middle = np.bincount(place, distance.ravel()) / count
    good = count >= SAMPLES
    good[good] &= spread[good] > 0.0
    return Profile(middle[good], mean[good], spread[good])


def _beside(distance: Float, width: float) -> NDArray[np.bool_]:
    """Columns of the windows that are beside the line on every scan line; the outermost where none is."""
    found = np.asarray((np.abs(distance) > 6.0 * width).all(axis=0), np.bool_)
    found[[0, -1]] = True
    return found


def core_reach(width: float) -> int:
    """px to either side of a line of a sigma, px, that hold its light."""
    return int(np.ceil(CORE * width))


def near(stretch: Stretch, width: float) -> Stretch:
    """The pixels whose noise is looked at: within `CORE` widths of the line, and `BESIDE`."""
    middle, reach = stretch.values.shape[1] // 2, core_reach(width) + BESIDE
    columns = slice(max(middle - reach, 0), middle + reach + 1)
    return replace(stretch, values=stretch.values[:, columns], distance=stretch.distance[:, columns])


def transfer_of(
    stretch: Stretch, shape: Float, slope: Float, width: float, lowest: float, edges: Float | None = None
) -> Transfer | None:
    """Noise of the pixels near the line: what is left of each scan line by its own height, place and ground.

    shape, slope: (n, w) model of the line at every pixel, and its derivative. lowest: DN that the sensor cuts off at.
    edges: DN of the laser's light by which pixels are sorted; None: as many in each. None: too few pixels.
    """
    core = np.abs(np.arange(stretch.values.shape[1]) - stretch.values.shape[1] // 2) <= core_reach(width)
    values = stretch.values
    basis = np.stack([shape, slope, np.ones_like(values)], axis=2)
    # the same pixels of the next scan line: what the profile misses is another at another place
    after = np.flatnonzero((np.diff(stretch.row) == 1) & (np.diff(stretch.column) == 0))
    weight = np.ones_like(values)
    for _ in range(3):  # weights of the noise found so far
        root = np.sqrt(weight)
        q, r = np.linalg.qr(basis * root[..., None])
        seen = np.einsum("nwk,nw->nk", q, values * root)
        mean = np.einsum("nwk,nk->nw", q, seen) / root
        free = 1.0 - np.einsum("nwk,nwk->nw", q, q)
        left = np.where(free > LEAST_FREE, (values - mean) / np.sqrt(np.maximum(free, LEAST_FREE)), np.nan)
        # what the profile misses is alike on neighbouring scan lines, and goes with their difference
        squares = 0.5 * (left[after] - left[after + 1]) ** 2
        level = 0.5 * (mean[after] + mean[after + 1])
        known = np.isfinite(squares) & (level > lowest + DARK)
        if known.sum() < LEVELS * FEWEST:
            return None
        line = np.polynomial.polynomial.polyfit(level[known], squares[known], 1)
        weight = 1.0 / np.maximum(line[0] + line[1] * mean, 0.05 * float(np.mean(squares[known])))
    light = (np.linalg.pinv(r) @ seen[..., None])[:, :1, 0] * shape
    light = 0.5 * (light[after] + light[after + 1])
    # a scan line that no line of this shape is on, as at an edge, has no noise to tell
    odd = np.nanmean(np.where(known, squares / np.maximum(line[0] + line[1] * level, 1e-9), np.nan), axis=1)
    known &= (odd <= ODD * np.nanmedian(odd))[:, None]
    edges = light_edges(light[known]) if edges is None else edges
    place = np.clip(np.searchsorted(edges, light, side="right") - 1, 0, len(edges) - 2)
    rows = []
    for k in range(len(edges) - 1):
        here = known & (place == k)
        if here.sum() >= FEWEST:
            some = squares[here]
            # each scan line is in two differences
            sigma = some.std() / some.mean() / np.sqrt(here.sum() / 1.5)
            rows.append([level[here].mean(), light[here].mean(), some.mean(), sigma])
        else:
            rows.append([np.nan] * 4)
    mean_of, light_of, variance, sigma = np.array(rows).T
    sigma = sigma * _smooth(mean_of, variance, sigma)
    equal = (left * root)[:, core]
    pairs = equal[after] * equal[after + 1]
    count = int(np.isfinite(pairs).sum())
    alike = float(np.nanmean(pairs) / np.nanmean(equal**2))
    return Transfer(mean_of, light_of, variance, sigma, edges, alike, 1.0 / np.sqrt(count))


def light_edges(light: Float) -> Float:
    """(m,) DN of the laser's light on pixels -> edges of bins, finer where it is little and most pixels are."""
    top = float(np.quantile(light, BRIGHTEST))
    return np.concatenate([[-np.inf], top * np.linspace(0.0, 1.0, LEVELS)[1:] ** 2])


def _smooth(level: Float, variance: Float, relative: Float) -> Float:
    """(k,) variance, DN^2, as a parabola of the level: by their own noise bins that are low would weigh more."""
    good = np.isfinite(variance) & (relative > 0.0)
    out = np.full(len(level), np.nan)
    if good.sum() < 4:
        return np.where(good, variance, np.nan)
    weight, usual = 1.0 / relative[good], variance[good]
    for _ in range(3):
        found = np.polynomial.polynomial.polyfit(level[good], variance[good], 2, w=weight / usual)
        usual = np.maximum(np.polynomial.polynomial.polyval(level[good], found), 0.1 * variance[good].min())
    out[good] = usual
    return out
