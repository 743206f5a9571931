"""What is selected in the scene is changed only where it is seen."""

from __future__ import annotations

import pytest
from pytestqt.qtbot import QtBot

from studio.qt.shell.window import MainWindow


@pytest.mark.parametrize("key", ["delete", "duplicate"])
def test_what_is_selected_is_changed_only_where_it_is_seen(window: MainWindow, qtbot: QtBot, key: str) -> None:
    session = window.session
    session.select(("scene", "rig", "lasers", 0))
    before = session.project
    window.switch_to("study")
    with qtbot.waitSignal(session.message) as told:
        window.commands[key].trigger()
    assert session.project is before and "cannot be seen here" in told.args[1]
    window.switch_to("measure")  # the 3D view is there
    window.commands[key].trigger()
    assert session.project is not before
