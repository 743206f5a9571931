"""Projects and bad input in the whole window."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import trimesh
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtGui import QDragEnterEvent, QDropEvent
from PySide6.QtWidgets import QApplication, QMessageBox
from pytestqt.qtbot import QtBot

from studio.project.autosave import Autosave
from studio.project.document import Document
from studio.project.project import Project
from studio.project.project_files import missing_files
from studio.qt.core.jobs import RENDER
from studio.qt.core.render import Render
from studio.qt.shell.window import MainWindow
from tests.studio.qt.shell.window_hands import (
    answer,
    choose_file,
    dialog,
    drop,
    files,
    project_with_missing_mesh,
    until_cancelled,
)
from tests.studio.qt.small_session import small_render
from tests.studio.scan_of_steps import SCALE, small_scan

POWER = ("scene", "rig", "lasers", 0, "power")


class TestFiles:
    def test_save_as_takes_the_files_along(
        self, window: MainWindow, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
    ) -> None:
        from studio.qt.shell.file_actions import template

        window.files.replace(template("weld_seam", window.files.autosave))
        choose_file(monkeypatch, tmp_path / "elsewhere" / "mine")
        assert window.files.save()
        assert (tmp_path / "elsewhere" / "mine.json").is_file()
        assert (tmp_path / "elsewhere" / "textures" / "weld_tee_albedo.png").is_file()
        assert not window.session.document.dirty
        assert window.preferences.values.recent[0] == str(tmp_path / "elsewhere" / "mine.json")

    def test_a_project_is_called_after_its_file_unless_it_was_given_a_name(
        self, window: MainWindow, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
    ) -> None:
        from studio.qt.shell.file_actions import template

        window.files.replace(template("weld_seam", window.files.autosave))
        for file, name in (("bracket", "bracket"), ("bracket of May", "bracket of May")):
            choose_file(monkeypatch, tmp_path / f"{file}.json")
            assert window.files.save_as()
            assert window.session.project.name == name == Project.load(tmp_path / f"{file}.json").name
            assert not window.session.document.dirty
        window.session.set(("name",), "Bracket 12")
        choose_file(monkeypatch, tmp_path / "third.json")
        assert window.files.save_as()
        assert window.session.project.name == "Bracket 12"

    def test_undo_leaves_a_project_the_name_of_its_file(
        self, window: MainWindow, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
    ) -> None:
        from studio.qt.shell.file_actions import template

        window.files.replace(template("plane", window.files.autosave))
        before = window.session.project
        window.session.set(POWER, 0.004)
        choose_file(monkeypatch, tmp_path / "part7.json")
        assert window.files.save_as()
        window.session.document.undo()
        assert window.session.project == before.model_copy(update={"name": "part7"})
        window.session.document.redo()
        assert window.session.project.name == "part7" and not window.session.document.dirty

    def test_a_new_project_does_not_touch_the_one_it_comes_from(self, window: MainWindow) -> None:
        from studio.project.templates import template_folder
        from studio.qt.shell.file_actions import template

        document = template("weld_seam", window.files.autosave)
        assert document.root != template_folder("weld_seam")
        assert (document.root / "textures" / "weld_tee_albedo.png").is_file()

    def test_unsaved_changes_are_asked_about(self, window: MainWindow, qtbot: QtBot, small_project: Path) -> None:
        window.session.set(POWER, 0.005)
        assert window.isWindowModified()
        answer(qtbot, "unsaved", "Cancel")
        assert not window.close() and window.isVisible()
        answer(qtbot, "unsaved", "Save")
        assert window.files.may_close()
        assert Project.load(small_project).scene.lasers[0].power == 0.005

    def test_a_file_that_another_window_has_written_is_not_saved_over_unasked(
        self, window: MainWindow, qtbot: QtBot, small_project: Path
    ) -> None:
        window.files.open(small_project)
        other = Document(Project.load(small_project), small_project)
        other.set(("seed",), 7)
        other.save()
        window.session.set(("name",), "mine")
        answer(qtbot, "changed-on-disk", "Cancel")
        assert not window.files.save() and Project.load(small_project).seed == 7 and window.session.document.dirty
        answer(qtbot, "changed-on-disk", "Save over it")
        assert window.files.save() and Project.load(small_project).name == "mine"
        assert window.files.save(), "nothing is asked of what was written here"

    def test_opening_the_project_that_is_saved_on_the_way_reads_it_as_saved(
        self, window: MainWindow, qtbot: QtBot, small_project: Path
    ) -> None:
        """It had been read before the question, so that what was saved was gone from the window, and then from disk."""
        window.files.open(small_project)
        window.session.set(POWER, 0.011)
        answer(qtbot, "unsaved", "Save")
        assert window.files.open(small_project)
        assert window.session.project.scene.lasers[0].power == 0.011
        assert window.files.save(), "nothing is asked, as nobody else has written it"

    def test_a_scan_is_not_called_after_a_project_that_is_saved_as_another_on_the_way(
        self, window: MainWindow, qtbot: QtBot, tmp_path: Path
    ) -> None:
        file, folder = small_scan(tmp_path)
        window.files.open(file)
        window.session.set(POWER, 0.011)
        answer(qtbot, "unsaved", "Save")
        assert window.files.open_results(folder)
        assert Project.load(file).scene.lasers[0].power == 0.011
        assert window.session.project.scene.lasers[0].power != 0.011
        assert window.session.document.path is None, "saving the scan's project asks for a place"

    def test_an_untouched_project_closes_without_a_question(self, own_window: MainWindow) -> None:
        assert own_window.close()

    def test_a_render_that_was_asked_for_is_asked_about(
        self, window: MainWindow, qtbot: QtBot, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """In one question, with the changes where there are any; the program's own first picture is nobody's loss."""
        panel, (world, frame) = window.panels["render"], small_render()
        kept = [Render(k, window.session.project, world, frame, kept=k == 1, asked=k != 2) for k in (1, 2, 3, 4)]
        monkeypatch.setattr(window.session, "renders", kept)
        assert window.files.may_close(), "renders of moments are not asked about"
        long = [replace(one, frame=replace(frame, seconds={"laser light": 36.0})) for one in kept]
        monkeypatch.setattr(window.session, "renders", long)
        said: list[str] = []
        monkeypatch.setattr("studio.qt.shell.file_actions.ask_loss", lambda parent, text: said.append(text) or False)
        assert not window.files.may_close(), "those that took longer are"
        assert "2 renders of this session, 1 min of work, are kept nowhere" in said[0]
        monkeypatch.setattr(window.session, "renders", kept)
        window.runner.run(RENDER, "render", until_cancelled)
        monkeypatch.setattr(panel, "asked", False)
        assert window.files.may_close()
        monkeypatch.setattr(panel, "asked", True)
        answer(qtbot, "under-way", "Stay")
        assert not window.close() and window.isVisible()
        answer(qtbot, "under-way", "Stop it")
        assert window.files.may_close()
        window.session.set(POWER, 0.005)
        told: list[str] = []
        monkeypatch.setattr(QMessageBox, "setInformativeText", lambda box, text: told.append(text))
        answer(qtbot, "unsaved", "Cancel")
        assert not window.close()
        assert "A render is under way" in told[0] and "2 renders of this session go" in told[0]

    def test_the_question_is_right_of_one_render_and_of_three(
        self, window: MainWindow, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """Of three it asked "Close without it?"."""
        world, frame = small_render()
        long = replace(frame, seconds={"laser light": 72.0})
        asked: list[tuple[str, str]] = []
        monkeypatch.setattr(QMessageBox, "exec", lambda box: asked.append((box.text(), box.informativeText())))
        for count in (1, 3):
            made = [Render(k, window.session.project, world, long, asked=True) for k in range(count)]
            monkeypatch.setattr(window.session, "renders", made)
            assert not window.files.may_close()
        assert [question for question, _ in asked] == 2 * ["Go on all the same?"]
        assert "3 renders of this session" in asked[1][1]

    def test_a_project_dropped_on_the_window_is_opened(
        self, window: MainWindow, qtbot: QtBot, small_project: Path
    ) -> None:
        other = small_project.with_name("other.json")
        window.session.project.model_copy(update={"name": "Other"}).save(other)
        drop(window, other)
        qtbot.waitUntil(lambda: window.session.project.name == "Other")
        assert "Other" in window.windowTitle()

    def test_files_are_copied_from_and_never_moved(self, window: MainWindow, small_project: Path) -> None:
        data = files(small_project)
        buttons, shift = Qt.MouseButton.LeftButton, Qt.KeyboardModifier.ShiftModifier
        either = Qt.DropAction.CopyAction | Qt.DropAction.MoveAction
        for actions, taken in ((Qt.DropAction.MoveAction, False), (either, True)):
            entered = QDragEnterEvent(QPoint(9, 9), actions, data, buttons, shift)
            entered.setDropAction(Qt.DropAction.MoveAction)
            entered.ignore()
            window.dragEnterEvent(entered)
            assert entered.isAccepted() == taken
        assert entered.dropAction() == Qt.DropAction.CopyAction
        dropped = QDropEvent(QPointF(9, 9), either, data, buttons, shift)
        dropped.setDropAction(Qt.DropAction.MoveAction)
        window.dropEvent(dropped)
        assert dropped.isAccepted() and dropped.dropAction() == Qt.DropAction.CopyAction

    def test_recent_projects_are_in_the_menu(self, window: MainWindow, small_project: Path) -> None:
        assert window.files.open(small_project)
        menu = window.commands.submenus["recent"]
        menu.aboutToShow.emit()
        assert any(small_project.name in action.text() for action in menu.actions())

    @staticmethod
    def left_by_a_crash(window: MainWindow, path: Path | None) -> Autosave:
        """Unsaved changes of the open project, as a program that was killed leaves them."""
        crashed = Autosave(window.files.autosave.folder)
        document = Document(window.session.project, path, window.session.document.root)
        document.set(POWER, 0.007)
        crashed.keep(document)
        assert crashed._lock is not None
        crashed._lock.close()
        return crashed

    def test_work_of_a_crashed_program_is_offered(self, window: MainWindow, qtbot: QtBot) -> None:
        crashed = self.left_by_a_crash(window, None)
        answer(qtbot, "recovery", "Open it")
        assert window.files.recover()
        assert window.session.project.scene.lasers[0].power == 0.007
        assert window.files.unsaved
        assert not crashed.file.exists() and window.files.autosave.file.exists()

    @pytest.mark.parametrize("saved", [False, True])
    def test_recovered_work_counts_as_changed(self, window: MainWindow, qtbot: QtBot, saved: bool) -> None:
        self.left_by_a_crash(window, window.session.document.path if saved else None)
        answer(qtbot, "recovery", "Open it")
        assert window.files.recover()
        assert window.isWindowModified()

    def test_work_of_a_crashed_program_is_offered_when_its_project_is_opened(
        self, window: MainWindow, qtbot: QtBot, small_project: Path
    ) -> None:
        crashed = self.left_by_a_crash(window, small_project)
        answer(qtbot, "recovery", "Open it")
        assert window.files.open(small_project)
        assert window.session.project.scene.lasers[0].power == 0.007
        assert window.session.document.path == small_project and window.isWindowModified()
        assert not crashed.file.exists() and window.files.autosave.file.exists()

    def test_work_of_a_crashed_program_is_offered_when_results_of_its_project_are_opened(
        self, window: MainWindow, qtbot: QtBot, tmp_path: Path
    ) -> None:
        file, folder = small_scan(tmp_path)
        crashed = self.left_by_a_crash(window, file)
        answer(qtbot, "recovery", "Open it")
        assert window.files.open_results(folder)
        assert window.session.project.scene.lasers[0].power == 0.007
        assert window.session.document.path == file and window.isWindowModified()
        assert not crashed.file.exists()
        qtbot.waitUntil(lambda: window.session.shown is not None)
        assert window.session.shown is not None
        assert window.session.shown.image_scale == SCALE, "its figures are those of the project that was scanned"

    def test_work_that_is_not_wanted_leaves_the_project_as_it_was_saved(
        self, window: MainWindow, qtbot: QtBot, small_project: Path
    ) -> None:
        crashed = self.left_by_a_crash(window, small_project)
        answer(qtbot, "recovery", "Throw it away")
        assert window.files.open(small_project)
        assert window.session.project == Project.load(small_project) and not window.isWindowModified()
        assert not crashed.file.exists()

    def test_work_may_wait_and_is_offered_again(self, window: MainWindow, qtbot: QtBot, small_project: Path) -> None:
        """Who only wanted to look at something else had to open it, or to throw it away."""
        crashed = self.left_by_a_crash(window, small_project)
        answer(qtbot, "recovery", "Later")
        assert window.files.open(small_project)
        assert window.session.project == Project.load(small_project) and not window.isWindowModified()
        assert crashed.file.exists()
        answer(qtbot, "recovery", "Open it")
        assert window.files.open(small_project)
        assert window.session.project.scene.lasers[0].power == 0.007 and not crashed.file.exists()

    def test_work_of_another_project_waits_untouched(self, window: MainWindow, small_project: Path) -> None:
        crashed = self.left_by_a_crash(window, small_project.with_name("other.json"))
        assert window.files.open(small_project)
        assert crashed.file.exists()


class TestBadInput:
    """Each ends in a dialog that names cause and cure; what was open stays as it was."""

    @pytest.fixture(autouse=True)
    def unharmed(self, window: MainWindow) -> Any:
        before = window.session.project
        yield
        assert window.session.project == before

    def told(self, *words: str) -> None:
        box = dialog("trouble")
        text = f"{box.text()}\n{box.informativeText()}"
        for word in words:
            assert word in text, text
        box.close()

    def test_a_newer_file(self, window: MainWindow, tmp_path: Path, small_project: Path) -> None:
        data = json.loads(small_project.read_text()) | {"schema_version": 99}
        newer = tmp_path / "newer.json"
        newer.write_text(json.dumps(data))
        assert not window.files.open(newer)
        self.told("Could not open newer.json", "99", "newer")

    def test_a_file_that_is_not_there(self, window: MainWindow, tmp_path: Path) -> None:
        assert not window.files.open(tmp_path / "nothing.json")
        self.told("Could not open nothing.json", "nothing.json")

    def test_absurd_numbers(self, window: MainWindow, tmp_path: Path, small_project: Path) -> None:
        data = json.loads(small_project.read_text())
        data["scene"]["rig"]["lasers"][0]["power"] = 1e300
        data["scene"]["rig"]["camera"]["width"] = -4
        absurd = tmp_path / "absurd.json"
        absurd.write_text(json.dumps(data))
        assert not window.files.open(absurd)
        self.told("power", "width")

    @pytest.mark.skipif(sys.platform == "win32", reason="folders have other permissions there")
    def test_a_folder_that_may_not_be_written(
        self, window: MainWindow, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
    ) -> None:
        (tmp_path / "file").write_text("a file where a folder should be")
        choose_file(monkeypatch, tmp_path / "file" / "mine.json")
        assert not window.files.save_as()
        self.told("Could not save mine.json", "cannot be written", "Choose a folder")

    def test_missing_meshes_can_be_hidden(self, window: MainWindow, qtbot: QtBot, tmp_path: Path) -> None:
        broken = project_with_missing_mesh(window.session.project, tmp_path)
        before = window.session.document
        answer(qtbot, "missing", "Cancel")
        assert not window.files.open(broken)
        assert window.session.document is before
        answer(qtbot, "missing", "Open with them hidden")
        assert window.files.open(broken)
        assert not window.session.project.scene.objects[-1].visible
        assert Project.load(broken).scene.objects[-1].visible, "the file stays as it is until it is saved"
        window.session.replace_document(before)

    def test_missing_meshes_are_located_and_copied_to_their_place(
        self, window: MainWindow, qtbot: QtBot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        broken = project_with_missing_mesh(window.session.project, tmp_path)
        before = window.session.document
        ((_, gone),) = missing_files(Project.load(broken).scene, broken.parent)
        elsewhere = tmp_path / "elsewhere" / f"another{gone.suffix}"
        elsewhere.parent.mkdir()
        trimesh.creation.box((0.1, 0.1, 0.1)).export(elsewhere)
        choose_file(monkeypatch, elsewhere)
        answer(qtbot, "missing", "Locate…")
        assert window.files.open(broken)
        assert window.session.project.scene.objects[-1].visible
        assert gone.read_bytes() == elsewhere.read_bytes()
        window.session.replace_document(before)

    def test_nobody_is_asked_about_unsaved_work_for_a_file_that_cannot_be_opened(
        self, window: MainWindow, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(window.files, "may_close", lambda: pytest.fail("asked"))
        assert not window.files.open(tmp_path / "nothing.json")
        self.told("Could not open nothing.json")

    def test_a_mesh_that_is_none(self, window: MainWindow, qtbot: QtBot, small_project: Path) -> None:
        file = small_project.parent / "broken.stl"
        file.write_bytes(b"solid nothing\nfacet")
        window.take([file])
        qtbot.waitUntil(lambda: any(each.objectName() == "trouble" for each in QApplication.topLevelWidgets()))
        self.told("Could not import broken.stl", "broken.stl")

    def test_a_render_that_runs_out_of_memory(self, window: MainWindow, qtbot: QtBot) -> None:
        def work(progress: object, cancelled: object) -> None:
            raise MemoryError

        with qtbot.waitSignal(window.runner.failed):
            window.runner.run("render", "render", work)
        self.told("Could not finish: render", "not enough memory", "smaller image scale")

    def test_a_fault_of_the_program(self, window: MainWindow, qtbot: QtBot, monkeypatch: pytest.MonkeyPatch) -> None:
        from studio.qt.shell.uncaught_errors import Faults

        uncaught_errors = Faults(window, window.session)
        uncaught_errors.tell(ZeroDivisionError("division by zero"))
        uncaught_errors.tell(ZeroDivisionError("again"))  # one dialog at a time
        self.told("ZeroDivisionError", "unharmed", "report")
        log = window.panels["log"].as_text()  # type: ignore[attr-defined]
        assert "division by zero" in log and "again" in log
