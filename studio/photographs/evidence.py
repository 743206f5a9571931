"""Which way the line runs and what colour it has: by the evidence of a whole set of photographs.

Shrunk images are searched for ridges, in every combination of the channels and along either axis. The ridges of each
are chained (`selection/continuity.py`), and a combination scores by the share of scan lines on which its chain stands
clear of everything else in the image:

    score = mean over scan lines of max(0, (p - q) / (p + q)), over 1 + roughness

p: strength of the ridge on the chain; q: that of the strongest rivals elsewhere; roughness: bend of the chain, px.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from analysis.line.detection.noise import image_saturation
from analysis.line.result import Axis
from analysis.line.selection.continuity import cheapest_chain
from render.base.threads import map_chunks
from studio.photographs.ridge_peaks import SCALES, Floats, Ridges, ridge_peaks

Colour = Literal["mono", "red", "green", "blue"]

AXES: tuple[Axis, ...] = ("rows", "columns")
COLOURS: tuple[Colour, ...] = ("red", "green", "blue")
LONG_SIDE = 480
"""px of the shrunk images: enough to see a line of one pixel of the largest sensors, and little to compute."""
BRIGHTEST = 1e12
"""Of an image of floating point: sums of its squares have to be numbers as well."""
RIVAL = 0.9
"""Quantile of the scan lines' strongest rivals: a lamp on a few scan lines does not hide a line on all of them."""
CLEAR = 1.0 / 3.0
"""Share of a piece of the chain that is clear of its rivals, which glowing, broken surfaces have beside the line."""
JUMP = 5.0
"""px of the shrunk image from one scan line to the next, that a chain's piece ends at."""
NEAR = 3.0
"""Sigmas of the ridge's own filter within which another maximum is a part of it."""
COLOURFUL = 0.43
"""Share of the light that one channel must have for a line that is seen best without colours to have one: a grey line
has a third of it in each, lamp light that no white balance has corrected up to 0.42 in one; a laser's line had 0.48 and
more, as a camera's own light beside its core is as grey as that.
"""
TIE = 0.1
"""Relative difference of scores below which the simpler combination, with the less noise, is taken."""
WEAK = 0.5
"""Score of the other axis over that of the one chosen, above which the choice is doubtful."""
FAINT = 0.02
"""Score below which no line stands out anywhere."""
DOUBTFUL = 0.3
"""Score below which what stands out may as well be an edge of the part: such a one had 0.23, lines 0.4 and more."""
SECOND = 0.25
"""Score from which a second line, clearer of all else than the first is of it, is taken as well."""
ENOUGH = 8
"""Photographs of a set that are looked at."""


@dataclass(frozen=True)
class Combination:
    """Weights of the channels R, G, B."""

    name: str
    colour: Colour
    weights: tuple[float, float, float]

    @property
    def difference(self) -> bool:
        """One colour less the others: grey light is gone, and with a white core the line's middle."""
        return min(self.weights) < 0.0

    def of(self, image: NDArray[Any]) -> Floats:
        """(h, w, 3) or (h, w) -> (h, w); of a mono image itself."""
        if image.ndim == 2:
            return image.astype(np.float32, copy=False)
        mixed: Floats = cv2.transform(image.astype(np.float32, copy=False), np.array([self.weights], np.float32))
        return mixed


def _combinations() -> tuple[Combination, ...]:
    third = 1.0 / 3.0
    found = [Combination("mono", "mono", (third, third, third))]
    for k, colour in enumerate(COLOURS):
        alone = [0.0, 0.0, 0.0]
        alone[k] = 1.0
        found.append(Combination(colour, colour, (alone[0], alone[1], alone[2])))
    for k, colour in enumerate(COLOURS):
        less = [-0.5, -0.5, -0.5]
        less[k] = 1.0
        found.append(Combination(f"{colour} less the others", colour, (less[0], less[1], less[2])))
    return tuple(found)


COMBINATIONS = _combinations()
"""The simplest first: of equals that is taken."""


@dataclass(frozen=True)
class Shrunk:
    """An image (h, w) or (h, w, 3), where it is clipped and where it is closed (h, w), so many times smaller."""

    image: Floats
    saturated: NDArray[np.bool_]
    closed: NDArray[np.bool_] | None
    factor: int


