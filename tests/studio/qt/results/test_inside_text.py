"""A text in a plot is read whole, wherever its place is in what is seen."""

from __future__ import annotations

import numpy as np
import pyqtgraph as pg
import pytest
from pytestqt.qtbot import QtBot

from studio.qt.results.inside_text import InsideText

LONG = "Step height 1, step 1: 2.3867 mm, ✓ pass, 13.0° oblique"


@pytest.mark.parametrize("width", [520, 1000])
@pytest.mark.parametrize("place", [0.5, 5.0, 6.0, 9.5])
def test_a_text_stays_inside_while_the_view_changes(qtbot: QtBot, place: float, width: int) -> None:
    plots = pg.PlotWidget()
    qtbot.addWidget(plots)
    plots.resize(width, 300)
    plots.show()
    qtbot.waitExposed(plots)
    item, view = InsideText(LONG, "#ffffff"), plots.plotItem.vb
    item.setPos(place, 0.0)
    plots.addItem(item, ignoreBounds=True)
    item.keep_inside()
    for low, high in ((0.0, 10.0), (place - 9.0, place + 1.0), (place - 1.0, place + 9.0)):
        view.setRange(xRange=(low, high), yRange=(-1.0, 1.0), padding=0.0)

        def is_inside() -> bool:
            seen, text = view.sceneBoundingRect(), item.textItem.sceneBoundingRect()
            return bool(seen.left() - 1.0 <= text.left() and text.right() <= seen.right() + 1.0)

        qtbot.waitUntil(is_inside)
    before = item.anchor[0]
    view.setRange(xRange=(place + 1.0, place + 2.0), yRange=(-1.0, 1.0), padding=0.0)
    assert item.anchor[0] == before, "of a place that is out of view nothing is told elsewhere"


@pytest.mark.parametrize("width", [300, 520, 1000])
@pytest.mark.parametrize("height", [-0.9, 0.0, 0.9])
def test_a_text_lies_off_the_line_that_it_tells_of(qtbot: QtBot, height: float, width: int) -> None:
    """Its ground hid the stretch of the profile that was measured, and the places beside it."""
    plots = pg.PlotWidget()
    qtbot.addWidget(plots)
    plots.resize(width, 300)
    plots.show()
    qtbot.waitExposed(plots)
    line = np.column_stack([np.linspace(0.0, 10.0, 500), np.full(500, height)])
    dimension = np.column_stack([np.full(50, 5.0), height + np.linspace(-0.05, 0.05, 50)])
    item, view = InsideText(LONG, "#ffffff", np.concatenate([line, dimension])), plots.plotItem.vb
    item.setPos(5.0, height)
    plots.addItem(item, ignoreBounds=True)
    view.setRange(xRange=(0.0, 10.0), yRange=(-1.0, 1.0), padding=0.0)

    def is_off() -> bool:
        seen, text = view.sceneBoundingRect(), item.textItem.sceneBoundingRect()
        on_screen = [view.mapViewToScene(pg.Point(*place)) for place in item.beside]
        inside = seen.top() - 1.0 <= text.top() and text.bottom() <= seen.bottom() + 1.0
        return inside and not any(text.contains(place) for place in on_screen)

    qtbot.waitUntil(is_off)
    assert abs(item.anchor[1] - 0.5) < 3.0, "and near it all the same"
