"""The list of renders has those that the project keeps, which open with their light and are removed when asked for."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QListWidgetItem, QStyleOptionViewItem
from pytestqt.qtbot import QtBot

from render.output import frame_files
from studio.project.document import Document
from studio.project.project import Project
from studio.qt.core import save_first
from studio.qt.core.render import Render
from studio.qt.core.session import Session
from studio.qt.render import history as history_module
from studio.qt.render import render_table
from studio.qt.render.history import History
from studio.qt.render.render_table import keep_render
from studio.scan.kept_renders import Kept, at_full_scale, kept_renders
from studio.scan.redevelop import is_stale
from studio.scan.stages import scaled
from tests.studio.qt.small_session import small_project, small_render


def session_in(folder: Path) -> Session:
    folder.mkdir(exist_ok=True)
    return Session(Document(small_project().save(folder / "project.json"), folder / "project.json"))


def keep_some(folder: Path, *names: str) -> None:
    """As a session before has left them."""
    session, (world, frame) = session_in(folder), small_render()
    for number, name in enumerate(names, start=1):
        session.add_render(Render(number, session.project, world, frame, name=name))
        keep_render(session, session.renders[-1], name)


def list_of(qtbot: QtBot, session: Session) -> History:
    history = History(session)
    qtbot.addWidget(history)
    history.resize(320, 400)
    history.show()
    return history


def items(history: History) -> list[QListWidgetItem]:
    return [history.list.item(row) for row in range(history.list.count())]


def texts(history: History) -> list[str]:
    """First lines as they are painted."""
    found, delegate = [], history.list.itemDelegate()
    for row in range(history.list.count()):
        option = QStyleOptionViewItem()
        delegate.initStyleOption(option, history.list.model().index(row, 0))  # type: ignore[attr-defined]
        found.append(option.text.split("\u2028")[0])
    return found


def menu(history: History, row: int) -> list[str]:
    return [action.text() for action in history.menu_of(history.list.item(row)).actions()]


def click(qtbot: QtBot, history: History, row: int, *, twice: bool = False) -> None:
    place = history.list.visualItemRect(history.list.item(row)).center()
    qtbot.mouseClick(history.list.viewport(), Qt.MouseButton.LeftButton, pos=place)
    if twice:
        qtbot.mouseDClick(history.list.viewport(), Qt.MouseButton.LeftButton, pos=place)


def test_kept_renders_stand_in_the_list_of_a_project_that_is_opened_again(
    qtbot: QtBot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    keep_some(tmp_path, "first", "second")
    read: list[object] = []
    decode = frame_files.decode_exr
    monkeypatch.setattr(frame_files, "decode_exr", lambda *given: read.append(given) or decode(*given))
    session = session_in(tmp_path)
    history = list_of(qtbot, session)
    assert sorted(texts(history)) == ["first · kept", "second · kept"] and session.renders == []
    assert read == [], "light is read when one is chosen"
    row = texts(history).index("first · kept")
    click(qtbot, history, row, twice=True)
    assert len(read) == 1 and len(session.renders) == 1 and session.shown is session.renders[0]
    assert session.shown.name == "first"
    assert np.array_equal(session.shown.frame.laser_direct[0], small_render()[1].laser_direct[0])
    assert texts(history)[row] == "first · kept", "it stays where it was clicked"
    assert history.selected() == [session.shown]


@pytest.mark.parametrize("image_scale", [1.0, 0.3, 0.125])
def test_the_scanner_of_a_kept_render_is_the_project_s_own_whatever_its_size(image_scale: float) -> None:
    project = small_project()
    kept = Kept("before", "", scaled(project, image_scale), image_scale, {})
    assert not is_stale(at_full_scale(kept, project), project)
    wider = project.replaced({"scene.rig.camera.fx": 1.1 * project.scene.camera.fx})
    assert is_stale(at_full_scale(kept, wider), wider)
    full, camera = at_full_scale(kept, wider), project.scene.camera
    assert full.scene.camera.fx == pytest.approx(camera.fx, rel=1.0 / (image_scale * camera.width))


def test_a_kept_render_of_another_scene_is_told_to_be_one(qtbot: QtBot, tmp_path: Path) -> None:
    """After reopening it was shown beside a laser that had been moved since, without the banner of a stale render."""
    keep_some(tmp_path, "before")
    session = session_in(tmp_path)
    place = ("scene", "rig", "lasers", 0, "T_rig_laser", "translation")
    before = session.project.scene.lasers[0].T_rig_laser.translation
    session.set(place, (before[0] + 0.005, *before[1:]))
    session.document.save()

    again = Session(Document(Project.load(tmp_path / "project.json"), tmp_path / "project.json"))
    history = list_of(qtbot, again)
    click(qtbot, history, 0, twice=True)
    assert again.shown is not None and again.shown.name == "before" and again.shown.is_stale(again.project)
    again.set(place, before)
    assert not again.shown.is_stale(again.project)


def test_a_kept_render_warns_of_what_it_warned_of_before(
    qtbot: QtBot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of smooth shading that its mesh does not have, say; a report that was made of it lacked that, too."""
    keep_some(tmp_path, "only")
    monkeypatch.setattr(render_table, "scene_warnings", lambda *given: ("smooth shading",))
    session = session_in(tmp_path)
    history = list_of(qtbot, session)
    click(qtbot, history, 0, twice=True)
    assert session.shown is not None
    assert session.shown.frame.warnings == (*small_render()[1].warnings, "smooth shading")


