"""A text in a plot is read whole, wherever its place is in what is seen."""

from __future__ import annotations

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
