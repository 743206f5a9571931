"""Labels of axes can be read, and are of what there is."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pyqtgraph as pg
import pytest
from PySide6.QtGui import QPainter, QPixmap
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from studio.qt.core import theme
from studio.qt.results import plots
from studio.qt.results.results_steps import StepsPlot
from studio.scan.result_series import ERROR_VIEWS


def labels(axis: pg.AxisItem) -> list[tuple[float, float, str]]:
    """Top, bottom and text of each, as they are drawn, from above."""
    for _ in range(3):
        QApplication.processEvents()
    page = QPixmap(8, 8)
    painter = QPainter(page)
    drawn = axis.generateDrawSpecs(painter)
    painter.end()
    return sorted((place.top(), place.bottom(), text) for place, _, text in drawn[2])


@pytest.mark.parametrize("height", [80, 100, 140])
@pytest.mark.parametrize("span", [0.003, 0.07, 37.0])
def test_labels_of_a_low_plot_do_not_lie_over_each_other(qtbot: QtBot, height: int, span: float) -> None:
    theme.apply("light")
    widget = pg.GraphicsLayoutWidget()
    qtbot.addWidget(widget)
    plot = plots.new_plot("Along the line / mm", "Height", "mm")
    widget.addItem(plot)
    plot.plot(np.arange(50.0), 123.4 + span * np.random.default_rng(1).random(50))
    widget.resize(400, height)
    with qtbot.waitExposed(widget):
        widget.show()
    found = labels(plot.getAxis("left"))
    assert found and all(above[1] <= below[0] + 1.0 for above, below in pairwise(found)), found


@pytest.mark.parametrize("count", [2, 3, 5, 40])
def test_steps_are_numbered_by_whole_numbers(qtbot: QtBot, count: int) -> None:
    """There were ticks at step 1.5."""
    theme.apply("light")
    plot = StepsPlot()
    qtbot.addWidget(plot)
    plot.resize(600, 300)
    with qtbot.waitExposed(plot):
        plot.show()
    plot.show_steps("likelihood", np.zeros(count), np.ones(count), ERROR_VIEWS[0])
    found = [text for _, _, text in labels(plot.plot.getAxis("bottom"))]
    assert len(found) >= 2 and all(text.isdigit() for text in found), found