@dataclass(frozen=True)
class Chain:
    """The line of one shrunk image by one combination: position and filter sigma (n,) in px of the whole image."""

    u: NDArray[np.float64]
    """At every scan line of the shrunk image; NaN: none, or no stronger than what is elsewhere."""
    scale: NDArray[np.float64]
    score: float


@dataclass(frozen=True)
class Evidence:
    """What was chosen, and why."""

    axis: Axis
    combination: Combination
    scores: dict[Axis, dict[str, float]]
    """Mean over the photographs, by axis and combination that were allowed."""
    chains: tuple[tuple[Chain, Chain], ...]
    """Of each photograph in the chosen combination: the line, and what would be a second one."""
    colour: Colour
    """Of the laser: the combination's, or that of most of its light where another channel shows it more clearly."""
    clearest: dict[Axis, float]
    """By axis, of the combination that shows the line best: its score, or that of a second line that hides it."""
    light: dict[Colour, float] | None = None
    """Of the line's light, each channel's share; None: nothing told it, or the colour was given."""
    clear: dict[str, float] | None = None
    """By combination, along the axis: what was chosen by, as `clearest` has it; None: the scores."""

    @property
    def score(self) -> float:
        return self.scores[self.axis][self.combination.name]

    @property
    def second(self) -> float:
        """Score of a second line in the chosen combination."""
        return float(np.mean([chain.score for _, chain in self.chains]))

    @property
    def lines(self) -> int:
        """Two where the first line's only rival is a second one, which is as clear of everything else."""
        return 2 if self.second > max(self.score, SECOND) else 1


def find_evidence(
    shrunk: Sequence[Shrunk],
    axis: Axis | None = None,
    colour: Colour | None = None,
) -> Evidence:
    """Shrunk images of a set, one or more -> the choice that all of them support best.

    axis and colour: given; None: any. The other axis is looked at even so: a choice that it speaks against is doubtful.
    """
    mono = all(one.image.ndim == 2 for one in shrunk)
    allowed = [c for c in COMBINATIONS if colour is None or c.colour == colour]
    allowed = allowed[:1] if mono else allowed
    tried = [(way, combination, one) for way in AXES for combination in allowed for one in shrunk]
    found = np.zeros(len(tried))
    ridges: dict[tuple[Axis, Combination, int], Ridges] = {}

    def look(start: int, stop: int) -> None:
        for k in range(start, stop):
            way, combination, one = tried[k]
            ridges[way, combination, k % len(shrunk)] = seen = _ridges(one, combination, way)
            found[k] = score_of(seen)

    def lines_of(combination: Combination, way: Axis) -> list[list[Chain]]:
        """Of each image the two clearest."""
        return [_chains(ridges[way, combination, i], one.factor, 2) for i, one in enumerate(shrunk)]

    map_chunks(look, len(tried), 1)
    means = iter(found.reshape(-1, len(shrunk)).mean(axis=1).tolist())
    scores: dict[Axis, dict[str, float]] = {way: {one.name: next(means) for one in allowed} for way in AXES}
    clear = scores
    if max(max(one.values()) for one in scores.values()) < SECOND:
        # where two lines hide each other, which combination is the clearest is chance
        clear = {way: {c.name: _clearest(lines_of(c, way), scores[way][c.name]) for c in allowed} for way in AXES}
    best_of = {way: _simplest_of_best(allowed, clear[way]) for way in AXES}
    clearest = {way: _clearest(lines_of(best_of[way], way), max(clear[way].values())) for way in AXES}
    best_axis = axis if axis is not None else max(AXES, key=lambda way: clearest[way])
    best = best_of[best_axis]
    both = lines_of(best, best_axis)
    # of two lines that hide each other the first is clear nowhere
    lines = [max(pair, key=lambda chain: np.isfinite(chain.u).sum()) for pair in both]
    light = None if mono or colour is not None else _light_of(shrunk, lines, best_axis)
    seen = best.colour if light is None else _colour_of(light, best)
    return Evidence(
        best_axis, best, scores, tuple((pair[0], pair[1]) for pair in both), seen, clearest, light, clear[best_axis]
    )


