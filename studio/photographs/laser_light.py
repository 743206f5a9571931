"""The image that is measured: one channel of a colour photograph, or several, with what is clipped marked as clipped.

Selecting and measuring are two things. A colour less the others shows where the laser's light is, in room light too;
but it is hollow where the line's core is white, and in a JPEG it has half the resolution. There the channel measures
that scatters least about a smooth line, within the band that the colour selects.
"""

from __future__ import annotations

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
from studio.photographs.bands import Course, course, level_beside
from studio.photographs.evidence import COLOURS, Chain, Colour, brightest
from studio.photographs.light import Light

Floats = NDArray[np.float64]
Channel = Literal["mono", "luminance", "red", "green", "blue", "difference"]

LOSSY_FULL = 250.0
"""DN: a JPEG scatters what is clipped at 255 by a few numbers."""
RUN, RUNS = 32, 8
"""Scan lines of a run, and runs, on which channels are compared."""
LAG = 4
"""Scan lines between positions compared: a JPEG's and a demosaiced colour is alike on neighbouring ones."""
TIE = 0.1
"""Relative difference of scatter below which the first of two channels is taken."""
MOST_FOUND, ALL_FOUND = 0.9, 0.95
"""A channel that finds fewer than this share of the most is none to measure with; one of another colour than the
laser's, than this share of what that finds."""


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


@dataclass(frozen=True)
class Tried:
    """What a channel makes of a line."""

    scatter: float
    """px, about a smooth line; inf: too few positions."""
    found: int
    width: float
    """px."""
    height: float
    """DN."""


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
) -> Tried:
    """What a channel makes of a line: upright pieces of the image about its chain are measured."""
    pieces = _pieces(image, off, chain, axis)
    if pieces is None:
        return Tried(np.inf, 0, 1.0, 1.0)
    some, some_off, near = pieces
    light = laser_light(some, some_off, channel, colour, full_scale(some, lossy))
    steps = np.abs(np.diff(light.image.astype(np.float32), axis=1))
    dark = 1.05 * float(np.median(steps)) + 0.3  # half a DN of rounding in each of two neighbours
    gain = max(float(np.nanmax(light.image)), 1.0) / 1e4
    noise = NoiseModel(gain=gain, read_noise=dark / gain, saturation=light.saturation)
    noise = noise.model_copy(update={"alike": True})  # of a photograph's colours
    image = level_beside(light.image.astype(np.float32), [near])
    # one line or two is not asked, as it is not when the photograph is measured
    line = extract(image, settings=ExtractionSettings(), noise=noise, threads=1, shared=False, judged=False)
    # in another channel the line may be dark, and what is beside it smooth
    on = line.valid[:, 0] & near.holds(line.u[:, 0])
    u = np.where(on, line.u[:, 0], np.nan).reshape(-1, RUN)
    bends = u[:, : -2 * LAG] - 2.0 * u[:, LAG:-LAG] + u[:, 2 * LAG :]
    bends = np.abs(bends[np.isfinite(bends)])
    scatter = 1.4826 * float(np.median(bends)) / 6.0**0.5 if len(bends) >= RUN // 2 else np.inf
    width, height = (float(np.median(some[on, 0])) if on.any() else 1.0 for some in (line.width, line.amplitude))
    return Tried(scatter, int(np.isfinite(u).sum()), width, gain * height)


def _pieces(
    image: NDArray[Any], off: NDArray[Any] | None, chain: Chain, axis: Axis
) -> tuple[NDArray[Any], NDArray[Any] | None, Course] | None:
    """Runs of scan lines about the chain, one below the other: (RUN n, w) or (RUN n, w, 3), those of the laser-off
    image, and where on them the line may be.
    """
    if axis == "columns":
        image = image.swapaxes(0, 1)
        off = None if off is None else off.swapaxes(0, 1)
    along = course(chain, *image.shape[:2])
    low, high = along.band()
    there = high > low
    starts = [s for s in range(0, len(image) - RUN + 1, RUN) if there[s : s + RUN].all()]
    if not starts:
        return None
    starts = [starts[k] for k in np.unique(np.linspace(0, len(starts) - 1, RUNS).astype(int))]
    width = min(image.shape[1], max(int(np.median(high[there] - low[there])), 32))
    middles = [int(np.clip((low[s] + high[s + RUN - 1]) // 2 - width // 2, 0, image.shape[1] - width)) for s in starts]
    cut = [(slice(s, s + RUN), slice(m, m + width)) for s, m in zip(starts, middles, strict=True)]
    rows = np.concatenate([np.arange(s, s + RUN) for s in starts])
    return (
        np.concatenate([image[one] for one in cut]),
        None if off is None else np.concatenate([off[one] for one in cut]),
        along.part(rows, np.repeat(middles, RUN), width),
    )
