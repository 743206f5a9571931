"""What is exported is of the frame and the settings that the export tells, also while the panels lag behind."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from PySide6.QtWidgets import QMainWindow
from pytestqt.qtbot import QtBot

from studio.qt.core.actions import Actions
from studio.qt.core.jobs import JobRunner
from studio.qt.core.session import Session
from studio.qt.render.develop_panel import DevelopPanel
from studio.qt.results.export_actions import ExportActions
from studio.runtime.preferences import PreferencesFile
from tests.studio.qt.small_session import small_session


@pytest.fixture
def measured(qtbot: QtBot) -> tuple[Session, DevelopPanel]:
    session = small_session(rendered=True)
    panel = DevelopPanel(session)
    qtbot.addWidget(panel)
    with qtbot.waitSignal(session.measured, timeout=20_000):
        panel.refresh()
    return session, panel


def export(session: Session, path: Path, qtbot: QtBot) -> bytes:
    window = QMainWindow()
    qtbot.addWidget(window)
    runner = JobRunner(window)
    preferences = PreferencesFile(path.parent / "preferences.json")
    actions = ExportActions(window, session, runner, preferences, Actions(window))
    with qtbot.waitSignal(runner.finished, timeout=60_000):
        actions.write("export_csv", path)
    runner.close()
    return path.read_bytes()


def test_a_setting_just_changed_is_in_the_exported_points(
    measured: tuple[Session, DevelopPanel], qtbot: QtBot, tmp_path: Path
) -> None:
    session, panel = measured
    before = export(session, tmp_path / "before.csv", qtbot)
    session.set(("sensor", "exposure_time"), 0.3 * session.project.sensor.exposure_time)
    at_once = export(session, tmp_path / "at_once.csv", qtbot)
    qtbot.waitUntil(lambda: not panel.busy)
    assert at_once == export(session, tmp_path / "later.csv", qtbot) != before


def test_light_that_was_refined_since_it_was_measured_is_measured_anew(
    measured: tuple[Session, DevelopPanel], qtbot: QtBot, tmp_path: Path
) -> None:
    session, panel = measured
    render = session.shown
    assert render is not None
    before = export(session, tmp_path / "before.csv", qtbot)
    panel.close()
    render.frame = replace(render.frame, laser_direct=[0.3 * light for light in render.frame.laser_direct])
    assert export(session, tmp_path / "after.csv", qtbot) != before
