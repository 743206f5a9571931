"""The Motion panel comes where it is called for, and a scan that was stopped goes on by the menu."""

from __future__ import annotations

from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from pytestqt.qtbot import QtBot

from render.base.errors import Cancelled
from render.scene.motion import LinearStage
from studio.project.document import Document
from studio.qt.core.jobs import BUSY, RENDER
from studio.qt.core.scan_progress import share
from studio.qt.render import motion_panel
from studio.qt.render.motion_panel import MotionPanel
from studio.qt.shell.window import MainWindow
from studio.qt.shell.workspaces import WORKSPACES
from studio.runtime.console import FRAMES
from studio.scan.options import Listener, ScanOptions
from tests.studio.qt.shell.window_hands import answer, until_cancelled

MOTION = ("scene", "motion")


def click_in_tree(window: MainWindow, qtbot: QtBot, path: tuple[str | int, ...]) -> None:
    tree = window.panels["scene"]
    place = tree.visualItemRect(tree.item(path)).center()  # type: ignore[attr-defined]
    qtbot.mouseClick(tree.viewport(), Qt.MouseButton.LeftButton, pos=place)  # type: ignore[attr-defined]


@pytest.mark.parametrize("workspace", [each.key for each in WORKSPACES])
def test_f6_and_a_click_on_motion_bring_its_panel(window: MainWindow, qtbot: QtBot, workspace: str) -> None:
    window.switch_to(workspace)
    qtbot.keyClick(window, Qt.Key.Key_F6)
    assert window.docks["motion"].isHidden()
    click_in_tree(window, qtbot, MOTION)
    panel = window.panels["motion"]
    qtbot.waitUntil(lambda: not panel.visibleRegion().isEmpty())
    assert window.session.selection == MOTION and window.docks["inspector"].isVisible()
    click_in_tree(window, qtbot, ())
    assert panel.isVisible(), "it stays until another workspace is shown"
    window.switch_to("measure")
    assert window.docks["motion"].isHidden()


def test_a_project_that_moves_has_the_panel_behind_design_whenever_it_is_set_up(
    window: MainWindow, qtbot: QtBot
) -> None:
    motion, design = window.panels["motion"], window.panels["readout"]
    assert window.workspace == "setup" and window.docks["motion"].isHidden()
    window.session.set(("scene", "motion"), LinearStage(step=(0.001, 0.0, 0.0), steps=4))
    qtbot.waitUntil(lambda: not window.docks["motion"].isHidden())  # it asked for another workspace first
    qtbot.waitUntil(lambda: not design.visibleRegion().isEmpty())
    for away in ("measure", "study"):
        window.switch_to(away)
        assert window.docks["motion"].isHidden()
        window.switch_to("setup")
        qtbot.waitUntil(lambda: not window.docks["motion"].isHidden())
        qtbot.waitUntil(lambda: not design.visibleRegion().isEmpty())
        assert motion.visibleRegion().isEmpty()
    moving = window.session.document.project
    window.switch_to("render")
    window.switch_to("setup")
    window.files.replace(Document(moving, None))
    qtbot.waitUntil(lambda: not window.docks["motion"].isHidden())


def test_the_tab_that_was_in_front_is_so_again_after_another_workspace(window: MainWindow, qtbot: QtBot) -> None:
    def wait_for_front(key: str) -> None:
        qtbot.waitUntil(lambda: not window.docks["motion"].isHidden())
        qtbot.waitUntil(lambda: not window.panels[key].visibleRegion().isEmpty())

    window.session.set(("scene", "motion"), LinearStage(step=(0.001, 0.0, 0.0), steps=4))
    wait_for_front("readout")
    for chosen, behind in (("motion", "readout"), ("readout", "motion"), ("motion", "readout")):
        window.docks[chosen].raise_()  # as a click on its tab does
        wait_for_front(chosen)
        for away in ("measure", "study"):
            window.switch_to(away)
            assert window.docks["motion"].isHidden()
        window.switch_to("setup")
        wait_for_front(chosen)
        assert window.panels[behind].visibleRegion().isEmpty()


