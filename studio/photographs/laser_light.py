"""The image that is measured: one channel of a colour photograph, or several, with what is clipped marked as clipped.

Selecting and measuring are two things. A colour less the others shows where the laser's light is, in room light too;
but it is hollow where the line's core is white, and in a JPEG it has half the resolution. There the channel measures
that scatters least about a smooth line, within the band that the colour selects.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from analysis.line.detection.noise import NoiseModel, image_saturation
from analysis.line.extract import extract
from analysis.line.result import Axis
from analysis.line.series.subtract import subtract_off
from analysis.line.settings import ExtractionSettings
from studio.photographs.evidence import COLOURS, Chain, Colour, brightest

Floats = NDArray[np.float64]
Channel = Literal["mono", "luminance", "red", "green", "blue", "difference"]

LOSSY_FULL = 250.0
"""DN: a JPEG scatters what is clipped at 255 by a few numbers."""
RUN, RUNS = 32, 8
"""Scan lines of a run, and runs, on which channels are compared."""
LAG = 4
"""Scan lines between positions compared: a JPEG's and a demosaiced colour is alike on neighbouring ones."""
ROOM, SPARE = 8.0, 24.0
"""Half width of the band about the line: so many sigmas of its ridge, and px."""
BRIDGE = 12
"""Scan lines of the shrunk image that the band goes on where its chain has none: as far as a chain may skip."""
LEVEL = 128
"""px of level ground on either side of the bands, at least: what a background and its noise are told by."""
OWN = 0.25
"""Of the band, on either side of the chain, where a position is the line's."""
TIE = 0.1
"""Relative difference of scatter below which the first of two channels is taken."""
MOST_FOUND, ALL_FOUND = 0.9, 0.95
"""A channel that finds fewer than this share of the most is none to measure with; one of another colour than the
laser's, than this share of what that finds."""


@dataclass(frozen=True)
class Light:
    """A mono image and the DN from which on it is clipped; None: nothing is, or its type tells."""

    image: NDArray[Any]
    saturation: float | None
    open: NDArray[np.bool_] | None = None
    """(h, w) where the image is the photograph's own; None: everywhere."""

    @property
    def seen(self) -> NDArray[Any]:
        """The image with NaN where it is not the photograph's own: what its noise is told by."""
        return self.image if self.open is None else np.where(self.open, self.image, np.float32(np.nan))


def full_scale(image: NDArray[Any], lossy: bool) -> float | None:
    """DN from which on an image is clipped; None: it is not."""
    full = image_saturation(image)
    return LOSSY_FULL if full is not None and lossy and image.dtype == np.uint8 else full


def laser_light(
    image: NDArray[Any], off: NDArray[Any] | None, channel: Channel, colour: Colour, full: float | None
) -> Light:
    """Image (h, w) or (h, w, 3), less its laser-off image -> what `channel` measures. InputError: as `subtract_off`.

    full: DN from which on the image is clipped. "mono" is the sum of all channels, "difference" twice the laser's less
    the others; they and the luminance are clipped where a channel that carries them is.
    """
    if image.ndim == 2:
        return _less(image, off, full)
    if channel in COLOURS:
        k = COLOURS.index(channel)
        return _less(cv2.extractChannel(image, k), None if off is None else cv2.extractChannel(off, k), full)
    clipped = image[..., 0]
    if channel == "difference":
        assert colour != "mono"
        weights = np.full(3, -1.0)
        weights[COLOURS.index(colour)] = 2.0
        clipped = image[..., COLOURS.index(colour)]
    elif channel == "luminance":
        weights, clipped = np.array([0.299, 0.587, 0.114]), brightest(image)
    else:
        weights, clipped = np.ones(3), brightest(image)
    mixed = _mixed(image, weights)
    if full is None:
        return _less(mixed, None if off is None else _mixed(off, weights), None)
    top = max(full, float(np.nanmax(mixed)))
    mixed[clipped >= full] = top
    return _less(mixed, None if off is None else _mixed(off, weights), top)


def _mixed(image: NDArray[Any], weights: NDArray[np.float64]) -> NDArray[np.float32]:
    """(h, w, 3) -> (h, w); whole numbers stay whole, so that the noise of rounding is known."""
    mixed: NDArray[np.float32] = cv2.transform(image.astype(np.float32, copy=False), weights[None, :])
    return np.rint(mixed) if image.dtype.kind == "u" else mixed


