"""The list of measures is as high as its rows where there is room for them."""

from __future__ import annotations

from PySide6.QtCore import QEvent
from PySide6.QtGui import QHelpEvent
from PySide6.QtWidgets import QApplication, QHeaderView, QToolTip, QVBoxLayout, QWidget
from pytestqt.qtbot import QtBot

from analysis.gauges.gauge import Gauge
from studio.qt.results.measures_table import ROW_PX, ReadOnlyTable
from studio.qt.results.results_panel import PART, ResultsPanel
from tests.studio.qt.results.test_part_tab import SIDES, panel

__all__ = ["panel"]


def test_a_list_of_measures_has_the_room_that_there_is(panel: ResultsPanel, qtbot: QtBot) -> None:
    """150 px stood empty above it, and as many between it and the fields of the chosen measure."""
    panel.resize(1900, 560)
    panel.figures.setCurrentIndex(PART)
    part, steps = panel.part, [Gauge(name=f"level {i}", kind="step", regions=SIDES) for i in range(12)]
    for count in (3, 12):
        panel.session.set(("measures",), tuple(steps[:count]))
        part.table.selectRow(0)
        qtbot.waitUntil(lambda: part.editor.isVisible() and part.table.height() == part.table.maximumHeight())
        above = part.table.y() - part.told.y() - part.told.sizeHint().height()
        assert above < 10 and part.editor.y() - part.table.geometry().bottom() < 10
        qtbot.waitUntil(lambda: not part.table.verticalScrollBar().isVisible())


def test_the_tip_of_a_row_is_not_over_the_fields_that_are_typed_into(panel: ResultsPanel, qtbot: QtBot) -> None:
    panel.figures.setCurrentIndex(PART)
    panel.session.set(("measures",), (Gauge(name="level", kind="step", regions=SIDES),))
    part = panel.part
    part.table.selectRow(0)
    qtbot.waitUntil(part.editor.isVisible)
    with qtbot.waitActive(panel):
        panel.activateWindow()
    place = part.table.visualItemRect(part.table.item(0, 0)).center()
    view = part.table.viewport()

    def rest() -> None:
        QApplication.sendEvent(view, QHelpEvent(QEvent.Type.ToolTip, place, view.mapToGlobal(place)))

    part.editor.fields["nominal"].setFocus()
    qtbot.waitUntil(part.editor.fields["nominal"].hasFocus)
    rest()
    assert not QToolTip.isVisible()
    part.table.setFocus()
    qtbot.waitUntil(part.table.hasFocus)
    rest()
    assert QToolTip.isVisible()
    QToolTip.hideText()


def test_rows_that_are_too_wide_are_all_seen(qtbot: QtBot) -> None:
    """The bar below them took the room of the last."""
    whole = QWidget()
    table, column = ReadOnlyTable(), QVBoxLayout(whole)
    column.addWidget(table, 1)
    column.addStretch(0)
    table.setColumnCount(3)
    table.horizontalHeader().setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
    table.setRowCount(3)
    for row in range(3):
        table.show_cell(row, 1, "wide" * 40)
    table.end_with_rows()
    qtbot.addWidget(whole)
    whole.resize(300, 400)
    whole.show()
    qtbot.waitUntil(table.horizontalScrollBar().isVisible)
    qtbot.waitUntil(lambda: table.height() == table.maximumHeight() and table.verticalScrollBar().maximum() == 0)
    whole.resize(3000, 400)
    qtbot.waitUntil(lambda: not table.horizontalScrollBar().isVisible())
    qtbot.waitUntil(lambda: table.height() == 3 * ROW_PX + table.horizontalHeader().height() + 2 * table.frameWidth())
