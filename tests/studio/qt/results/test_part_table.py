"""The table of the part's measures in a narrow window: which row is which is always to be read."""

from __future__ import annotations

import pytest
from PySide6.QtGui import QFontMetrics
from PySide6.QtWidgets import QTableView
from pytestqt.qtbot import QtBot

from analysis.gauges.gauge import Gauge
from studio.qt.results.results_panel import PART, ResultsPanel
from tests.studio.qt.results.test_part_tab import SIDES, panel

__all__ = ["panel"]
NAMES = ("Step height 1", "Opening angle", "Radius", "V depth", "Bow", "Edge to edge 1", "Thickness", "Flush, left")
LONG = "Flatness over the top of the step"


def measures() -> tuple[Gauge, ...]:
    """Eight, of which one has no points, and a ninth with a long name."""
    tolerance = {"nominal": 0.01, "lower": -1e-4, "upper": 1e-4}
    found = [Gauge(name=name, kind="step", regions=SIDES, **tolerance) for name in NAMES]
    found[1] = found[1].model_copy(update={"regions": ((5.0, 5.1), (5.2, 5.3))})
    return (*found, Gauge(name=LONG, kind="step", regions=SIDES, **tolerance))


def seen(table: QTableView, row: int, column: int) -> int:
    """px between what a cell has for its text and what the text takes."""
    index = table.model().index(row, column)
    text = str(table.model().data(index))
    beside = table.sizeHintForIndex(index).width() - QFontMetrics(table.font()).horizontalAdvance(text)
    return table.columnWidth(column) - beside


@pytest.mark.parametrize("width", [1366, 1000])
def test_names_are_read_however_long_verdicts_are(panel: ResultsPanel, width: int, qtbot: QtBot) -> None:
    """Beside one "not measured, step 1" all names were a letter and three points, or these alone."""
    panel.resize(width, 420)
    panel.figures.setCurrentIndex(PART)
    panel.session.set(("measures",), measures())
    table, letters = panel.part.table, QFontMetrics(panel.part.table.font())
    verdicts = [table.item(row, 4).text() for row in range(len(NAMES))]
    assert verdicts[1] == "not measured" and "fail" in verdicts[0]
    for shown in ("", ", 13.0° oblique, misfit, step 12 of 20"):
        table.item(1, 4).setText(verdicts[1] + shown)
        table.fit()
        qtbot.wait(1)
        for row, name in enumerate(NAMES):
            assert seen(table, row, 0) >= letters.horizontalAdvance(name), name
        assert seen(table, len(NAMES), 0) >= 16 * letters.averageCharWidth()
        assert seen(table, 0, 4) >= letters.horizontalAdvance("? undecided")
        # wherever there is room for both, nothing has to be scrolled to
        if width == 1366:
            assert table.horizontalScrollBar().maximum() == 0
            assert seen(table, 1, 4) >= letters.horizontalAdvance(verdicts[1])


def test_of_much_room_all_is_read(panel: ResultsPanel, qtbot: QtBot) -> None:
    panel.session.set(("measures",), measures())
    panel.figures.setCurrentIndex(PART)
    table = panel.part.table
    table.setMinimumWidth(1000)
    qtbot.waitUntil(lambda: table.viewport().width() > 900)
    for row in range(table.rowCount()):
        for column in range(table.columnCount()):
            text = table.item(row, column).text()
            assert seen(table, row, column) >= QFontMetrics(table.font()).horizontalAdvance(text), text
