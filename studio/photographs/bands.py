"""Where in an image its lines may be, as the chains of the shrunk image say, and the ground beside them made level.

What else is bright in the room hides no line then, and is taken for none: the squares of a board, a window, an edge.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from analysis.line.detection.noise import image_saturation
from analysis.line.result import Axis
from studio.photographs.evidence import Chain
from studio.photographs.light import Light

Ints = NDArray[np.intp]
Floats = NDArray[np.float64]
Floats32 = NDArray[np.float32]

ROOM, SPARE = 8.0, 24.0
"""Half width of the band about the line that its noise is told by: so many sigmas of its ridge, and px."""
NEAR, BESIDE = 5.0, 10.0
"""The same of the band that the line is measured in."""
BRIDGE = 12
"""Scan lines of the shrunk image that the band goes on where its chain has none: as far as a chain may skip."""
LEVEL = 128
"""px of level ground on either side of the bands, at least: what a background and its noise are told by."""
INNER, RISE = 1.5, 0.3
"""Sigmas of the ridge beyond which the light beside the line falls; of the line's height by which it rises again where
something else begins."""
SMOOTH = 5
"""Scan lines and px over which that is judged."""
END = 3
"""px at an end of that band by which the level beyond it is told."""


@dataclass(frozen=True)
class Course:
    """A line on each scan line (n,) of an image."""

    least: Floats
    most: Floats
    """px between which its middle is: apart where the shrunk image has it on two sides, or jumping."""
    scale: Floats
    """Sigma of its ridge, px."""
    beyond: Floats
    """px to the nearest scan line on which it was seen, beyond the next; infinite: too far to say."""
    width: int
    """Pixels of a scan line."""

    def band(self, room: float = ROOM, spare: float = SPARE) -> tuple[Ints, Ints]:
        """First and past-the-last pixel (n,) of each scan line that may be the line's; equal: none.

        room, spare: half width, in sigmas of the ridge and px.
        """
        known = np.isfinite(self.beyond)
        half = room * self.scale + spare + np.where(known, self.beyond, 0.0)
        low = np.where(known, np.clip(np.floor(self.least - half), 0, self.width), 0).astype(np.intp)
        high = np.where(known, np.clip(np.ceil(self.most + half) + 1, 0, self.width), 0).astype(np.intp)
        return low, np.maximum(low, high)

    def near(self) -> tuple[Ints, Ints]:
        """The same of the band that the line is measured in."""
        return self.band(NEAR, BESIDE)

    def holds(self, u: Floats) -> NDArray[np.bool_]:
        """Whether positions (n,) can be the line's."""
        low, high = self.near()
        return np.asarray((low <= u) & (u <= high - 1))

    def part(self, rows: Ints, first: Ints, width: int) -> Course:
        """Of some scan lines (m,), each from a pixel on."""
        least, most = self.least[rows] - first, self.most[rows] - first
        return Course(least, most, self.scale[rows], self.beyond[rows], width)


