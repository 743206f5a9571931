"""A desk with a study on it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from pytestqt.qtbot import QtBot

from tests.studio.qt.study.desk import Desk


@pytest.fixture
def desk(qtbot: QtBot, tmp_path: Path) -> Iterator[Desk]:
    made = Desk(tmp_path)
    for widget in (made.panel, made.charts, made.inspector):
        qtbot.addWidget(widget)
    made.charts.resize(700, 600)
    made.charts.show()
    made.panel.show()
    qtbot.waitExposed(made.charts)
    yield made
    made.close()