def _simplest_of_best(allowed: Sequence[Combination], scores: dict[str, float]) -> Combination:
    highest = max(scores.values())
    return next(one for one in allowed if scores[one.name] >= (1.0 - TIE) * highest)


def _clearest(lines: Sequence[Sequence[Chain]], score: float) -> float:
    """Of two lines that are alike each hides how clear the other is: what is left without the first one tells."""
    if score >= SECOND:
        return score
    second = float(np.mean([pair[1].score for pair in lines]))
    return second if second > SECOND else score


def _light_of(shrunk: Sequence[Shrunk], lines: Sequence[Chain], axis: Axis) -> dict[Colour, float] | None:
    """Each channel's share of the light along the lines, above that beside them; clipped pixels do not say."""
    light = np.zeros(3)
    for one, chain in zip(shrunk, lines, strict=True):
        image, saturated, factor = one.image, one.saturated, one.factor
        if image.ndim == 2:
            continue
        there = np.flatnonzero(np.isfinite(chain.u))
        turned, full = (image, saturated) if axis == "rows" else (image.swapaxes(0, 1), saturated.T)
        x = np.arange(turned.shape[1])
        off = np.abs(x - ((chain.u[there] + 0.5) / factor - 0.5)[:, None]) / (chain.scale[there] / factor)[:, None]
        for row, distance in zip(there, off, strict=True):
            near, beside = (distance < NEAR) & ~full[row], (distance > 2.0 * NEAR) & (distance < 4.0 * NEAR)
            if not beside.any():  # a narrow rectangle ends before
                beside = distance > NEAR
            if near.any() and beside.any():
                light += turned[row][near].mean(axis=0) - turned[row][beside].mean(axis=0)
    above = np.maximum(light, 0.0)
    return dict(zip(COLOURS, (above / above.sum()).tolist(), strict=True)) if above.any() else None


def _colour_of(light: dict[Colour, float], combination: Combination) -> Colour:
    """The channel with most of the line's light."""
    most = max(COLOURS, key=lambda colour: light[colour])
    return "mono" if combination.colour == "mono" and light[most] < COLOURFUL else most