def test_a_scan_that_was_stopped_goes_on_as_the_message_says(
    window: MainWindow, qtbot: QtBot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[bool] = []

    def scan(*_: object, options: ScanOptions, **others: object) -> object:
        asked.append(options.resume)
        raise Cancelled

    monkeypatch.setattr("studio.scan.scan.run_scan", scan)
    motion, command = window.panels["motion"], window.commands["resume_scan"]
    assert isinstance(motion, MotionPanel) and not command.isEnabled()
    window.switch_to("measure")
    told = "Render > Resume the scan"
    with qtbot.waitSignal(window.session.message, check_params_cb=lambda _level, text: told in text):
        motion.run_into(tmp_path / "scan")
    assert command.isEnabled()
    with qtbot.waitSignal(window.runner.cancelled):
        command.trigger()
    assert asked == [False, True] and motion.isVisible()
    assert motion.stopped is not None
    window.files.replace(motion.stopped.document)
    assert not command.isEnabled(), "another project was opened"


@pytest.fixture
def endless(window: MainWindow, monkeypatch: pytest.MonkeyPatch) -> MotionPanel:
    """Its scans run until they are cancelled."""

    def scan(*_: object, listener: Listener, **__: object) -> None:
        until_cancelled(listener.progress, listener.cancelled)

    monkeypatch.setattr("studio.scan.scan.run_scan", scan)
    motion = window.panels["motion"]
    assert isinstance(motion, MotionPanel)
    return motion


def test_the_frames_that_are_there_do_not_foretell_the_time_left(
    window: MainWindow, qtbot: QtBot, tmp_path: Path, endless: MotionPanel
) -> None:
    motion = endless
    window.session.set(("scene", "motion"), LinearStage(step=(0.001, 0.0, 0.0), steps=4))
    for expected in (0.0, share(FRAMES, 0.5)):
        job = motion.run_into(tmp_path) if motion.stopped is None else motion.resume()
        assert job is not None and job.there == expected
        for i in (0, 1, 3):
            (tmp_path / f"frame_{i:04d}.json").touch()
        with qtbot.waitSignal(window.runner.cancelled):
            window.runner.cancel(RENDER)
    window.files.count_as_saved(window.session.project)


def test_no_folder_is_asked_for_and_made_while_something_is_rendered(
    window: MainWindow, qtbot: QtBot, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[tuple[object, ...]] = []
    monkeypatch.setattr(motion_panel, "ask_results_folder", lambda *given: asked.append(given))
    window.runner.run(RENDER, "render", until_cancelled)
    with qtbot.waitSignal(window.session.message, check_params_cb=lambda _level, text: text == BUSY):
        window.commands["scan"].trigger()
    assert not asked
    with qtbot.waitSignal(window.runner.cancelled):
        window.runner.cancel(RENDER)
    window.commands["scan"].trigger()
    ((_, title, *_),) = asked
    size = window.panels["motion"].scale.currentText()  # type: ignore[attr-defined]
    assert str(title).endswith(f"at {size}"), "that of a single render may be another one"


def test_a_step_that_moves_by_nothing_has_no_sign() -> None:
    """There stood "moved by (-0.00, 4.00, 0.00) mm"."""
    told = motion_panel.describe(LinearStage(step=(-1e-9, 0.002, 0.0), steps=3), 2)
    assert told.endswith(" moved by (0.00, 4.00, 0.00) mm")


@pytest.fixture
def stopped(window: MainWindow, qtbot: QtBot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> MotionPanel:
    """A scan of 20 frames of 5 mm was stopped, and the project has 9 of 10 mm by now."""

    def scan(*_: object, **__: object) -> object:
        raise Cancelled

    monkeypatch.setattr("studio.scan.scan.run_scan", scan)
    motion, session = window.panels["motion"], window.session
    assert isinstance(motion, MotionPanel)
    window.show_panel("motion")
    session.set(("scene", "motion"), LinearStage(step=(0.0, 0.005, 0.0), steps=20))
    with qtbot.waitSignal(window.runner.cancelled):
        motion.run_into(tmp_path / "scan")
    qtbot.waitUntil(lambda: motion.stopped is not None)
    assert motion.other.isHidden(), "it is the same scan"
    session.set(("scene", "motion"), LinearStage(step=(0.0, 0.01, 0.0), steps=9))
    return motion


def test_a_scan_of_other_settings_is_told_before_it_goes_on(stopped: MotionPanel) -> None:
    expected = "goes on with the 20 frames of 5 mm that were begun; the project is now another"
    for told in (stopped.other.text(), stopped.go_on.toolTip()):
        assert expected in told and "Frames: 20 → 9" in told
    assert stopped.other.isVisible()
    stopped.session.document.undo()
    assert not stopped.other.isVisible() and "another" not in stopped.go_on.toolTip()
    stopped.session.document.redo()


@pytest.mark.parametrize(
    ("button", "begun", "anew"), [("Resume as begun", 1, 0), ("New scan…", 0, 1), ("Cancel", 0, 0)]
)
def test_it_is_asked_whether_other_settings_go_on(
    stopped: MotionPanel,
    window: MainWindow,
    qtbot: QtBot,
    monkeypatch: pytest.MonkeyPatch,
    button: str,
    begun: int,
    anew: int,
) -> None:
    asked: list[object] = []
    resumed: list[object] = []
    monkeypatch.setattr(motion_panel, "ask_results_folder", lambda *given: asked.append(given))
    monkeypatch.setattr(stopped, "resume", lambda: resumed.append(stopped.stopped))
    answer(qtbot, "resume", button)
    window.commands["resume_scan"].trigger()
    assert (len(resumed), len(asked)) == (begun, anew)


def test_a_scan_under_way_says_that_it_is_of_other_settings(
    window: MainWindow, qtbot: QtBot, tmp_path: Path, endless: MotionPanel
) -> None:
    motion = endless
    window.session.set(("scene", "motion"), LinearStage(step=(0.0, 0.005, 0.0), steps=20))
    motion.run_into(tmp_path)
    window.session.set(("scene", "motion", "steps"), 9)
    assert motion.other.text().startswith("The scan under way goes on with the 20 frames of 5 mm")
    with qtbot.waitSignal(window.runner.cancelled):
        window.runner.cancel(RENDER)
    assert motion.other.text().startswith("Resume goes on")
