"""Any command of the menus by a few letters (Ctrl+P)."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from studio.qt.shell.command_search import CommandSearch
from studio.qt.shell.window import MainWindow


def test_a_command_is_found_by_a_few_letters_and_done(window: MainWindow, qtbot: QtBot) -> None:
    session = window.session
    count = len(session.project.scene.lights)
    qtbot.keyClick(window, Qt.Key.Key_P, Qt.KeyboardModifier.ControlModifier)
    search = next(one for one in QApplication.topLevelWidgets() if isinstance(one, CommandSearch))
    names = {entry.name for entry in search.entries}
    assert {"Undo", "Report as PDF", "Turntable", "Sphere", "Messages", "Inspector"} <= names
    qtbot.keyClicks(search.line, "poi li")
    assert search.list.item(0).text() == "Scene > Add > Point light"
    qtbot.keyClick(search.line, Qt.Key.Key_Down)
    qtbot.keyClick(search.line, Qt.Key.Key_Up)
    with qtbot.waitSignal(session.project_changed):
        qtbot.keyClick(search.line, Qt.Key.Key_Return)
    assert len(session.project.scene.lights) == count + 1


def test_a_command_that_is_not_possible_now_stays_undone(window: MainWindow, qtbot: QtBot) -> None:
    before = window.session.project
    search = CommandSearch(window)
    qtbot.addWidget(search)
    search.show_found("redo")
    search.choose()
    search.show_found("no such thing")
    (only,) = [search.list.item(i) for i in range(search.list.count())]
    assert only.text().startswith("Nothing found") and not only.flags()
    search.choose()
    search.list.setCurrentRow(0)
    search.choose()
    assert search.isVisible() is False and window.session.project is before
