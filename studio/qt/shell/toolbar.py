"""The toolbar: what is done all the time, the switch between workspaces, and help."""

from __future__ import annotations

from PySide6.QtGui import QActionGroup
from PySide6.QtWidgets import QMainWindow, QToolBar, QToolButton

from studio.qt.core.actions import Actions
from studio.qt.core.widgets import spring
from studio.qt.shell.workspaces import WORKSPACES

FIRST = ("new", "open", "save", "", "undo", "redo", "", "render")
"""Commands at the left; a separator where the key is empty."""
SWITCH = {each.key: "render_workspace" if each.key == "render" else each.key for each in WORKSPACES}
"""Workspace -> command."""


def add_toolbar(window: QMainWindow, commands: Actions) -> None:
    """One workspace is marked at a time."""
    bar = QToolBar("Main", window)
    bar.setObjectName("toolbar")
    bar.setMovable(False)
    group = QActionGroup(window)
    for key in FIRST:
        bar.addSeparator() if not key else bar.addAction(commands[key])
    bar.addWidget(spring())
    for each in WORKSPACES:
        action = commands[SWITCH[each.key]]
        group.addAction(action)
        action.setToolTip(f"{each.tip} ({action.shortcut().toString()})")
        button = QToolButton()
        button.setObjectName("workspace")
        button.setDefaultAction(action)
        button.setText(each.title)
        bar.addWidget(button)
    bar.addWidget(spring())
    bar.addAction(commands["help"])
    window.addToolBar(bar)
