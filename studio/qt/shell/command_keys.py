"""Ctrl and a letter are the menus', while something is typed too: in a line Qt means others by some of them.

Where keys are as on X11 it takes Ctrl+E for the end of the line, and Ctrl+D for a letter to be removed.
"""

from __future__ import annotations

import re

from PySide6.QtCore import QEvent, QObject
from PySide6.QtGui import QKeyEvent, QKeySequence
from PySide6.QtWidgets import QAbstractSpinBox, QApplication, QLineEdit, QWidget

from studio.qt.core.actions import COMMANDS, Command

EDITING = "CXVAZY"
"""Of what is typed, with Ctrl: copied, cut, pasted, selected, undone and redone."""


class CommandKeys(QObject):
    """Watches the field that has the focus, as the whole program's events would be too many."""

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        self.keys = command_keys()
        app = QApplication.instance()
        if isinstance(app, QApplication):
            app.focusChanged.connect(self._follow)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Keep the keys of the menus from the field: as a shortcut they are looked for next."""
        if event.type() != QEvent.Type.ShortcutOverride or not isinstance(event, QKeyEvent):
            return False
        ours = QKeySequence(event.keyCombination()).toString() in self.keys
        if ours:
            event.ignore()
        return ours

    def _follow(self, before: QWidget | None, now: QWidget | None) -> None:
        if isinstance(before, QLineEdit | QAbstractSpinBox):
            before.removeEventFilter(self)
        if isinstance(now, QLineEdit | QAbstractSpinBox):
            now.installEventFilter(self)


def command_keys() -> set[str]:
    """Ctrl and a letter of every command, but of those that edit what is typed."""
    known = [key for one in COMMANDS if isinstance(one, Command) for key in one.shortcut.split("; ")]
    return {key for key in known if re.fullmatch(r"Ctrl\+(Shift\+)?[A-Z]", key) and key[-1] not in EDITING}
