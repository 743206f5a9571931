"""What several panels have in common."""

from __future__ import annotations

from PySide6.QtWidgets import QLabel, QPushButton, QVBoxLayout, QWidget
from pytestqt.qtbot import QtBot

from studio.qt.core.widgets import Scrolled, bring_into_view


def test_a_button_that_is_scrolled_away_is_brought_back(qtbot: QtBot) -> None:
    panel, button, tall = QWidget(), QPushButton("Pause"), QLabel()
    tall.setMinimumHeight(900)
    column = QVBoxLayout(panel)
    column.addWidget(button)
    column.addWidget(tall)
    area = Scrolled(panel)
    qtbot.addWidget(area)
    area.resize(200, 300)
    area.show()
    qtbot.waitExposed(area)
    area.verticalScrollBar().setValue(area.verticalScrollBar().maximum())
    assert button.visibleRegion().isEmpty()
    bring_into_view(button)
    qtbot.waitUntil(lambda: not button.visibleRegion().isEmpty())


def test_what_does_not_scroll_stays(qtbot: QtBot) -> None:
    button = QPushButton("Pause")
    qtbot.addWidget(button)
    bring_into_view(button)
    qtbot.wait(10)
