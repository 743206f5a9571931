"""What a study keeps with its project and its folder, and what of either lets it go on or not."""

from __future__ import annotations

from pathlib import Path

from pytestqt.qtbot import QtBot

from studio.project.document import Document
from studio.project.project import Project
from studio.project.templates import template_folder
from studio.qt.core.live_preview import live
from studio.qt.core.session import Session, one_of
from studio.qt.study.study_work import StudyWork
from tests.studio.qt.study.desk import NOISE, POWER, Desk, run


def test_a_study_that_was_not_run_is_there_when_the_project_is_opened_again(desk: Desk, tmp_path: Path) -> None:
    desk.small([1.0, 2.0])
    left = desk.work.draft
    desk.session.replace_document(Document(Project.load(template_folder("sphere"))))
    assert not desk.work.sweep["vary"]
    file = tmp_path / "plane.json"
    desk.session.replace_document(Document(Project.load(file), file))
    assert desk.work.draft == left
    again = Session(Document(Project.load(file), file))
    work = one_of(StudyWork, again)
    assert work.draft == left
    work.close()
    live(again).close()


def test_a_window_that_changed_nothing_takes_no_study_away(desk: Desk, tmp_path: Path) -> None:
    """Of two windows on one project the one in which nothing was put together may be closed last."""
    file = tmp_path / "plane.json"
    other = Session(Document(Project.load(file), file))
    idle = one_of(StudyWork, other)
    desk.small([1.0, 2.0])
    idle.close()
    live(other).close()
    again = Session(Document(Project.load(file), file))
    work = one_of(StudyWork, again)
    assert work.draft == desk.work.draft
    work.close()
    live(again).close()


def test_a_project_that_has_changed_since_is_told_in_place_of_going_on(
    desk: Desk, qtbot: QtBot, tmp_path: Path
) -> None:
    desk.small([2.0, 20.0])
    desk.work.choose_folder(tmp_path / "out")
    run(qtbot, desk)
    qtbot.waitUntil(lambda: desk.work.estimate is not None)
    assert desk.session.set(POWER, 0.033)
    desk.work.look_ahead()
    assert "study of another set-up" in desk.panel.problem.text() and not desk.panel.foot.run.isEnabled()
    assert "Power: 20 mW in the folder, 33 mW now" in desk.panel.problem.text()
    desk.session.document.undo()
    desk.work.look_ahead()
    assert desk.work.problem == ""
    qtbot.waitUntil(lambda: desk.work.estimate is not None)


def test_the_projects_own_value_of_a_field_that_is_varied_leaves_it_going_on(
    desk: Desk, qtbot: QtBot, tmp_path: Path
) -> None:
    """Nor do the project's method and name lock it out: no cell takes them of its base."""
    desk.small([2.0, 20.0])
    desk.work.choose_folder(tmp_path / "out")
    run(qtbot, desk)
    assert desk.session.set(NOISE, 7.0) and desk.session.set(("name",), "another name")
    assert desk.session.set(("extraction", "method"), "gaussian")
    desk.small([2.0, 20.0, 30.0])
    desk.work.look_ahead()
    assert desk.work.problem == ""
    run(qtbot, desk)
    assert desk.work.failure == "" and desk.work.found is not None and len(desk.work.found.rows) == 3


def test_a_stopped_study_is_not_said_to_go_on_where_it_does_not(desk: Desk, qtbot: QtBot, tmp_path: Path) -> None:
    told: list[str] = []
    desk.small([2.0, 20.0])
    desk.work.choose_folder(tmp_path / "out")
    run(qtbot, desk)
    desk.session.message.connect(lambda _, text: told.append(text))
    assert desk.work._how_on() == "Go on continues it"
    assert desk.session.set(POWER, 0.033)
    desk.work.look_ahead()
    assert len(told) == 1 and "does not go on as it is set up now" in told[0]
    assert desk.work._how_on() in told[0]


def test_the_folder_of_results_is_there_again_after_a_kill(desk: Desk, qtbot: QtBot, tmp_path: Path) -> None:
    """Nothing was closed: what was chosen is kept at once."""
    desk.small([2.0])
    desk.work.choose_folder(tmp_path / "out")
    run(qtbot, desk)
    file = tmp_path / "plane.json"
    again = Session(Document(Project.load(file), file))
    work = one_of(StudyWork, again)
    assert work.draft == desk.work.draft and work.folder == tmp_path / "out"
    work.look()
    qtbot.waitUntil(lambda: work.found is not None and len(work.found.rows) == 1)
    qtbot.waitUntil(lambda: work.estimate is not None and work.estimate.cells == 0)
    assert work.problem == ""
    work.close()
    live(again).close()


def test_a_project_saved_for_the_first_time_goes_on_with_the_study_that_it_had_begun(
    desk: Desk, qtbot: QtBot, tmp_path: Path
) -> None:
    """Only the name of its file is another after the next start: what is in it is as it was."""
    desk.session.replace_document(Document(desk.session.project))
    desk.small([2.0])
    desk.work.choose_folder(tmp_path / "out")
    run(qtbot, desk)
    assert desk.work.failure == "" and desk.work.found is not None and len(desk.work.found.rows) == 1
    file = tmp_path / "p1.json"
    desk.session.document.save(file)
    desk.work.close()
    again = Session(Document(Project.load(file), file))
    work = one_of(StudyWork, again)
    work.look()
    qtbot.waitUntil(lambda: work.found is not None and work.estimate is not None)
    assert work.draft["base"] == "p1.json" and work.problem == "" and work.estimate.cells == 0
    assert again.set(POWER, 0.033)
    work.look_ahead()
    assert "Power: " in work.problem and "Base project" not in work.problem
    work.close()
    live(again).close()


def test_a_study_of_other_results_that_is_edited_is_there_after_the_next_start(
    desk: Desk, qtbot: QtBot, tmp_path: Path
) -> None:
    """Looked at alone, it takes nothing of the one before away."""
    file = tmp_path / "plane.json"
    desk.small([1.0, 2.0])
    before = desk.work.draft
    desk.work.load("quick")
    desk.work.close()
    for edited in (False, True):
        if edited:
            desk.work.change(lambda draft: draft.update(image_scale=0.1))
            (tmp_path / "st3").mkdir()
            desk.work.choose_folder(tmp_path / "st3")
        again = Session(Document(Project.load(file), file))
        work = one_of(StudyWork, again)
        assert work.draft == (desk.work.draft if edited else before)
        assert work.loaded == (desk.work.loaded if edited else {})
        assert work.folder == (tmp_path / "st3" if edited else None)
        live(again).close()


def test_a_study_that_goes_on_beside_another_project_takes_nothing_of_that_one_s(
    desk: Desk, qtbot: QtBot, tmp_path: Path
) -> None:
    desk.small([2.0])
    desk.work.choose_folder(tmp_path / "out")
    run(qtbot, desk)
    other = tmp_path / "other.json"
    desk.session.project.save(other)
    desk.session.replace_document(Document(Project.load(other), other))
    desk.small([2.0, 20.0])
    again = Session(Document(Project.load(other), other))
    assert one_of(StudyWork, again).sweep["vary"] == []
    live(again).close()
