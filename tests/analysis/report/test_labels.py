"""Names of crowded marks: apart from each other and from the marks, within the picture, near where they belong."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from analysis.report.labels import RADII, Name, label_places, name_marks
from analysis.report.style import figure

LOW, HIGH = np.array([0.0, 0.0]), np.array([700.0, 300.0])
SIZES = np.tile([90.0, 18.0], (5, 1))
WORDS = ["maximum likelihood", "centre of mass", "phase", "row maximum", "steger 2d", "half energy", "guo", "linear"]


@pytest.mark.parametrize("crowd", [2.0, 20.0, 120.0])
@pytest.mark.parametrize("seed", range(4))
def test_no_label_lies_over_another_or_over_a_place(crowd: float, seed: int) -> None:
    places = np.array([350.0, 150.0]) + crowd * np.random.default_rng(seed).uniform(-1.0, 1.0, (5, 2))
    found = label_places(places, SIZES, LOW, HIGH)
    for i in range(5):
        assert np.all(np.abs(places - found[i]) < 0.5 * SIZES[i], axis=1).sum() == 0
        for k in range(i):
            assert np.any(np.abs(found[i] - found[k]) >= SIZES[i]), "two boxes of one size are apart along an axis"
    assert np.all(found - 0.5 * SIZES >= LOW) and np.all(found + 0.5 * SIZES <= HIGH)
    assert np.linalg.norm(found - places, axis=1).max() < np.linalg.norm(SIZES[0]) + RADII[-1]


def test_in_a_corner_it_turns_inwards() -> None:
    (found,) = label_places(np.array([[3.0, 297.0]]), SIZES[:1], LOW, HIGH)
    assert found[0] > 45.0 and found[1] < 291.0


def test_where_there_is_no_room_it_is_still_placed() -> None:
    assert np.isfinite(label_places(np.zeros((3, 2)), SIZES[:3], LOW, LOW + 10.0)).all()
    assert label_places(np.zeros((0, 2)), np.zeros((0, 2)), LOW, HIGH).shape == (0, 2)


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
