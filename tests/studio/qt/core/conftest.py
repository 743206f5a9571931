"""A finished scan, the window that looks at it, and a project in the window that is about to be scanned."""

from __future__ import annotations

from pathlib import Path

import pytest
from pytestqt.qtbot import QtBot

from studio.project.document import Document
from studio.qt.render.motion_panel import MotionPanel
from studio.qt.shell.window import MainWindow
from tests.studio.qt.core.scan_hands import shown
from tests.studio.scan_of_steps import small_project, small_scan


@pytest.fixture(scope="module")
def scanned(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    return small_scan(tmp_path_factory.mktemp("scan"))


@pytest.fixture
def opened(window: MainWindow, scanned: tuple[Path, Path], qtbot: QtBot) -> MainWindow:
    assert window.files.open(scanned[1])
    shown(window, qtbot, 0)
    return window


@pytest.fixture
def moving(window: MainWindow, tmp_path: Path) -> MotionPanel:
    file = tmp_path / "moving" / "steps.json"
    window.files.replace(Document(small_project().save(file), file))
    panel = window.panels["motion"]
    assert isinstance(panel, MotionPanel)
    panel.scale.setCurrentText("half size")
    window.show_panel("motion")
    return panel
