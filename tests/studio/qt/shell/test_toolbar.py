"""The toolbar holds what it promises, and marks one workspace at a time."""

from __future__ import annotations

from PySide6.QtWidgets import QToolBar

from studio.qt.shell.toolbar import FIRST, SWITCH
from studio.qt.shell.window import MainWindow
from studio.qt.shell.workspaces import WORKSPACES


def test_the_toolbar_has_what_is_done_all_the_time_and_help(window: MainWindow) -> None:
    bar = window.findChild(QToolBar, "toolbar")
    assert isinstance(bar, QToolBar)
    shown = bar.actions()
    assert all(window.commands[key] in shown for key in FIRST if key)
    assert shown[-1] is window.commands["help"]


def test_one_workspace_is_marked_at_a_time(window: MainWindow) -> None:
    for each in WORKSPACES[:3]:
        window.switch_to(each.key)
        assert [key for key, command in SWITCH.items() if window.commands[command].isChecked()] == [each.key]
