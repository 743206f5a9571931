"""The Calibrate workspace: boards shown, views dropped and restored, the next pose, and the way into the project."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QFileDialog
from pytestqt.qtbot import QtBot

from studio.calibration import material
from studio.calibration.board_text import FORM
from studio.calibration.exchange import read_camera
from studio.qt.calibrate.board_view import COVERAGE, DEPTH, NEXT, RESIDUALS, TABS
from studio.qt.calibrate.calibrate_panel import NARROWEST
from studio.qt.calibrate.keeping import FORMS, may_go, save, use, use_file
from studio.qt.core import theme
from tests.analysis.calibration.boards import SIZE
from tests.studio.qt.calibrate.calibrate_desk import LINE, VIEWS, Desk, seen, settled
from tests.studio.qt.shell.window_hands import answer, choose_file, contrast


class TestViews:
    def test_each_has_its_rms_and_the_current_one_is_drawn(self, solved: Desk) -> None:
        table, work = solved.panel.views, solved.work
        assert table.rowCount() == VIEWS
        # two coordinates of 0.05 px each, less the pose's and the camera's share
        rms = [float(table.item(row, 1).text()) for row in range(VIEWS)]
        assert all(0.05 < each < 0.09 for each in rms)
        table.setCurrentCell(3, 0)
        assert work.shown == "view 3" and "view 3: 117 corners" in solved.boards.caption.text()
        x, y = solved.boards.items.arrows.getData()
        found = work.residuals()
        assert found is not None and len(x) == 6 * 117
        times = float(solved.boards.caption.text().split()[-4])
        shaft = np.column_stack([x, y]).reshape(-1, 6, 2)[:, 1] - found.pixel
        assert shaft == pytest.approx(times * found.off, abs=1e-6)

    def test_one_that_is_dropped_has_no_part_and_comes_back_to_the_same_numbers(
        self, qtbot: QtBot, solved: Desk
    ) -> None:
        before = solved.work.solved
        assert before is not None
        item = solved.panel.views.item(2, 0)
        item.setCheckState(Qt.CheckState.Unchecked)
        settled(qtbot, solved)
        now = solved.work.solved
        assert now is not None and now is not before
        assert "view 2" not in now.result.adjusted.seen.names and now.views == VIEWS - 1
        row = now.rows[2][0]
        own = before.rows[2][0]
        assert row.part == "dropped" and row.rms is not None and own.rms is not None
        assert row.rms >= own.rms, "a calibration that does not know a view cannot fit it better"
        assert solved.panel.views.item(2, 2).text() == "dropped"
        solved.panel.views.item(2, 0).setCheckState(Qt.CheckState.Checked)
        settled(qtbot, solved)
        again = solved.work.solved
        assert again is not None
        assert again.result.estimate.shared == pytest.approx(before.result.estimate.shared, rel=1e-12)

    def test_too_few_that_are_left_are_told_and_ticking_them_again_mends_it(self, qtbot: QtBot, solved: Desk) -> None:
        for row in range(VIEWS - 2):
            solved.work.drop(f"view {row}", dropped=True)
        settled(qtbot, solved)
        assert "too few views" in solved.panel.problem.text() and not solved.panel.use.isEnabled()
        assert solved.panel.views.item(0, 0).checkState() == Qt.CheckState.Unchecked
        for row in range(VIEWS - 2):
            solved.work.drop(f"view {row}", dropped=False)
        settled(qtbot, solved)
        assert solved.panel.problem.isHidden() and solved.panel.use.isEnabled()

    @pytest.mark.parametrize("choice", ["dark", "light"])
    def test_a_box_that_is_not_ticked_can_be_seen(self, solved: Desk, choice: theme.Choice) -> None:
        """WCAG 2.1 asks for 3 to 1."""
        theme.apply(choice)
        solved.work.drop("view 1", dropped=True)
        table = solved.panel.views
        grounds = []
        for number in (0, 1):
            picture = table.viewport().grab(table.visualItemRect(table.item(number, 0))).toImage()
            seen = [picture.pixelColor(x, picture.height() // 2).name() for x in range(20)]
            assert max(contrast(colour, seen[0]) for colour in seen) > 3.0
            grounds.append(seen[0])
        assert grounds[1] == theme.colours().window, "every other row is a shade apart"
        theme.apply("light")


class TestPictures:
    def test_the_ghost_is_where_the_advice_says_with_its_gain(self, solved: Desk) -> None:
        boards, work = solved.boards, solved.work
        assert work.solved is not None
        advice = work.solved.result.advice
        assert advice is not None
        boards.tabs.setCurrentIndex(NEXT)
        x, y = (np.asarray(each) for each in boards.items.edge.getData())
        estimate = work.solved.result.estimate
        middle = estimate.intrinsics[:2] * advice.centre[:2] / advice.centre[2] + estimate.intrinsics[2:]
        assert x.min() < middle[0] < x.max() and y.min() < middle[1] < y.max()
        assert f"{1e6 * advice.before:.1f} -> {1e6 * advice.after:.1f} µm" in boards.caption.text()
        solved.panel.target.setValue(1e5)
        assert boards.caption.text().startswith("Enough") and len(boards.items.edge.getData()[0]) == 0

    def test_the_ghost_for_the_3d_view_is_in_the_same_place(self, solved: Desk) -> None:
        work = solved.work
        assert work.virtual and len(solved.session.ghost) == 0, "nobody holds a virtual board"
        work.virtual = False
        work.solved_changed.emit()
        ghost = solved.session.ghost
        assert work.solved is not None and work.solved.result.advice is not None
        advice = work.solved.result.advice
        corners = ghost.reshape(-1, 3)
        # its dark squares are on a plane through the middle that was advised, and about it
        off = (corners - advice.centre) @ advice.rotation
        assert np.abs(off[:, 2]).max() < 1e-12
        middle = 0.5 * (off.min(axis=0) + off.max(axis=0))
        assert np.abs(middle).max() < 1e-9 and np.ptp(off[:, 0]) == pytest.approx(14 * 0.025)
        work.target_um = 1e6
        work.solved_changed.emit()
        assert len(solved.session.ghost) == 0

    def test_a_virtual_board_is_held_where_it_is_advised_and_depth_is_known_better(
        self, qtbot: QtBot, solved: Desk, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(material, "LASER_STEP", 64)  # as the other views have it
        work = solved.work
        assert work.solved is not None
        before = work.solved.result
        advice = before.advice
        assert advice is not None
        solved.boards.tabs.setCurrentIndex(NEXT)
        qtbot.mouseClick(solved.boards.follow, Qt.MouseButton.LeftButton)
        settled(qtbot, solved)
        now = work.solved.result
        assert solved.panel.views.rowCount() == VIEWS + 1 and now.adjusted.seen.count == VIEWS + 1
        assert now.estimate.rotation[-1] == pytest.approx(advice.rotation, abs=2e-3)
        # the other views' noise, which 8 views let into the estimate, is in neither alike
        assert (before.depth[0].rms - now.depth[0].rms) / advice.gain == pytest.approx(1.0, abs=0.1)

    def test_a_lens_that_changes_with_the_advised_view_is_told(self, solved: Desk) -> None:
        """73 um were to become 63 and stayed 73: the lens had four terms more, and nothing said so."""
        work = solved.work
        assert work.solved is not None
        work._advised_terms = 4
        work._take_solved(work.solved)
        assert "The lens has 0 distortion terms now, and had 4" in solved.found.text.toPlainText()
        work._take_solved(work.solved)
        assert "The lens has" not in solved.found.text.toPlainText()

    def test_what_only_the_window_holds_is_asked_about_before_it_closes(
        self, solved: Desk, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """One of virtual boards, finished and not used yet, went with Ctrl+Q."""
        work = solved.work
        told: list[str] = []

        def asked(parent: object, name: str, question: str, what: str, save: str) -> str:
            told.append(what)
            return "cancel"

        monkeypatch.setattr("studio.qt.calibrate.keeping.ask_to_keep", asked)
        assert not may_go(work, solved.panel, quits=True) and "from virtual boards is neither saved" in told[-1]
        assert not may_go(work, solved.panel, quits=False), "boards are of the project that is closed"
        work.virtual = False  # as if they were of photographs
        assert not may_go(work, solved.panel, quits=True) and "calibrated from photographs" in told[-1]
        assert may_go(work, solved.panel, quits=False), "photographs stay when another project is opened"
        work.virtual = True
        save(work, tmp_path / "camera.yaml", "opencv")
        assert not may_go(work, solved.panel, quits=True), "a camera's file has no laser"
        save(work, tmp_path / "calibration.json")
        assert may_go(work, solved.panel, quits=True)

    def test_a_calibration_is_saved_thrown_away_or_stayed_with_as_the_window_closes(
        self, solved: Desk, qtbot: QtBot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        answer(qtbot, "unsaved-calibration", "Cancel")
        assert not may_go(solved.work, solved.panel, quits=True)
        answer(qtbot, "unsaved-calibration", "Discard")
        assert may_go(solved.work, solved.panel, quits=True)
        choose_file(monkeypatch, "")
        answer(qtbot, "unsaved-calibration", "Save…")
        assert not may_go(solved.work, solved.panel, quits=True), "nobody said where"
        choose_file(monkeypatch, tmp_path / "mine.json")
        answer(qtbot, "unsaved-calibration", "Save…")
        assert may_go(solved.work, solved.panel, quits=True) and (tmp_path / "mine.json").exists()

    def test_tabs_without_room_scroll_and_keep_their_words(self, solved: Desk) -> None:
        tabs = solved.boards.tabs
        tabs.resize(150, tabs.height())
        for i, (title, _) in enumerate(TABS):
            assert tabs.tabText(i) == title
            assert tabs.tabRect(i).width() >= tabs.fontMetrics().horizontalAdvance(title)

    def test_the_narrowest_panel_shows_between_which_boards_depth_is_told(self, qtbot: QtBot, solved: Desk) -> None:
        panel = solved.panel
        panel.resize(NARROWEST, 700)
        panel.show()
        qtbot.waitUntil(panel.isVisible)
        for side in (panel.nearest, panel.farthest):
            room = side.lineEdit().contentsRect().width()
            assert room >= side.fontMetrics().horizontalAdvance(side.text())

    def test_a_virtual_line_has_the_name_that_the_scene_gives_its_laser(self, solved: Desk) -> None:
        told = solved.found.text.toPlainText()
        assert f"{LINE}, 0." in told and f"{LINE}: normal" in told
        assert "laser 0," not in told and "laser 0:" not in told
        solved.boards.tabs.setCurrentIndex(DEPTH)
        assert solved.boards.caption.text().startswith("Blue line: depth errs")

    def test_what_is_not_asked_for_reads_as_a_sentence(self, solved: Desk) -> None:
        panel = solved.panel
        assert (panel.nearest.text(), panel.farthest.text()) == ("nearest board", "farthest board")
        assert panel.target.text() == "as little as possible"

    def test_depth_is_told_over_the_range_that_is_asked_for(self, qtbot: QtBot, solved: Desk) -> None:
        solved.panel.nearest.setValue(600)
        solved.panel.farthest.setValue(1400)
        settled(qtbot, solved)
        assert solved.work.solved is not None
        depth = solved.work.solved.result.depth[0].volume.depth
        assert (depth.min(), depth.max()) == pytest.approx((0.6, 1.4))
        solved.panel.farthest.setValue(500)
        settled(qtbot, solved)
        assert "farthest distance is not beyond the nearest" in solved.panel.problem.text()
        assert "--" not in solved.panel.problem.text()

    def test_how_a_board_is_written_is_told_within_the_narrowest_panel(self, solved: Desk) -> None:
        """There stood "…MARKER[:DICTIONARY" and the rest was cut off."""
        panel = solved.panel
        solved.work.tell(FORM)
        assert "MARKER" in panel.problem.text()
        assert panel.problem.minimumSizeHint().width() <= NARROWEST - 20

    def test_coverage_counts_the_parts_of_the_image_that_have_corners(self, solved: Desk) -> None:
        solved.boards.tabs.setCurrentIndex(COVERAGE)
        pixel = np.concatenate([view.pixel for view in seen().views])
        parts = len({(int(10 * u / SIZE[0]), int(10 * v / SIZE[1])) for u, v in pixel})
        assert f"in {parts} of 100 parts" in solved.boards.caption.text()

    def test_the_map_is_between_the_depth_errors_that_are_told(self, solved: Desk) -> None:
        solved.boards.tabs.setCurrentIndex(DEPTH)
        assert solved.work.solved is not None
        one = solved.work.solved.result.depth[0]
        image = solved.boards.plot.picture.image
        assert solved.boards.stack.currentIndex() == 1
        assert np.nanmin(image) >= 1e6 * one.systematic.min() and np.nanmax(image) <= 1e6 * one.systematic.max()
        assert np.mean(np.isfinite(image)) > 0.5
        solved.boards.tabs.setCurrentIndex(RESIDUALS)
        assert solved.boards.stack.currentIndex() == 0

    def test_the_result_is_told_as_the_command_line_tells_it(self, solved: Desk) -> None:
        from studio.calibration.words import check_rows, parameter_rows

        assert solved.work.solved is not None
        text, result = solved.found.text.toPlainText(), solved.work.solved.result
        for _, sentence in check_rows(result, VIEWS):
            assert sentence.replace(" um", " µm") in text
        for row in parameter_rows(result, (LINE,)):
            assert all(part.replace(" um", " µm") in text for part in row)


class TestKeeping:
    def test_points_of_the_project_are_made_with_it_and_undo_takes_it_back(
        self, solved: Desk, qtbot: QtBot, tmp_path: Path
    ) -> None:
        work, document = solved.work, solved.session.document
        assert work.solved is not None
        fx = float(work.solved.result.estimate.intrinsics[0])
        qtbot.mouseClick(solved.panel.use, Qt.MouseButton.LeftButton)
        kept = document.project.calibration
        assert kept.camera is not None and kept.camera.fx == fx and kept.covariance(0) is not None
        assert document.undo_label == "use the calibration"
        assert solved.panel.project.text() == "The project has a calibration"
        document.undo()
        assert document.project.calibration.camera is None
        assert solved.panel.project.text() == "The project has no calibration"
        save(work, tmp_path / "calibration.json")
        use_file(work, tmp_path / "calibration.json")
        assert document.project.calibration == kept

    def test_lasers_alone_hold_the_camera_of_a_file(self, qtbot: QtBot, solved: Desk, tmp_path: Path) -> None:
        work, file = solved.work, tmp_path / "camera.json"
        save(work, file)
        assert work.solved is not None
        before, sigma = work.solved.result, work.solved.result.adjusted.solution.covariance[0, 0] ** 0.5
        work.choose_what("laser", file)
        settled(qtbot, solved)
        now = work.solved.result
        assert solved.panel.what.currentText() == "Lasers, camera.json" and not solved.panel.lens.isEnabled()
        # the same views beside the camera that they gave: it stays, and is known by half of its variance
        assert now.estimate.intrinsics[0] == pytest.approx(before.estimate.intrinsics[0], abs=0.5 * sigma)
        assert now.adjusted.solution.covariance[0, 0] ** 0.5 == pytest.approx(sigma / np.sqrt(2.0), rel=0.05)
        work.choose_what("laser", None)
        assert "need a camera" in solved.panel.problem.text()
        work.choose_what("camera")
        settled(qtbot, solved)
        assert work.solved is not None and len(work.solved.result.estimate.planes) == 0
        solved.boards.tabs.setCurrentIndex(NEXT)
        assert "where a laser is calibrated" in solved.boards.caption.text()

    def test_a_project_of_another_camera_does_not_take_it(self, solved: Desk) -> None:
        project = solved.session.project
        camera = project.scene.camera.model_copy(update={"width": 640})
        solved.session.set(("scene", "rig", "camera"), camera)
        use(solved.work)
        assert "2448 x 2048" in solved.panel.problem.text() and solved.session.project.calibration.camera is None
        assert solved.work.kept is None

    def test_the_camera_is_written_for_others_as_the_dialog_says(
        self, solved: Desk, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        for kind, name in ((kind, f"camera {number}") for number, kind in enumerate(FORMS)):
            monkeypatch.setattr(QFileDialog, "getSaveFileName", lambda *_, n=name, k=kind: (str(tmp_path / n), k))
            solved.panel.ask_and_save()
        assert solved.work.problem == ""
        files = sorted(tmp_path.iterdir())
        assert [file.suffix for file in files] == [".json", ".yaml", ".yaml", ".yaml", ".cameramodel"]
        assert solved.work.solved is not None
        fx = float(solved.work.solved.result.estimate.intrinsics[0])
        assert [read_camera(file).fx for file in files[1:]] == 4 * [pytest.approx(fx, rel=1e-12)]

    def test_no_other_file_is_written_over(self, solved: Desk, tmp_path: Path) -> None:
        other = tmp_path / "notes.json"
        other.write_text("{}")
        save(solved.work, other)
        assert "another file is in the way" in solved.panel.problem.text() and other.read_text() == "{}"
