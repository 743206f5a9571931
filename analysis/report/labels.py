"""Names beside the marks of a picture, each where it covers no other name and no mark, with a line where it is far."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from analysis.report.colour import MUTED
from render.base.arrays import Float

RADII = np.array([4.0, 9.0, 15.0, 22.0, 30.0, 40.0, 52.0, 66.0])
"""Distances tried between a mark and its name, in points of the page; beyond the second a line joins them."""
STRAIGHT = [(1, 1), (1, -1), (1, 0), (-1, 1), (-1, -1), (-1, 0), (0, 1), (0, -1)]
DIRECTIONS = np.array([*STRAIGHT, *itertools.product((1, -1), (0.5, -0.5)), *itertools.product((0.5, -0.5), (1, -1))])
"""From a mark to its name, the first ones first where two are as good; 1 is as far as the name's end."""
TALL = 1.25
"""Of a line, over the font's size."""
MARK, LINE = 3.5, 1.0
"""Half the size of a mark, and half the width of an error bar or another line, in points."""
COVERED, CROSSED, OUTSIDE = 10.0, 4.0, 100.0
"""What a square point costs on a name or a mark, on a line, and beyond the picture; a point of distance costs 1."""
MISTAKEN, STEPS = 60.0, 12
"""What it costs that another mark is as near to a name as its own, or that its line meets something, at each step."""
NONE = np.zeros((0, 4))


@dataclass(frozen=True)
class Name:
    """Text beside a mark, which lies at `place` in the chart's units."""

    text: str
    place: tuple[float, float]
    colour: str
    size: float
    mark: float = MARK
    """Half the size of the mark, in points."""


def text_size(text: str, size: float) -> tuple[float, float]:
    """Width and height of a text in the font of the picture at hand, of that size, points."""
    from matplotlib.textpath import TextPath  # which an import of this file alone need not wait for

    box = TextPath((0.0, 0.0), text, size=size).get_extents()
    return float(max(box.x1, 0.0)), TALL * size


def label_places(
    places: Float,
    sizes: Float,
    low: Float,
    high: Float,
    *,
    marks: Float | float = MARK,
    gap: float = 0.0,
    covered: Float = NONE,
    crossed: Float = NONE,
) -> Float:
    """(n, 2) marks and (n, 2) widths and heights of their labels, points -> (n, 2) middles of these.

    Each about its mark, the first ones where they like best: near, within the box from (2,) low to high, clear of every
    mark (of half size (n,) `marks`), by `gap` of labels before it, of (k, 4) boxes that are covered (left, bottom,
    right, top), and, where it can be, of boxes that may be crossed; nearer to its own mark than to another, and where
    the line between them meets nothing. Without room, where it does the least harm.
    """
    half = np.broadcast_to(np.asarray(marks, np.float64), len(places))[:, None]
    solid = np.concatenate([np.hstack([places - half, places + half]), covered])
    reach, away = np.repeat(RADII, len(DIRECTIONS)), np.tile(DIRECTIONS, (len(RADII), 1))
    middles = []
    for place, size in zip(places, sizes, strict=True):
        spots = place + away * (reach / np.hypot(*away.T))[:, None] + 0.5 * away * size
        boxes = np.hstack([spots - 0.5 * size, spots + 0.5 * size])
        other = np.any(places != place, axis=1)  # a mark may have two names
        cost = reach + OUTSIDE * (np.prod(size) - _shared(boxes, np.hstack([low, high])[None])[:, 0])
        cost += COVERED * _shared(boxes, solid).sum(axis=1) + CROSSED * _shared(boxes, crossed).sum(axis=1)
        cost += MISTAKEN * (_apart(boxes, places[other]) <= 1.5 * reach[:, None]).any(axis=1)
        cost += MISTAKEN * _met(place, boxes, solid[np.append(other, np.ones(len(solid) - len(other), np.bool_))])
        best = int(np.argmin(cost))
        middles.append(spots[best])
        solid = np.vstack([solid, boxes[best] + gap * np.array([-1.0, -1.0, 1.0, 1.0])])
    return np.array(middles).reshape(-1, 2)


def name_marks(axes: Any, names: Sequence[Name], lines: Sequence[Sequence[tuple[float, float]]]) -> None:
    """Write the names, the first ones where they like best. Limits and ticks of the axes are to be what they stay.

    Texts that are there already are kept clear of.
    lines: what else is drawn, through places in the chart's units: error bars, a front.
    """
    axes.figure.draw_without_rendering()  # the layout decides where the axes are, which stay there
    axes.figure.set_layout_engine("none")
    points = 72.0 / axes.figure.dpi
    low, high = axes.bbox.get_points() * points
    marks = np.array([axes.transData.transform(one.place) * points for one in names]).reshape(-1, 2)
    sizes = np.array([text_size(one.text, one.size) for one in names]).reshape(-1, 2)
    texts = [text.get_window_extent().get_points().ravel() * points for text in axes.texts]
    beads = [_beads(a, b) for line in lines for a, b in itertools.pairwise(axes.transData.transform(line) * points)]
    middles = label_places(
        marks,
        sizes,
        low,
        high,
        marks=np.array([one.mark for one in names]),
        covered=np.array(texts).reshape(-1, 4),
        crossed=np.concatenate([NONE, *beads]),
    )
    for one, size, offset in zip(names, sizes, middles - marks, strict=True):
        far = np.hypot(*np.maximum(np.abs(offset) - 0.5 * size, 0.0)) > 1.01 * RADII[1]
        arrow = {"arrowstyle": "-", "color": MUTED, "lw": 0.4, "shrinkA": 0.0, "shrinkB": MARK}
        note = axes.annotate(
            one.text,
            one.place,
            tuple(offset.tolist()),
            textcoords="offset points",
            ha="center",
            va="center",
            fontsize=one.size,
            color=one.colour,
            arrowprops=arrow if far else None,
        )
        note.set_in_layout(False)


def _apart(boxes: Float, places: Float) -> Float:
    """(n, 4) boxes and (m, 2) places -> (n, m) distances."""
    nearest = np.clip(places, boxes[:, None, :2], boxes[:, None, 2:])
    return np.asarray(np.hypot(*np.moveaxis(nearest - places, 2, 0)))


def _met(place: Float, boxes: Float, others: Float) -> Float:
    """(n,) boxes of others that lie on the straight line from a place to each of (n, 4) boxes, counted by step."""
    ends = np.clip(place, boxes[:, :2], boxes[:, 2:])
    steps = place + np.linspace(0.0, 1.0, STEPS)[:, None, None] * (ends - place)
    inside = (steps[:, :, None] > others[:, :2]) & (steps[:, :, None] < others[:, 2:])
    return np.asarray(inside.all(axis=3).sum(axis=(0, 2)), np.float64)


def _beads(a: Float, b: Float) -> Float:
    """(k, 4) squares along a line, as wide as it."""
    if not np.isfinite([*a, *b]).all():
        return NONE
    places = np.linspace(a, b, 2 + int(math.dist(a, b) / (2.0 * LINE)))
    return np.hstack([places - LINE, places + LINE])


def _shared(one: Float, other: Float) -> Float:
    """(n, 4) and (m, 4) boxes -> (n, m) areas of both."""
    low = np.maximum(one[:, None, :2], other[None, :, :2])
    high = np.minimum(one[:, None, 2:], other[None, :, 2:])
    return np.asarray(np.prod(np.maximum(high - low, 0.0), axis=2))
