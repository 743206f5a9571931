"""Del in a list against the window's shortcut for Del."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtGui import QAction
from PySide6.QtWidgets import QListWidget, QMainWindow
from pytestqt.qtbot import QtBot

from studio.qt.core.delete_key import DeleteKey


def test_a_list_has_its_key_before_the_window(qtbot: QtBot) -> None:
    window, listed, removed = QMainWindow(), QListWidget(), list[str]()
    action = QAction("Delete", window, shortcut="Del")
    action.triggered.connect(lambda: removed.append("of the scene"))
    window.addAction(action)
    window.setCentralWidget(listed)
    DeleteKey(listed, lambda: removed.append("of the list"))
    qtbot.addWidget(window)
    window.show()
    with qtbot.waitActive(window):
        window.activateWindow()
    listed.setFocus()
    qtbot.keyClick(listed, Qt.Key.Key_Delete)
    assert removed == ["of the list"]