def course(chain: Chain, count: int, width: int) -> Course:
    """A chain of a shrunk image, on each scan line of an image."""
    n = len(chain.u)
    there = np.flatnonzero(np.isfinite(chain.u))
    if len(there) < 2:
        nothing = np.zeros(count)
        return Course(nothing, nothing, nothing, np.full(count, np.inf), width)
    factor = max(1, count // n)
    at = (np.arange(count) + 0.5) / factor - 0.5
    # in a gap, and between two scan lines of the shrunk image, the line may still be where it was before, or already
    # where it is after
    after = np.clip(np.searchsorted(there, at), 0, len(there) - 1)
    before = np.clip(after - 1, 0, None)
    ends = np.maximum(there[0] - at, at - there[-1])
    off = np.maximum(np.minimum(at - there[before], there[after] - at), ends)
    within = ends < 0.0
    sides = chain.u[there[before]], chain.u[there[after]]
    middle, scale = (np.interp(at, there, values[there]) for values in (chain.u, chain.scale))
    smooth = (np.abs(sides[1] - sides[0]) <= np.maximum(scale, factor)) | ~within
    least, most = (np.where(smooth, middle, choice(*sides)) for choice in (np.minimum, np.maximum))
    beyond = np.where(off <= BRIDGE, factor * np.maximum(off - 1.0, 0.0), np.inf)
    return Course(least, most, scale, beyond, width)


def _courses(chains: Sequence[Chain], axis: Axis, shape: tuple[int, ...]) -> list[Course]:
    count, width = shape[:2] if axis == "rows" else shape[1::-1]
    return [course(chain, count, width) for chain in chains]


def about(chains: Sequence[Chain], axis: Axis, shape: tuple[int, ...]) -> slice:
    """Pixels of each scan line of an image (h, w, ...) that hold the bands of the chains, and as much level ground."""
    courses = _courses(chains, axis, shape)
    low, high = np.stack([one.band() for one in courses], axis=1)
    there = high > low
    if not there.any():
        return slice(0, courses[0].width)
    margin = max(int((high - low).max()), LEVEL)
    return slice(max(int(low[there].min()) - margin, 0), min(int(high[there].max()) + margin, courses[0].width))


@dataclass(frozen=True)
class Bands:
    """Where the lines of an image may be: so many pixels of each of its scan lines, of any of its bands."""

    rows: Ints
    """(m, 1) scan lines that have some."""
    places: Ints
    """(m, n) pixels side by side, those of narrower bands taken more than once."""
    courses: list[Course]
    """Of the lines, on those scan lines."""
    shape: tuple[int, int]
    """Scan lines and pixels of each."""
    axis: Axis

    def of(self, image: NDArray[Any]) -> NDArray[Any]:
        """Image (h, w, ...) -> (m, n, ...)."""
        return np.ascontiguousarray((image if self.axis == "rows" else image.swapaxes(0, 1))[self.rows, self.places])

    def on_level_ground(self, light: Light) -> Light:
        """The light (m, n) of the bands in an image (h, w): what is beside them is no line's and hides none."""
        around, inside = np.empty(self.shape, np.float32), np.zeros(self.shape, np.bool_)
        ground = np.rint(np.median(light.image, axis=1))
        around[:] = np.median(ground) if len(ground) else 0.0
        around[self.rows[:, 0]] = ground[:, None]
        around[self.rows, self.places], inside[self.rows, self.places] = light.image, True
        image = around.copy()
        image[self.rows[:, 0]] = level_beside(around[self.rows[:, 0]], self.courses)
        full = image_saturation(light.image) if light.saturation is None and light.image.size else light.saturation
        if self.axis == "rows":
            return Light(image, full, inside, around)
        return Light(image.T, full, inside.T, around.T)


def bands(chains: Sequence[Chain], axis: Axis, shape: tuple[int, ...]) -> Bands:
    """Of an image (h, w, ...)."""
    courses = _courses(chains, axis, shape)
    low, high = np.stack([one.band() for one in courses], axis=1)
    ends = np.cumsum(high - low, axis=0)
    rows = np.flatnonzero(ends[-1] > 0)
    number = np.arange(int(ends[-1].max())) % np.maximum(ends[-1][rows], 1)[:, None]
    places = np.zeros(number.shape, np.intp)
    for first, before, end in zip(low, ends - (high - low), ends, strict=True):
        own = (number >= before[rows, None]) & (number < end[rows, None])
        places = np.where(own, first[rows, None] + number - before[rows, None], places)
    width = courses[0].width
    some = [one.part(rows, np.zeros(len(rows), np.intp), width) for one in courses]
    return Bands(rows[:, None], places, some, (len(courses[0].least), width), axis)


def level_beside(image: Floats32, courses: Sequence[Course]) -> Floats32:
    """Scan lines (m, w) of some lines -> the same with what is beside these as level as the pixels next to it, on a
    slope from line to line.
    """
    width = image.shape[1]
    low, high = np.stack([_falling(image, one) for one in courses], axis=2)
    order = np.argsort(np.where(low < high, low, width + 1), axis=1, kind="stable")
    low, high = np.take_along_axis(low, order, axis=1), np.take_along_axis(high, order, axis=1)
    x, rows = np.arange(width), np.arange(len(image))[:, None]

    def level(first: Ints) -> Floats32:
        places = np.clip(first[:, None] + np.arange(END), 0, width - 1)
        return np.asarray(np.rint(image[rows, places].mean(axis=1, keepdims=True)), np.float32)

    none = low == high
    beside = np.where(none[:, :1], image, level(low[:, 0]))
    for k in range(low.shape[1]):
        start = high[:, k, None] - 1
        value = level(high[:, k] - END)
        if k + 1 < low.shape[1]:
            share = np.clip((x - start) / np.maximum(low[:, k + 1, None] - start, 1), 0.0, 1.0).astype(np.float32)
            value = value + share * (np.where(none[:, k + 1, None], value, level(low[:, k + 1])) - value)
        beside = np.where((x > start) & ~none[:, k, None], value, beside)
    own = np.any([(x >= low[:, k, None]) & (x < high[:, k, None]) for k in range(low.shape[1])], axis=0)
    return np.where(own, image, beside)


def _falling(image: Floats32, line: Course) -> tuple[Ints, Ints]:
    """First and past-the-last pixel (m,) of a line in scan lines (m, w): as far as the light falls beside it."""
    low, high = line.near()
    smooth = cv2.blur(image, (SMOOTH, SMOOTH))
    middle = np.rint(0.5 * (line.least + line.most)).astype(np.intp)
    reach = int(max(np.max(high - middle, initial=0), np.max(middle - low, initial=0)))
    if reach <= 0:
        return low, high
    away, rows = np.arange(reach + 1), np.arange(len(image))[:, None]
    inner = INNER * np.maximum(line.scale, 1.0)[:, None]
    clear = (line.most - line.least <= inner[:, 0]) & (line.beyond == 0.0)
    sides = [smooth[rows, np.clip(middle[:, None] + way * away, 0, image.shape[1] - 1)] for way in (-1, 1)]
    top = np.maximum(*(np.where(away <= inner, side, -np.inf).max(axis=1) for side in sides))[:, None]
    ends = []
    for side in sides:
        valley = np.minimum.accumulate(np.where(away < inner, np.inf, side), axis=1)
        rises = away >= inner
        rises[rises] = (side > (1.0 - RISE) * valley + RISE * top)[rises]
        found = rises.any(axis=1) & clear
        last = np.argmax(rises, axis=1)
        lowest = np.argmin(np.where((away >= inner) & (away <= last[:, None]), side, np.inf), axis=1)
        ends.append(np.where(found, lowest, reach + 1))
    return np.maximum(low, middle - ends[0]), np.maximum(np.minimum(high, middle + ends[1] + 1), low)
