"""A scan that plays shows its own frames; beside one that runs, the figures of another are said to be of another."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import Qt
from pytestqt.qtbot import QtBot

from studio.qt.core.scan_steps import scan_steps
from studio.qt.image.camera_view import CameraView
from studio.qt.render.motion_panel import MotionPanel
from studio.qt.results.heads import GROWING
from studio.qt.shell.window import MainWindow
from studio.scan.scan_folder import open_folder
from tests.studio.qt.core.scan_hands import results_of, shown


def test_it_plays_its_own_frames_as_fast_as_they_are_measured(opened: MainWindow, qtbot: QtBot) -> None:
    """A live estimate of a scene that "has changed" stood in their place while it played."""
    session, camera, bar = opened.session, opened.panels["camera"], results_of(opened).scan_bar.steps
    assert isinstance(camera, CameraView)
    seen: list[tuple[int, int, bool, str]] = []

    def look() -> None:
        frame = session.shown.frame.step if session.shown is not None else -1
        seen.append((session.step, frame, camera.is_live, camera.badge.text.text()))

    measured: set[int] = set()
    session.measured.connect(lambda: measured.add(session.step))
    session.step_changed.connect(look)
    session.renders_changed.connect(look)
    qtbot.mouseClick(bar.play, Qt.MouseButton.LeftButton)
    shown(opened, qtbot, 2)
    assert session.step == 2 and measured >= {1, 2}
    assert all(step - frame <= 1 for step, frame, _, _ in seen), "no step is gone past unseen"
    assert not any(live for _, _, live, _ in seen)
    assert not any("estimate" in told or "changed" in told for *_, told in seen)
    assert not camera.badge.isVisible()


def test_while_it_runs_the_figures_of_another_are_said_to_be_of_another(
    moving: MotionPanel, window: MainWindow, scanned: tuple[Path, Path], qtbot: QtBot, tmp_path: Path
) -> None:
    scan_steps(window.session).show(open_folder(scanned[1]))
    shown(window, qtbot, 0)
    head = results_of(window).head_text
    assert GROWING not in head.text()
    with qtbot.waitSignal(moving.grew, timeout=60_000):
        moving.run_into(tmp_path / "out")
    assert GROWING in head.text()
    qtbot.waitUntil(lambda: len(window.session.renders) == 2)
    shown(window, qtbot, 0)
    qtbot.waitUntil(lambda: GROWING not in head.text())
