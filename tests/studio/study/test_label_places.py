"""Names of a crowded chart: none on another, none beyond the axes, and a line from those that stand far off."""

from __future__ import annotations

import itertools

import numpy as np

from analysis.report.style import figure
from studio.study.label_places import RADII, Name, name_marks

WORDS = ["maximum likelihood", "centre of mass", "phase", "row maximum", "steger 2d", "half energy", "guo", "linear"]


def test_no_name_covers_another_or_a_mark_where_marks_lie_close() -> None:
    rng = np.random.default_rng(7)
    places = np.exp(rng.normal(0.0, 0.15, (16, 2))).tolist()
    with figure(3.4) as made:
        axes = made.subplots()
        axes.plot(*np.transpose(places), "o", ms=5)
        axes.set(xscale="log", yscale="log", xlim=(0.1, 10.0), ylim=(0.1, 10.0))
        names = [Name(f"{WORDS[k % 8]}", (x, y), "black", 6.0) for k, (x, y) in enumerate(places)]
        name_marks(axes, names, [])
        made.canvas.draw()
    renderer = made.canvas.get_renderer()
    frame = axes.get_window_extent(renderer)
    # of the text alone: the line to its mark is part of an annotation's extent
    boxes = [super(type(one), one).get_window_extent(renderer) for one in axes.texts]
    assert len(boxes) == len(names)
    for a, b in itertools.combinations(boxes, 2):
        assert not a.overlaps(b)
    marks = axes.transData.transform(places)
    for box in boxes:
        assert frame.x0 <= box.x0 and box.x1 <= frame.x1 and frame.y0 <= box.y0 and box.y1 <= frame.y1
        assert not any(box.contains(x, y) for x, y in marks)


def test_a_name_that_has_room_stands_at_its_mark_and_off_the_line_through_it() -> None:
    with figure(3.4) as made:
        axes = made.subplots()
        axes.set(xlim=(0.0, 1.0), ylim=(0.0, 1.0))
        line = [(0.0, 0.0), (0.5, 0.5), (1.0, 1.0)]
        name_marks(axes, [Name("here", (0.5, 0.5), "black", 6.0)], [line])
        made.canvas.draw()
    (text,) = axes.texts
    box = super(type(text), text).get_window_extent(made.canvas.get_renderer())
    mark = axes.transData.transform((0.5, 0.5))
    near = np.clip(mark, (box.x0, box.y0), (box.x1, box.y1)) - mark
    assert np.hypot(*near) * 72.0 / made.dpi <= RADII[1] + 1.0
    along = axes.transData.transform(np.linspace((0.0, 0.0), (1.0, 1.0), 200))
    assert not any(box.contains(x, y) for x, y in along)
