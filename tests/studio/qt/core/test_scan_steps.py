"""A scan in the window: its results reach Measure, a step at a time, also those of an earlier day."""

from __future__ import annotations

import shutil
from html import unescape
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QApplication, QFileDialog
from pytestqt.qtbot import QtBot

from render.base.errors import Cancelled, InputError
from studio.project.document import Document
from studio.project.project import Project
from studio.qt.core.jobs import RENDER
from studio.qt.render import motion_panel
from studio.qt.render.motion_panel import MotionPanel
from studio.qt.render.render_row import describe
from studio.qt.render.render_table import RenderTable
from studio.qt.results.results_panel import ResultsPanel
from studio.qt.shell import file_actions
from studio.qt.shell.window import MainWindow
from studio.scan.options import Listener, ScanOptions
from studio.scan.scan_folder import image_scale_of, open_folder
from tests.studio.qt.core.scan_hands import results_of, shown
from tests.studio.qt.shell.window_hands import answer
from tests.studio.scan_of_steps import SCALE


def cell(panel: ResultsPanel, row: str, column: int = 0) -> float:
    rows = {panel.table.verticalHeaderItem(i).text(): i for i in range(panel.table.rowCount())}
    return float(panel.table.item(rows[row], column).text())


class TestOpened:
    def test_measure_shows_them_with_the_project_at_its_own_size(
        self, opened: MainWindow, scanned: tuple[Path, Path]
    ) -> None:
        session, panel = opened.session, results_of(opened)
        assert opened.workspace == "measure" and panel.stack.currentIndex() == 1
        assert session.document.path == scanned[0].resolve() and session.project == Project.load(scanned[0])
        assert not opened.files.unsaved
        assert panel.scan_bar.isVisible() and "step 1 of 3" in panel.scan_bar.told.text()
        row = open_folder(scanned[1]).manifest["results"][0]
        assert cell(panel, "RMSE / µm") == pytest.approx(1e6 * row["depth_m"]["rmse"], rel=5e-3)
        assert cell(panel, "Points") == row["points"]
        assert set(opened.cloud.steps.tolist()) == {0, 1, 2}

    def test_the_slider_goes_from_step_to_step_with_one_frame_in_memory(self, opened: MainWindow, qtbot: QtBot) -> None:
        panel = results_of(opened)
        panel.scan_bar.steps.slider.setValue(2)
        render = shown(opened, qtbot, 2)
        assert opened.session.step == 2 and opened.session.renders == [render]
        assert "step 3 of 3" in panel.scan_bar.told.text()
        panel.scan_bar.scope.setCurrentIndex(1)
        own = render.measurements["likelihood"][0]
        assert cell(panel, "RMSE / µm") == pytest.approx(1e6 * own.errors.depth_z.rmse, rel=5e-3)
        assert cell(panel, "Points") == own.points.valid.sum()
        assert set(opened.cloud.steps.tolist()) == {2}

    def test_a_step_is_chosen_in_the_plot_of_all(self, opened: MainWindow, qtbot: QtBot) -> None:
        panel = results_of(opened)
        np.testing.assert_allclose(
            panel.by_step.rmse.yData,
            1e6 * opened.session.shown.scan.by_step(0, "depth")[1],  # type: ignore[union-attr]
        )
        panel.by_step.chosen.emit(1)
        shown(opened, qtbot, 1)
        assert panel.by_step.cursor.value() == 2

    def test_the_hovered_row_stays_from_step_to_step(self, opened: MainWindow, qtbot: QtBot) -> None:
        opened.measuring.worst()
        row = opened.session.hovered
        opened.session.look_at_step(1)
        render = shown(opened, qtbot, 1)
        assert row is not None and opened.session.hovered == row
        here = opened.cloud.rows == row
        assert np.count_nonzero(here & (opened.cloud.steps == 1)) == opened.cloud._marks.n_points
        assert f"Row {row}" in results_of(opened).reading.text() and render.frame.step == 1

    def test_their_scale_is_told_wherever_figures_stand(
        self, opened: MainWindow, qtbot: QtBot, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, quick_reports: None
    ) -> None:
        panel, render = results_of(opened), opened.session.shown
        assert render is not None and render.scanner_scale == SCALE
        assert "image scale 0.5" in panel.head_text.text() and panel.head.isVisible()
        assert "not the scanner's" in unescape(panel.notices[0].text.text())
        assert "0.5 x" in opened.cloud.bar.note
        assert "image scale 0.5" in describe(render) and "step 1 of 3" in describe(render)
        asked: list[str] = []

        def choose(parent: object, title: str, start: str, kinds: str) -> tuple[str, str]:
            asked.append(start)
            return str(tmp_path / "report.html"), kinds

        monkeypatch.setattr(QFileDialog, "getSaveFileName", choose)
        with qtbot.waitSignal(opened.runner.finished, timeout=60_000):
            opened.exports.ask("export_html")
        assert "at 0.5 x" in asked[0]
        assert "image scale 0.5: not the scanner" in (tmp_path / "report.html").read_text()
        assert "not the scanner's" in opened.panels["log"].as_text()  # type: ignore[attr-defined]

    def test_a_scan_is_found_again_at_another_step(self, opened: MainWindow, qtbot: QtBot) -> None:
        before = opened.session.shown
        opened.session.look_at_step(1)
        now = shown(opened, qtbot, 1)
        assert now is not before and opened.session.present(before) is now
        opened.session.renders = []
        assert opened.session.present(before) is None

    def test_in_the_table_of_renders_its_figures_are_those_of_a_step(self, opened: MainWindow, qtbot: QtBot) -> None:
        render = opened.session.shown
        assert render is not None and render.scan is not None
        table = RenderTable(opened, opened.session, [(render, "a scan")])
        qtbot.addWidget(table)
        assert table.renders[0].name == f"a scan, step {render.frame.step + 1} of {render.scan.count}"

    def test_what_was_changed_since_is_said_to_be_in_the_step_alone(self, opened: MainWindow, qtbot: QtBot) -> None:
        panel = results_of(opened)
        said = panel.notices[0].text
        assert "as they were scanned" not in said.text()
        with qtbot.waitSignal(opened.session.measured, timeout=20_000):
            opened.session.set(("sensor", "bits"), 8)
        assert "as they were scanned" in said.text() and "Measure the scan again" in panel.head_text.text()
        panel.scan_bar.scope.setCurrentIndex(1)
        assert "as they were scanned" not in said.text()
        opened.files.count_as_saved(opened.session.project)

    def test_a_folder_that_is_dropped_is_opened(
        self, window: MainWindow, scanned: tuple[Path, Path], qtbot: QtBot
    ) -> None:
        window.take([scanned[1]])
        shown(window, qtbot, 0)

    @pytest.mark.parametrize("rounded", [False, True], ids=["invertible", "rounded"])
    def test_of_an_edited_project_they_come_with_what_was_scanned(
        self,
        window: MainWindow,
        scanned: tuple[Path, Path],
        qtbot: QtBot,
        tmp_path: Path,
        rounded: bool,
        monkeypatch: pytest.MonkeyPatch,
    ) -> None:
        if rounded:
            monkeypatch.setattr(file_actions, "_at_full_scale", lambda found: None)
        camera = Project.load(scanned[0]).scene.camera
        shutil.copytree(scanned[0].parent, tmp_path / "project", dirs_exist_ok=True)
        folder = Path(shutil.copytree(scanned[1], tmp_path / "scan"))
        for file in (tmp_path / "project").glob("*.json"):
            file.unlink()
        told: list[str] = []
        window.session.message.connect(lambda level, text: told.append(text))
        assert window.files.open(folder)
        render = shown(window, qtbot, 0)
        assert window.workspace == "measure"
        assert any("stands for" in text and "at 0.5 x" in text for text in told) == rounded
        assert window.session.document.path is None and not window.files.unsaved
        assert ("at 0.5 x" in window.session.project.name) == rounded
        # what is rendered next is of the scanner, whose sides an image at half its scale knows to a pixel
        assert (abs(window.session.project.scene.camera.width - camera.width) <= 1) != rounded
        assert render.scanner_scale == SCALE and not window.session.stale
        window.files.count_as_saved(window.session.project)

    def test_a_step_that_is_damaged_is_named_and_the_others_are_shown(
        self, window: MainWindow, scanned: tuple[Path, Path], qtbot: QtBot, tmp_path: Path
    ) -> None:
        shutil.copytree(scanned[0].parent, tmp_path / "project", dirs_exist_ok=True)
        folder = Path(shutil.copytree(scanned[1], tmp_path / "scan"))
        (folder / "frame_0001.exr").write_bytes(b"nothing")
        assert window.files.open(folder)
        shown(window, qtbot, 0)
        panel = results_of(window)
        window.session.look_at_step(1)
        qtbot.waitUntil(lambda: "Step 2 cannot be shown" in panel.head_text.text())
        assert "frame_0001.exr" in panel.head_text.text()
        window.session.look_at_step(2)
        shown(window, qtbot, 2)
        assert "cannot be shown" not in panel.head_text.text()

    def test_a_scan_that_did_not_finish_is_told_with_what_to_do(
        self, window: MainWindow, scanned: tuple[Path, Path], tmp_path: Path
    ) -> None:
        folder = Path(shutil.copytree(scanned[1], tmp_path / "scan"))
        (folder / "scan.json").unlink()
        before = window.session.document
        assert not window.files.open(folder)
        box = next(each for each in QApplication.topLevelWidgets() if each.objectName() == "trouble")
        assert "no finished scan" in f"{box.text()}\n{box.informativeText()}"  # type: ignore[attr-defined]
        box.close()
        assert window.session.document is before


