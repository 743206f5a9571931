"""F1 opens the page of what is being done."""

from __future__ import annotations

import pytest
from PySide6.QtWidgets import QLineEdit, QWidget
from pytestqt.qtbot import QtBot

from studio.qt.shell.help import OF_WORKSPACE, PAGES, panel_with_focus
from studio.qt.shell.workspaces import WORKSPACES


@pytest.mark.parametrize(
    ("workspace", "page"), [("setup", "start"), ("measure", "results"), ("study", "study"), ("dataset", "recipe")]
)
def test_without_a_panel_it_is_the_workspaces(qtbot: QtBot, workspace: str, page: str) -> None:
    assert panel_with_focus((), workspace) == page


def test_a_panel_with_the_focus_comes_first(qtbot: QtBot) -> None:
    panel = QWidget()
    qtbot.addWidget(panel)
    field = QLineEdit(panel)
    panel.show()
    panel.activateWindow()
    qtbot.waitUntil(panel.isActiveWindow)
    field.setFocus()
    assert panel_with_focus([("camera", panel)], "measure") == "camera"


def test_every_workspace_has_a_page() -> None:
    assert {OF_WORKSPACE.get(each.key, "start") for each in WORKSPACES} <= PAGES.keys()