def _less(image: NDArray[Any], off: NDArray[Any] | None, full: float | None) -> Light:
    if off is None:
        return Light(image, full)
    return Light(*subtract_off(image, off, full))


def channels_to_try(colour: Colour, difference: bool, lossy: bool) -> tuple[Channel, ...]:
    """Which may measure, the one with the least foreign light first."""
    whole: Channel = "luminance" if lossy else "mono"
    if colour == "mono":
        return (whole, *COLOURS)
    others = [one for one in COLOURS if one != colour]
    first: tuple[Channel, ...] = ("difference",) if difference and not lossy else ()
    return (*first, colour, whole, *others)


def scatter_of(
    image: NDArray[Any],
    off: NDArray[Any] | None,
    chain: Chain,
    channel: Channel,
    colour: Colour,
    axis: Axis,
    lossy: bool,
) -> tuple[float, int]:
    """How far positions measured in a channel scatter about a smooth line, px, and how many were found.

    Upright pieces of the image about the chain are measured; inf: too few.
    """
    pieces = _pieces(image, off, chain, axis)
    if pieces is None:
        return np.inf, 0
    some, some_off, expected, reach = pieces
    light = laser_light(some, some_off, channel, colour, full_scale(some, lossy))
    steps = np.abs(np.diff(light.image.astype(np.float32), axis=1))
    dark = 1.05 * float(np.median(steps)) + 0.3  # half a DN of rounding in each of two neighbours
    gain = max(float(np.nanmax(light.image)), 1.0) / 1e4
    noise = NoiseModel(gain=gain, read_noise=dark / gain, saturation=light.saturation)
    noise = noise.model_copy(update={"alike": True})  # of a photograph's colours
    line = extract(light.image, settings=ExtractionSettings(), noise=noise, threads=1, shared=False)
    # in another channel the line may be dark, and what is beside it smooth
    on = line.valid[:, 0] & (np.abs(line.u[:, 0] - expected) <= reach)
    u = np.where(on, line.u[:, 0], np.nan).reshape(-1, RUN)
    bends = u[:, : -2 * LAG] - 2.0 * u[:, LAG:-LAG] + u[:, 2 * LAG :]
    bends = np.abs(bends[np.isfinite(bends)])
    if len(bends) < RUN // 2:
        return np.inf, int(np.isfinite(u).sum())
    return 1.4826 * float(np.median(bends)) / 6.0**0.5, int(np.isfinite(u).sum())


