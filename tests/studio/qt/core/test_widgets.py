"""What several panels have in common."""

from __future__ import annotations

from PySide6.QtCore import QEvent, QObject, Qt
from PySide6.QtGui import QAction, QKeySequence
from PySide6.QtWidgets import QLabel, QMainWindow, QPushButton, QVBoxLayout, QWidget
from pytestqt.qtbot import QtBot

from studio.qt.core.boxes import DecimalBox
from studio.qt.core.widgets import Scrolled, ShareBar, breakable, bring_into_view


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


def test_a_bar_is_drawn_with_all_else_that_changes(qtbot: QtBot) -> None:
    """Qt draws another value at once, which in a window with 3D is a picture of the whole window."""
    drawn: list[int] = []

    class Eye(QObject):
        def eventFilter(self, watched: QObject, event: QEvent) -> bool:
            if event.type() == QEvent.Type.Paint:
                drawn.append(bar.value())
            return False

    bar, eye = ShareBar(), Eye()
    qtbot.addWidget(bar)
    bar.resize(200, 10)
    bar.show()
    qtbot.waitExposed(bar)
    qtbot.wait(50)
    bar.installEventFilter(eye)
    drawn.clear()
    for share in (0.2, 0.5, 0.9):
        bar.show_share(share)
    assert not drawn
    qtbot.waitUntil(lambda: drawn == [900])
    bar.show_share(0.9)
    qtbot.wait(50)
    assert drawn == [900]
    bar.show_share(0.0)
    assert bar.maximum() == 0, "to and fro"
    bar.show_none()
    assert (bar.maximum(), bar.value()) == (1000, 0)


def test_undo_is_the_window_s_unless_a_number_is_being_typed(qtbot: QtBot) -> None:
    """Three times Ctrl+Z with the focus in Exposure undid nothing."""
    window, undone = QMainWindow(), []
    box = DecimalBox(maximum=100.0)
    window.setCentralWidget(box)
    undo = QAction("Undo", window)
    undo.setShortcut(QKeySequence.StandardKey.Undo)
    undo.triggered.connect(lambda: undone.append(box.value()))
    window.addAction(undo)
    qtbot.addWidget(window)
    window.show()
    window.activateWindow()
    qtbot.waitUntil(window.isActiveWindow)
    box.setFocus()
    box.selectAll()
    qtbot.keyClicks(box, "4")
    qtbot.keyClick(box, Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    assert not undone, "what is typed is taken back letter by letter"
    box.selectAll()
    qtbot.keyClicks(box, "5")
    qtbot.keyClick(box, Qt.Key.Key_Return)
    qtbot.keyClick(box, Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    assert undone == [5.0] and box.value() == 5.0


def test_only_long_words_are_broken_and_what_a_person_copies_is_as_it_was() -> None:
    plain = "a board as charuco:14x10:25mm:18mm, at 1/2"
    assert breakable(plain) == plain
    form = "charuco:COLUMNSxROWS:SIDE:MARKER[:DICTIONARY]"
    assert breakable(f"as {form}").count("\u200b") == 4 and breakable(form).replace("\u200b", "") == form
