"""What carried the board in the workspace Calibrate: found, shown, used in the project, and told where it cannot be."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QFileDialog
from pytestqt.qtbot import QtBot

from analysis.calibration.motion import Motion
from analysis.calibration.virtual import noisy
from render.scene.motion import LinearStage
from studio.calibration import material
from studio.calibration.material import Material
from studio.project.found_motion import FoundStage
from studio.qt.calibrate.keeping import use
from tests.analysis.calibration.boards import SIZE, truth, views_of
from tests.studio.qt.calibrate.calibrate_desk import CORNER, Desk, settled

STEP = np.array([0.3, 0.9, 0.31])
POSITIONS = np.array([0.0, 0.02, -0.03, 0.04])


def carried() -> Material:
    """Four views of a board that a stage carries, four of it put by hand."""
    there = truth(3, 8, tilt=(15.0, 35.0))
    group = np.concatenate([np.zeros(4), 1 + np.arange(4)]).astype(np.intp)
    motion = Motion("stage", group, np.append(POSITIONS, np.zeros(4)), STEP, np.eye(3)[1])
    there = replace(there, motion=motion)
    there = there.moved(np.zeros(len(there.shared)), np.zeros((5, 6)))
    drawn = noisy(views_of(there, laser_step=64), np.random.default_rng(3))
    return Material(tuple(replace(view, target=view.target + CORNER) for view in drawn), SIZE, 1)


def test_the_project_s_own_motion_is_found_and_used_in_it(qtbot: QtBot, desk: Desk) -> None:
    moved = LinearStage(moves="objects", step=(0.006, 0.003, 0.0), steps=20)
    desk.session.set(("scene", "motion"), moved, "move")
    qtbot.mouseClick(desk.panel.simulate, Qt.MouseButton.LeftButton)
    settled(qtbot, desk)
    assert desk.work.solved is not None, desk.work.problem
    assert "stage: direction" in desk.found.text.toPlainText()
    assert not desk.panel.carried.isEnabled() and desk.panel.carried.currentText() == "Carried as the project moves"
    # every view has its residuals, those of the carried board as well
    rms = [row.rms for row, _ in desk.work.solved.rows]
    assert all(one is not None and one < 0.1 for one in rms)
    use(desk.work)
    found = desk.session.project.calibration.motion
    assert isinstance(found, FoundStage)
    camera = desk.session.project.scene.T_world_camera(0)[:3, :3]
    way = camera @ np.array(found.step)
    sigma = np.sqrt(np.diag(np.array(found.covariance)).max())
    expected = np.array(moved.step) / np.linalg.norm(moved.step)
    # beyond five sigmas one trial in a million
    assert np.abs(way - expected).max() < 5.0 * sigma < 5e-3


def test_a_table_of_what_a_stage_was_told_is_asked_for(
    qtbot: QtBot, desk: Desk, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(material, "photographed", lambda *_, **__: carried())
    for number in range(8):
        (tmp_path / f"view {number}.png").write_bytes(b"")
    table = tmp_path / "stage.csv"
    table.write_text("view,position_mm\n" + "".join(f"view {i},{1e3 * p}\n" for i, p in enumerate(POSITIONS)))
    desk.work.open_folder(tmp_path)
    settled(qtbot, desk)
    assert desk.work.solved is not None and desk.work.solved.result.estimate.motion is None
    box = desk.panel.carried
    monkeypatch.setattr(QFileDialog, "getOpenFileName", lambda *_: (str(table), ""))
    box.setCurrentIndex(1)
    box.activated.emit(1)
    settled(qtbot, desk)
    assert desk.work.solved is not None, desk.work.problem
    motion = desk.work.solved.result.estimate.motion
    assert motion is not None and motion.parameters == pytest.approx(STEP, abs=5e-3)
    assert box.currentText() == "Carried by: stage.csv" and "way for each mm told" in desk.found.text.toPlainText()
    table.write_text("view,position_mm\nview 0,1\nanother,2\n")
    box.activated.emit(1)
    settled(qtbot, desk)
    assert "no photograph of that name" in desk.panel.problem.text() and "another" in desk.panel.problem.text()
    box.activated.emit(0)
    settled(qtbot, desk)
    assert desk.panel.problem.text() == "" and box.currentText() == "Board put by hand"
    assert desk.work.solved is not None and desk.work.solved.result.estimate.motion is None


def test_a_dialog_that_is_left_changes_nothing(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(QFileDialog, "getOpenFileName", lambda *_: ("", ""))
    desk.panel.carried.setCurrentIndex(2)
    desk.panel.carried.activated.emit(2)
    assert desk.work.motion_file is None and desk.panel.carried.currentIndex() == 0