def _pieces(
    image: NDArray[Any], off: NDArray[Any] | None, chain: Chain, axis: Axis
) -> tuple[NDArray[Any], NDArray[Any] | None, Floats, Floats] | None:
    """Runs of scan lines about the chain, one below the other: (RUN n, w) or (RUN n, w, 3), those of the laser-off
    image, and (RUN n,) where on them the chain is and how far the line may be from it.
    """
    if axis == "columns":
        image = image.swapaxes(0, 1)
        off = None if off is None else off.swapaxes(0, 1)
    low, high = band(chain, *image.shape[:2])
    there = (high > low).reshape(-1)
    starts = [s for s in range(0, len(image) - RUN + 1, RUN) if there[s : s + RUN].all()]
    if not starts:
        return None
    starts = [starts[k] for k in np.unique(np.linspace(0, len(starts) - 1, RUNS).astype(int))]
    width = min(image.shape[1], max(int(np.median(high[there] - low[there])), 32))
    middles = [int(np.clip((low[s] + high[s + RUN - 1]) // 2 - width // 2, 0, image.shape[1] - width)) for s in starts]
    cut = [(slice(s, s + RUN), slice(m, m + width)) for s, m in zip(starts, middles, strict=True)]
    ends = [(low[rows] - across.start, high[rows] - 1 - across.start) for rows, across in cut]
    first, last = (np.concatenate(side) for side in zip(*ends, strict=True))
    return (
        np.concatenate([image[one] for one in cut]),
        None if off is None else np.concatenate([off[one] for one in cut]),
        0.5 * (first + last),
        OWN * (last - first),
    )


def band(chain: Chain, count: int, width: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """First and past-the-last pixel (count,) of each scan line that may be the line's; equal: none."""
    n = len(chain.u)
    there = np.flatnonzero(np.isfinite(chain.u))
    empty = np.zeros(count, np.intp)
    if len(there) < 2:
        return empty, empty
    factor = max(1, count // n)
    from scipy.ndimage import distance_transform_edt

    distance = distance_transform_edt(~np.isfinite(chain.u))
    rows = np.arange(count)
    at = (rows + 0.5) / factor - 0.5
    half = ROOM * np.interp(at, there, chain.scale[there]) + SPARE
    near = distance[np.clip(rows // factor, 0, n - 1)] <= BRIDGE
    # in a gap the line may still be where it was before it, or already where it is after it
    after = np.clip(np.searchsorted(there, at), 0, len(there) - 1)
    before = np.clip(after - 1, 0, None)
    gap = (there[after] - there[before] > 1) & (there[before] < at) & (at < there[after])
    middle = np.interp(at, there, chain.u[there])
    sides = chain.u[there[before]], chain.u[there[after]]
    least, most = (np.where(gap, choice(*sides), middle) for choice in (np.minimum, np.maximum))
    low = np.where(near, np.clip(np.floor(least - half), 0, width), 0).astype(np.intp)
    high = np.where(near, np.clip(np.ceil(most + half) + 1, 0, width), 0).astype(np.intp)
    return low, np.maximum(low, high)


def about(chains: Sequence[Chain], axis: Axis, shape: tuple[int, ...]) -> slice:
    """Pixels of each scan line of an image (h, w, ...) that hold the bands of the chains, and as much level ground."""
    count, width = shape[:2] if axis == "rows" else shape[1::-1]
    low, high = np.stack([band(chain, count, width) for chain in chains], axis=1)
    there = high > low
    if not there.any():
        return slice(0, width)
    margin = max(int((high - low).max()), LEVEL)
    return slice(max(int(low[there].min()) - margin, 0), min(int(high[there].max()) + margin, width))


@dataclass(frozen=True)
class Bands:
    """Where the lines of an image may be: so many pixels of each of its scan lines, of any of its bands."""

    rows: NDArray[np.intp]
    """(m, 1) scan lines that have some."""
    places: NDArray[np.intp]
    """(m, n) pixels side by side, those of narrower bands taken more than once."""
    shape: tuple[int, int]
    """Scan lines and pixels of each."""
    axis: Axis

    def of(self, image: NDArray[Any]) -> NDArray[Any]:
        """Image (h, w, ...) -> (m, n, ...)."""
        return np.ascontiguousarray((image if self.axis == "rows" else image.swapaxes(0, 1))[self.rows, self.places])

    def on_level_ground(self, light: Light) -> Light:
        """The light (m, n) of the bands in an image (h, w): what is beside them is no line's and hides none."""
        level, inside = np.empty(self.shape, np.float32), np.zeros(self.shape, np.bool_)
        ground = np.rint(np.median(light.image, axis=1))
        level[:] = np.median(ground) if len(ground) else 0.0
        level[self.rows[:, 0]] = ground[:, None]
        level[self.rows, self.places], inside[self.rows, self.places] = light.image, True
        full = image_saturation(light.image) if light.saturation is None and light.image.size else light.saturation
        return Light(level, full, inside) if self.axis == "rows" else Light(level.T, full, inside.T)


def bands(chains: Sequence[Chain], axis: Axis, shape: tuple[int, ...]) -> Bands:
    """Of an image (h, w, ...)."""
    count, width = shape[:2] if axis == "rows" else shape[1::-1]
    low, high = np.stack([band(chain, count, width) for chain in chains], axis=1)
    ends = np.cumsum(high - low, axis=0)
    rows = np.flatnonzero(ends[-1] > 0)
    number = np.arange(int(ends[-1].max())) % np.maximum(ends[-1][rows], 1)[:, None]
    places = np.zeros(number.shape, np.intp)
    for first, before, end in zip(low, ends - (high - low), ends, strict=True):
        own = (number >= before[rows, None]) & (number < end[rows, None])
        places = np.where(own, first[rows, None] + number - before[rows, None], places)
    return Bands(rows[:, None], places, (count, width), axis)


def without(light: Light, closed: NDArray[np.bool_]) -> Light:
    """The light with what a mask closes (h, w) taken out."""
    pixels = np.array(light.image, np.float32)
    pixels[closed] = np.nan
    full = image_saturation(light.image) if light.saturation is None else light.saturation
    return Light(pixels, full, ~closed if light.open is None else light.open & ~closed)