def test_return_opens_the_one_that_is_current(qtbot: QtBot, tmp_path: Path) -> None:
    keep_some(tmp_path, "only")
    session = session_in(tmp_path)
    history = list_of(qtbot, session)
    history.list.setCurrentRow(0)
    qtbot.keyClick(history.list, Qt.Key.Key_Return)
    assert session.shown is not None and session.shown.name == "only"


def test_a_render_of_the_session_is_marked_once_it_is_kept(qtbot: QtBot, tmp_path: Path) -> None:
    session, (world, frame) = session_in(tmp_path), small_render()
    history = list_of(qtbot, session)
    session.add_render(Render(1, session.project, world, frame))
    assert texts(history) == ["Render 1"] and menu(history, 0)[-1] == "Delete"
    history.keep(session.renders[0])
    assert texts(history) == ["Render 1 · kept"] and history.list.item(0).text() == "Render 1"
    assert menu(history, 0)[-2:] == ["Close", "Remove from the project…"]
    history.forget(session.renders)
    assert session.renders == [] and texts(history) == ["Render 1 · kept"], "what is closed stays kept"
    assert menu(history, 0) == ["Open", "Rename", "Compare", "Remove from the project…"]


def test_one_that_is_kept_nowhere_says_so_and_is_kept_by_a_click(qtbot: QtBot, tmp_path: Path) -> None:
    """Two renders went when the program ended, and the only word of it was in a menu of their list."""
    session, (world, frame) = session_in(tmp_path), small_render()
    history = list_of(qtbot, session)
    history.show()
    session.add_render(Render(1, session.project, world, frame))
    assert history.keep_button.isEnabled()
    assert "it goes when the project is closed" in history.keep_button.toolTip()
    qtbot.mouseClick(history.keep_button, Qt.MouseButton.LeftButton)
    assert session.renders[0].kept is not None and not history.keep_button.isEnabled()
    session.add_render(Render(2, session.project, world, frame, asked=False))
    assert not history.keep_button.isEnabled(), "the program's own first picture is no work of a person"


