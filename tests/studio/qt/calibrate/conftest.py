"""A desk with nothing on it, and one with a calibration."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from PySide6.QtCore import Qt
from pytestqt.qtbot import QtBot

from studio.calibration import material
from tests.studio.qt.calibrate.calibrate_desk import THERE, Desk, seen, settled


@pytest.fixture
def desk(qtbot: QtBot) -> Iterator[Desk]:
    made = Desk()
    for widget in (made.panel, made.boards, made.found):
        qtbot.addWidget(widget)
    made.panel.show()
    made.boards.resize(700, 600)
    made.boards.show()
    qtbot.waitExposed(made.boards)
    yield made
    made.close()


@pytest.fixture
def solved(qtbot: QtBot, desk: Desk, monkeypatch: pytest.MonkeyPatch) -> Desk:
    """With a calibration of virtual boards, fewer than a person gets."""
    monkeypatch.setattr(material, "virtual", lambda *_: (seen(), THERE))
    qtbot.mouseClick(desk.panel.simulate, Qt.MouseButton.LeftButton)
    settled(qtbot, desk)
    assert desk.work.problem == ""
    return desk