def test_the_command_line_opens_them(qtbot: QtBot, scanned: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch) -> None:
    from studio.qt.shell import app, uncaught_errors

    monkeypatch.setattr(uncaught_errors, "catch_faults", lambda *_: None)  # it would take the place of the test's own
    window = app.start(scanned[1])
    qtbot.waitExposed(window)
    shown(window, qtbot, 0)
    assert window.workspace == "measure" and window.session.document.path == scanned[0].resolve()
    window.close()
    window.deleteLater()


class TestRun:
    def test_its_results_reach_measure(
        self, moving: MotionPanel, window: MainWindow, qtbot: QtBot, tmp_path: Path
    ) -> None:
        with qtbot.waitSignal(moving.runner.finished, timeout=60_000):
            moving.run_into(tmp_path / "scan", report=False)
        render = shown(window, qtbot, 0)
        assert render.scan is not None and render.scan.count == 3 and render.source == window.session.project
        window.switch_to("measure")
        assert results_of(window).scan_bar.isVisible()

    def test_looking_at_a_render_meanwhile_loses_none_of_its_points(
        self, moving: MotionPanel, window: MainWindow, opened: MainWindow, qtbot: QtBot
    ) -> None:
        cloud = window.cloud
        points = {name: column[:30] for name, column in opened.session.shown.scan.points.items()}  # type: ignore[union-attr]
        cloud.begin_scan(0.25)
        cloud.grow(points)
        cloud.refresh()
        assert len(cloud.points) > 30 and "0.5 x" in cloud.bar.note
        cloud.grow(points)
        assert len(cloud.points) == 60 and "0.25 x" in cloud.bar.note

    def test_progress_says_which_frame_it_is(
        self, moving: MotionPanel, qtbot: QtBot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        told: list[str] = []

        def scan(*args: object, listener: Listener, **options: object) -> object:
            def tell(stage: str, done: float) -> None:
                listener.progress(stage, done)
                job = moving.runner.job(RENDER)
                assert job is not None
                told.append(job.stage)

            for i in range(3):
                tell("frames", i / 3)
                tell("line extraction", 0.0)
            tell("frames", 1.0)
            tell("writing points", 0.0)
            raise InputError("enough")

        monkeypatch.setattr("studio.scan.scan.run_scan", scan)
        with qtbot.waitSignal(moving.runner.failed):
            moving.run_into(tmp_path / "scan")
        assert told[1::2] == [*(f"frame {i} of 3: line extraction" for i in (1, 2, 3)), "writing points"]
        for box in QApplication.topLevelWidgets():
            if box.objectName() == "trouble":
                box.close()

    def test_when_cancelled_it_resumes_with_the_frames_there_are(
        self, moving: MotionPanel, window: MainWindow, qtbot: QtBot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        from studio.scan import resume

        rendered: list[int] = []
        real = resume.render_step

        def counted(project: Project, world: object, step: int, *args: object, **options: object) -> object:
            rendered.append(step)
            if len(rendered) == 2:
                moving.runner.cancel(RENDER)
            return real(project, world, step, *args, **options)  # type: ignore[arg-type]

        monkeypatch.setattr(resume, "render_step", counted)
        with qtbot.waitSignal(moving.runner.cancelled, timeout=60_000):
            moving.run_into(tmp_path / "scan", report=False)
        # the frame beside it may have begun as well, and keeps nothing
        assert rendered[0] == 0 and set(rendered) <= {0, 1, 2} and moving.go_on.isVisible()
        begun = len(rendered)
        moving.scale.setCurrentText("quarter size")
        assert moving.go_on.text() == "Resume (half size)" and "at half size, as it began" in moving.go_on.toolTip()
        window.session.set(("sensor", "bits"), 8)
        assert "Bit depth: 12 → 8" in moving.go_on.toolTip()
        answer(qtbot, "resume", "Resume as begun")
        with qtbot.waitSignal(moving.runner.finished, timeout=60_000):
            qtbot.mouseClick(moving.go_on, Qt.MouseButton.LeftButton)
        # the first frame of the block teaches the others again
        assert sorted({*rendered[begun:]} - {0}) == [1, 2] and moving.go_on.isHidden()
        assert open_folder(tmp_path / "scan").project.sensor.bits == 12
        assert image_scale_of(open_folder(tmp_path / "scan")) == 0.5
        shown(window, qtbot, 0)
        window.files.count_as_saved(window.session.project)

    def test_the_folder_of_an_unfinished_scan_is_gone_on_with(
        self, moving: MotionPanel, qtbot: QtBot, scanned: tuple[Path, Path], tmp_path: Path,
        monkeypatch: pytest.MonkeyPatch,
    ) -> None:  # fmt: skip
        folder = Path(shutil.copytree(scanned[1], tmp_path / "scan"))
        (folder / "scan.json").unlink()
        asked: list[object] = []

        def scan(*args: object, options: ScanOptions, **others: object) -> object:
            asked.append(options.resume)
            raise Cancelled

        monkeypatch.setattr("studio.scan.scan.run_scan", scan)
        for place in (folder, tmp_path / "another"):
            with qtbot.waitSignal(moving.runner.cancelled):
                moving.run_into(place)
        assert asked == [True, False]

    def test_it_stays_out_of_another_project_that_was_opened_meanwhile(
        self, moving: MotionPanel, window: MainWindow, qtbot: QtBot, small_project: Path, tmp_path: Path
    ) -> None:
        with qtbot.waitSignal(moving.grew, timeout=60_000):
            moving.run_into(tmp_path / "scan", report=False)
        window.files.replace(Document(Project.load(small_project), small_project))
        if window.runner.job(RENDER) is not None:
            qtbot.waitUntil(lambda: window.runner.job(RENDER) is None)
        assert window.session.renders == [] and len(window.cloud.points) == 0
        assert moving.open.isHidden() and moving.go_on.isHidden()

    def test_a_finished_scan_is_not_lost_without_a_question(
        self,
        moving: MotionPanel,
        scanned: tuple[Path, Path],
        tmp_path: Path,
        monkeypatch: pytest.MonkeyPatch,
    ) -> None:
        folder = tmp_path / "scan"
        shutil.copytree(scanned[1], folder)
        asked: list[Path] = []
        began: list[Path] = []
        monkeypatch.setattr(motion_panel, "may_replace_scan", lambda _, where: asked.append(where))
        monkeypatch.setattr(moving, "run_into", began.append)
        for chosen in (folder, tmp_path / "new"):
            monkeypatch.setattr(motion_panel, "ask_results_folder", lambda *_, chosen=chosen: chosen)
            moving.ask_and_run()
        assert asked == [folder] and began == [tmp_path / "new"]
