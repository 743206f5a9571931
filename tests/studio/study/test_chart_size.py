"""A chart is laid out for the size in which it is looked at."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from analysis.study.intervals import Interval
from analysis.study.pareto import Front
from studio.study.answers import Answer, Spot
from studio.study.charts import chart
from studio.study.ray_units import Throughput
from studio.study.study import Parameter, Sweep

POINTS = (0.5, 1.0, 2.0)


def speeds() -> Answer:
    """Three methods, of which the second has the knee."""
    sweep = Sweep(
        name="speed",
        vary=(Parameter(field="sensor.exposure_time", values=POINTS, label="Exposure time (ms)"),),
        chart="speed",
        measure="depth_p95",
    )
    spots = tuple(
        Spot((point,), method, Interval(mean, 0.9 * mean, 1.1 * mean, 8), 0.02 * (1 + number) * point)
        for number, method in enumerate(("likelihood", "centre_of_mass", "phase"))
        for point in POINTS
        for mean in [4e-5 / (1 + number) ** 0.6 / point**0.3]
    )
    member = np.zeros(len(spots), np.bool_)
    front = Front(member, member.astype(float), 4, np.full(len(spots), 0.71))
    return Answer(sweep, spots, front, (), throughput=Throughput(3e6, 0.004))


@pytest.mark.parametrize("size", [(4.0, 2.2), (4.7, 2.5), (8.0, 4.0)])
def test_nothing_of_a_chart_of_speed_is_cut_or_lies_on_other_words(size: tuple[float, float]) -> None:
    """In a small window the upper title was cut, and names lay on each other: they had their places for a page."""
    made = chart(speeds(), {}, size)
    made.canvas.draw()
    (axes,) = made.axes
    (top,) = axes.child_axes
    titles = [axes.xaxis.label, axes.yaxis.label, top.xaxis.label]
    names = [text for text in axes.texts if text.get_text() != "one ray a pixel"]
    assert top.get_xlabel() == "million rays of this machine" and "knee, 71% sure" in [one.get_text() for one in names]
    boxes = [one.get_window_extent() for one in (*titles, *names)]
    for box in boxes:
        assert (
            box.x0 >= -0.5 and box.y0 >= -0.5 and box.x1 <= made.bbox.width + 0.5 and box.y1 <= made.bbox.height + 0.5
        )
    shared = [
        max(0.0, min(a.x1, b.x1) - max(a.x0, b.x0)) * max(0.0, min(a.y1, b.y1) - max(a.y0, b.y0))
        for a, b in itertools.combinations(boxes, 2)
    ]
    # an extent is as tall as the tallest letters, a little more than what is written
    assert max(shared) < 0.2 * min(box.width * box.height for box in boxes)