def test_a_project_that_is_in_no_file_is_offered_to_be_saved_before_a_render_is_kept(
    qtbot: QtBot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It was refused, with an OK to press."""
    world, frame = small_render()
    session = Session(Document(small_project(), root=tmp_path))
    history, asked = list_of(qtbot, session), []
    session.add_render(Render(1, session.project, world, frame))
    session.save_asked.connect(lambda: session.document.save(tmp_path / "mine.json"))
    for answer in (False, True):
        monkeypatch.setattr(save_first, "ask_to_save_first", lambda *told, answer=answer: asked.append(told) or answer)
        history.keep(session.renders[0])
        assert (session.renders[0].kept is not None) == answer
    assert len(asked) == 2 and session.document.path == tmp_path / "mine.json"


def test_a_kept_render_goes_from_the_disk_only_when_it_is_confirmed(
    qtbot: QtBot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    keep_some(tmp_path, "one", "two")
    (tmp_path / "renders" / "one" / "notes.txt").write_text("a person's own")
    session = session_in(tmp_path)
    history = list_of(qtbot, session)
    asked: list[str] = []
    answers = [False, True]
    monkeypatch.setattr(history_module, "ask_removal", lambda parent, what: asked.append(what) or answers.pop(0))
    history.list.selectAll()
    history.delete_button.click()
    assert len(kept_renders(tmp_path)[0]) == 2 and history.list.count() == 2
    assert "one" in asked[0] and "two" in asked[0]
    click(qtbot, history, 0)
    history.list.selectAll()
    history.delete_button.click()
    assert kept_renders(tmp_path) == ([], []) and history.list.count() == 0 and session.renders == []
    assert [one.name for one in (tmp_path / "renders").glob("*/*")] == ["notes.txt"]


def test_a_name_given_to_a_kept_render_is_there_the_next_time(qtbot: QtBot, tmp_path: Path) -> None:
    keep_some(tmp_path, "before")
    session = session_in(tmp_path)
    history = list_of(qtbot, session)
    history.list.item(0).setText("after")
    assert [one.name for one in kept_renders(tmp_path)[0]] == ["after"] and texts(history) == ["after · kept"]
    history.list.item(0).setText("  ")
    assert texts(history) == ["after · kept"] and history.list.item(0).text() == "after"


def test_a_kept_render_that_is_broken_is_told_and_stops_no_other(qtbot: QtBot, tmp_path: Path) -> None:
    keep_some(tmp_path, "good", "bad")
    (tmp_path / "renders" / "bad" / "kept.json").write_text("{")
    session = session_in(tmp_path)
    history = list_of(qtbot, session)
    assert texts(history) == ["good · kept"]
    assert history.broken.isVisible() and history.broken.text() == "1 kept render cannot be read"
    assert "bad" in history.broken.toolTip()
    other = tmp_path / "other"
    keep_some(other, "worse")
    (other / "renders" / "worse" / "project.json").unlink()
    with qtbot.waitSignal(session.message) as told:
        session.replace_document(Document(session.project, other / "project.json"))
    assert told.args is not None and told.args[0] == "warning" and "worse" in told.args[1]


def test_one_whose_light_is_damaged_says_so_and_stays(
    qtbot: QtBot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    keep_some(tmp_path, "cut off")
    (tmp_path / "renders" / "cut off" / "render.exr").write_bytes(b"no picture")
    session = session_in(tmp_path)
    history = list_of(qtbot, session)
    told: list[str] = []
    monkeypatch.setattr(history_module, "show_trouble", lambda parent, what: told.append(what.title))
    click(qtbot, history, 0)
    assert len(told) == 1 and "cut off" in told[0]
    assert session.renders == [] and texts(history) == ["cut off · kept"]


def test_another_project_has_its_own_kept_renders(qtbot: QtBot, tmp_path: Path) -> None:
    keep_some(tmp_path / "a", "of a")
    keep_some(tmp_path / "b", "of b")
    session = session_in(tmp_path / "a")
    history = list_of(qtbot, session)
    assert texts(history) == ["of a · kept"]
    session.replace_document(Document(small_project(), tmp_path / "b" / "project.json"))
    assert texts(history) == ["of b · kept"]
    session.replace_document(Document(small_project()))
    assert texts(history) == [], "a new one has no folder"


def test_a_project_that_is_saved_elsewhere_marks_nothing_of_the_folder_before(qtbot: QtBot, tmp_path: Path) -> None:
    keep_some(tmp_path / "a", "of a")
    session = session_in(tmp_path / "a")
    history = list_of(qtbot, session)
    click(qtbot, history, 0)
    (tmp_path / "b").mkdir()
    session.document.save(tmp_path / "b" / "project.json")
    assert texts(history) == ["of a"]


def test_two_that_are_kept_are_compared(qtbot: QtBot, tmp_path: Path) -> None:
    keep_some(tmp_path, "one", "two")
    session = session_in(tmp_path)
    history = list_of(qtbot, session)
    history.list.selectAll()
    history.compare_button.click()
    assert history.comparison is not None and {one.name for one in session.renders} == {"one", "two"}
    qtbot.waitUntil(lambda: history.comparison is not None and not history.comparison.runner.busy)
    history.comparison.forget()


def test_files_that_went_behind_the_programs_back_are_told_when_it_is_opened(
    qtbot: QtBot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    keep_some(tmp_path, "gone")
    session = session_in(tmp_path)
    history = list_of(qtbot, session)
    shutil.rmtree(tmp_path / "renders")
    told: list[str] = []
    monkeypatch.setattr(history_module, "show_trouble", lambda parent, what: told.append(what.title))
    click(qtbot, history, 0)
    assert len(told) == 1
    assert isinstance(history.selected()[0], Kept)
