"""Names beside the marks of a chart, each where it covers no other name and no mark, with a line where it is far."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from analysis.report.colour import MUTED

Box = tuple[float, float, float, float]
"""Left, bottom, right and top, in points of the page."""
RADII = (4.0, 9.0, 15.0, 22.0, 30.0, 40.0, 52.0, 66.0)
"""Distances tried between a mark and its name, in points; beyond the second a line joins them."""
DIRECTIONS = ((1, 1), (1, -1), (1, 0), (-1, 1), (-1, -1), (-1, 0), (0, 1), (0, -1))
WIDE, TALL = 0.58, 1.25
"""Of a letter and of a line, over the font's size."""
MARK, LINE = 3.5, 1.0
"""Half the size of a mark, and half the width of an error bar or another line, in points."""
COVERED, CROSSED, OUTSIDE = 10.0, 2.0, 100.0
"""What a square point costs on a name or a mark, on a line, and beyond the axes; a point of distance costs 1."""


@dataclass(frozen=True)
class Name:
    """Text beside a mark, which lies at `place` in the chart's units."""

    text: str
    place: tuple[float, float]
    colour: str
    size: float
    mark: float = MARK
    """Half the size of the mark, in points."""


def name_marks(axes: Any, names: Sequence[Name], lines: Sequence[Sequence[tuple[float, float]]]) -> None:
    """Write the names, the first ones where they like best. Limits and ticks of the axes are to be what they stay.

    Texts that are there already are kept clear of.
    lines: what else is drawn, through places in the chart's units: error bars, a front.
    """
    axes.figure.draw_without_rendering()  # the layout decides where the axes are, which stay there
    axes.figure.set_layout_engine("none")
    points = 72.0 / axes.figure.dpi
    frame = axes.bbox.get_points().ravel() * points
    written = [text.get_window_extent().get_points().ravel() * points for text in axes.texts]
    taken: list[tuple[Box, float]] = [((box[0], box[1], box[2], box[3]), COVERED) for box in written]
    for one in names:
        x, y = axes.transData.transform(one.place) * points
        taken.append(((x - one.mark, y - one.mark, x + one.mark, y + one.mark), COVERED))
    for line in lines:
        for a, b in itertools.pairwise(axes.transData.transform(line) * points):
            taken += [(box, CROSSED) for box in _beads(a, b)]
    for one in names:
        mark = axes.transData.transform(one.place) * points
        size = WIDE * one.size * len(one.text), TALL * one.size
        tried = [
            (_cost(box := _box(mark, size, radius, direction), taken, frame) + radius, radius, box)
            for radius, direction in itertools.product(RADII, DIRECTIONS)
        ]
        _, radius, box = min(tried, key=lambda found: found[0])
        taken.append((box, COVERED))
        x, y = (0.5 * (box[k] + box[k + 2]) - mark[k] for k in (0, 1))
        arrow = {"arrowstyle": "-", "color": MUTED, "lw": 0.4, "shrinkA": 0.0, "shrinkB": MARK}
        note = axes.annotate(
            one.text,
            one.place,
            (x, y),
            textcoords="offset points",
            ha="center",
            va="center",
            fontsize=one.size,
            color=one.colour,
            arrowprops=arrow if radius > RADII[1] else None,
        )
        note.set_in_layout(False)


def _box(mark: Sequence[float], size: tuple[float, float], radius: float, direction: tuple[int, int]) -> Box:
    """Where a text of that size is, so far from the mark in that direction."""
    reach = radius / math.hypot(*direction)
    x, y = (m + d * (reach + 0.5 * s) for m, d, s in zip(mark, direction, size, strict=True))
    return x - 0.5 * size[0], y - 0.5 * size[1], x + 0.5 * size[0], y + 0.5 * size[1]


def _beads(a: Sequence[float], b: Sequence[float]) -> list[Box]:
    """Squares along a line, as wide as it."""
    if not np.isfinite([*a, *b]).all():
        return []
    places = np.linspace(a, b, 2 + int(math.dist(a, b) / (2.0 * LINE))).tolist()
    return [(x - LINE, y - LINE, x + LINE, y + LINE) for x, y in places]


def _cost(box: Box, taken: Sequence[tuple[Box, float]], frame: Sequence[float]) -> float:
    inside = _shared(box, (frame[0], frame[1], frame[2], frame[3]))
    whole = (box[2] - box[0]) * (box[3] - box[1])
    return OUTSIDE * (whole - inside) + sum(weight * _shared(box, other) for other, weight in taken)


def _shared(a: Box, b: Box) -> float:
    """Area of both."""
    width, height = min(a[2], b[2]) - max(a[0], b[0]), min(a[3], b[3]) - max(a[1], b[1])
    return max(width, 0.0) * max(height, 0.0)
