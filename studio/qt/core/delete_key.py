"""Del in a list is the list's, and removes nothing of the scene."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import QEvent, QObject, Qt
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QWidget


class DeleteKey(QObject):
    """Calls `remove` while the list has the focus, ahead of the window's own shortcut for Del."""

    def __init__(self, owner: QWidget, remove: Callable[[], object]) -> None:
        super().__init__(owner)
        self.remove = remove
        owner.installEventFilter(self)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        if not isinstance(event, QKeyEvent) or event.key() != Qt.Key.Key_Delete:
            return False
        if event.type() == QEvent.Type.ShortcutOverride:
            event.accept()
        elif event.type() == QEvent.Type.KeyPress:
            self.remove()
        return True