def shrink(image: NDArray[Any], off: NDArray[Any] | None, closed: NDArray[np.bool_] | None = None) -> Shrunk:
    """Image less its laser-off image; closed (h, w): pixels that nobody is to look at."""
    factor = max(1, -(-max(image.shape[:2]) // LONG_SIDE))
    full = image_saturation(image)
    size = (max(1, image.shape[1] // factor), max(1, image.shape[0] // factor))

    def small(values: NDArray[Any]) -> Floats:
        values = np.ascontiguousarray(values[: size[1] * factor, : size[0] * factor])
        if values.dtype.kind == "f" and not (values.min() >= -BRIGHTEST and values.max() <= BRIGHTEST):  # or NaN
            values = np.nan_to_num(np.clip(values, -BRIGHTEST, BRIGHTEST))
        if values.dtype == np.float64:
            values = values.astype(np.float32)
        less: Floats = cv2.resize(values, size, interpolation=cv2.INTER_AREA).astype(np.float32)
        return less

    less = small(image) if off is None else small(image) - small(off)
    shut = None
    if closed is not None:
        shut = small(closed.astype(np.uint8) * 255) > 0
        less[shut] = np.median(less[~shut], axis=0) if not shut.all() else 0.0
    if full is None:
        return Shrunk(less, np.zeros(less.shape[:2], np.bool_), shut, factor)
    top = image if image.ndim == 2 else brightest(image)
    return Shrunk(less, small((top >= full).astype(np.uint8) * 255) >= 128, shut, factor)


def brightest(image: NDArray[Any]) -> NDArray[Any]:
    """(h, w, 3) -> (h, w), the largest of the channels; a maximum along an axis of three is many times slower."""
    red, green, blue = cv2.split(image)
    return np.asarray(cv2.max(cv2.max(red, green), blue))


def score_of(ridges: Ridges) -> float:
    """How clear the cheapest chain of ridges in a shrunk image stands."""
    u, strength, scale = ridges
    choice = cheapest_chain(u, strength)
    return _clearness(_at(choice, u), _at(choice, strength), _at(choice, scale), u, strength)[0]


def chains_of(shrunk: Shrunk, combination: Combination, axis: Axis, count: int) -> list[Chain]:
    """As many chains of ridges in a shrunk image, far from each other, the cheapest first."""
    return _chains(_ridges(shrunk, combination, axis), shrunk.factor, count)


def _chains(ridges: Ridges, factor: int, count: int) -> list[Chain]:
    """The same of its ridges, and its size over that of the shrunk image."""
    u, strength, scale = ridges
    found: list[Chain] = []
    for _ in range(count):
        choice = cheapest_chain(u, strength)
        along, p, s = _at(choice, u), _at(choice, strength), _at(choice, scale)
        score, clear, off = _clearness(along, p, s, u, strength)
        u, strength = np.where(off, u, np.nan), np.where(off, strength, np.nan)
        along = np.where(_clear_pieces(along, clear), along, np.nan)
        found.append(Chain((along + 0.5) * factor - 0.5, s * factor, score))
    return found


def _ridges(shrunk: Shrunk, combination: Combination, axis: Axis) -> Ridges:
    """`ridge_peaks` of a combination along an axis."""
    light, saturated, closed = combination.of(shrunk.image), shrunk.saturated, shrunk.closed
    if axis == "columns":
        light, saturated = np.ascontiguousarray(light.T), np.ascontiguousarray(saturated.T)
        closed = None if closed is None else closed.T
    if combination.difference:
        # another laser's colour less this one's is a trough, and a white core in it would be a ridge
        light = np.maximum(light, np.median(light, axis=1, keepdims=True))
    if combination.difference and saturated.any():
        # a core that is white in every channel leaves a hollow between two coloured flanks; what is saturated without
        # them, as a window, stays as dark as it is
        element = np.ones((1, 2 * int(4.0 * SCALES[-1]) + 1), np.uint8)
        light = np.where(saturated, cv2.morphologyEx(light, cv2.MORPH_CLOSE, element), light)
    return ridge_peaks(light, closed)


def _at(choice: NDArray[np.int64], values: NDArray[np.float64]) -> NDArray[np.float64]:
    if values.shape[1] == 0:  # an image of one or two pixels has no maxima
        return np.full(len(choice), np.nan)
    picked = np.take_along_axis(values, np.maximum(choice, 0)[:, None], axis=1)[:, 0]
    return np.where(choice >= 0, picked, np.nan)


def _clearness(
    found: NDArray[np.float64],
    p: NDArray[np.float64],
    scale: NDArray[np.float64],
    u: NDArray[np.float64],
    strength: NDArray[np.float64],
) -> tuple[float, NDArray[np.float64], NDArray[np.bool_]]:
    """Score of a chain (n,) among the candidates (n, k), how clear it is (n,), and which of these are no part of it."""
    there = np.isfinite(found)
    if there.sum() < 3:
        return 0.0, np.zeros(len(found)), np.isfinite(u)
    everywhere = np.interp(np.arange(len(found)), np.flatnonzero(there), found[there])
    wide = np.interp(np.arange(len(found)), np.flatnonzero(there), scale[there])
    elsewhere = np.isfinite(u) & (np.abs(u - everywhere[:, None]) > NEAR * wide[:, None] + 1.0)
    rivals = np.where(elsewhere, strength, 0.0).max(axis=1)
    q = max(float(np.quantile(rivals, RIVAL)), 1e-12)
    clear = np.where(there, np.maximum(0.0, (p - q) / (p + q)), 0.0)
    neighbours = there[:-2] & there[1:-1] & there[2:]
    bends = np.abs(found[:-2] - 2.0 * found[1:-1] + found[2:])[neighbours]
    roughness = float(np.mean(bends)) if len(bends) else 1.0
    return float(np.mean(clear)) / (1.0 + roughness), clear, elsewhere


def _clear_pieces(found: NDArray[np.float64], clear: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which scan lines (n,) are on a piece of the chain that stands clear of the rivals on enough of its length."""
    there = np.flatnonzero(np.isfinite(found))
    kept = np.zeros(len(found), np.bool_)
    far = (np.diff(there) > 1) | (np.abs(np.diff(found[there])) > JUMP)
    for piece in np.split(there, np.flatnonzero(far) + 1):
        kept[piece] = bool(len(piece)) and float(np.mean(clear[piece] > 0.0)) > CLEAR
    return kept
