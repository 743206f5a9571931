"""A study that a person changed does not go unasked."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from PySide6.QtWidgets import QFileDialog, QMenu
from pytestqt.qtbot import QtBot

from studio.project.document import Document
from studio.project.project import Project
from studio.project.templates import template_folder
from studio.qt.study.keeping_study import may_go, save
from tests.studio.qt.shell.window_hands import answer, choose_file
from tests.studio.qt.study.desk import Desk, run


@pytest.fixture
def unnamed(desk: Desk) -> Iterator[Desk]:
    """With a project that is in no file, as a template is."""
    folder = template_folder("plane")
    desk.session.replace_document(Document(Project.load(folder / "project.json"), None, folder))
    yield desk


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The questions that were put; each is answered with Cancel."""
    questions: list[str] = []

    def ask(parent: object, name: str, question: str, what: str, save: str) -> str:
        questions.append(question)
        return "cancel"

    monkeypatch.setattr("studio.qt.study.keeping_study.ask_to_keep", ask)
    return questions


def choose(desk: Desk, *texts: str) -> None:
    """In the menu of files."""
    menu: QMenu | None = desk.panel.files.menu()
    for text in texts:
        assert menu is not None
        menu.aboutToShow.emit()
        action = next(one for one in menu.actions() if one.text() == text)
        menu = action.menu()  # type: ignore[assignment]
    action.trigger()


def may_quit(desk: Desk) -> bool:
    return may_go(desk.work, desk.panel, quits=True)


class TestTheWindowCloses:
    def test_a_ready_made_study_with_other_values_is_asked_about(self, unnamed: Desk, asked: list[str]) -> None:
        """Ctrl+Q threw it away."""
        unnamed.work.load("quick")
        assert may_quit(unnamed) and not asked, "it is as it came"
        unnamed.work.set_values(0, {**unnamed.work.sweep["vary"][0], "values": [1.0, 2.0]})
        assert not may_quit(unnamed) and asked == ["Save the changes to the study “quick”?"]

    def test_it_is_saved_thrown_away_or_stayed_with(
        self, qtbot: QtBot, unnamed: Desk, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        unnamed.work.load("quick")
        unnamed.work.change(lambda draft: draft.update(repeats=7))
        for button, goes in (("Cancel", False), ("Discard", True)):
            answer(qtbot, "unsaved-study", button)
            assert may_quit(unnamed) == goes
        for chosen, goes in (("", False), (tmp_path / "mine.json", True)):
            choose_file(monkeypatch, chosen)
            answer(qtbot, "unsaved-study", "Save…")
            assert may_quit(unnamed) == goes
        assert (tmp_path / "mine.json").exists() and may_quit(unnamed), "it is in a file, and asked about no more"

    def test_one_that_varies_nothing_is_no_loss(self, unnamed: Desk, asked: list[str]) -> None:
        unnamed.work.change(lambda draft: draft.update(repeats=9))
        assert may_quit(unnamed) and not asked

    def test_one_of_a_project_that_is_a_file_is_kept_with_it(self, desk: Desk, asked: list[str]) -> None:
        desk.small([2.0, 20.0])
        assert may_quit(desk) and not asked

    def test_one_that_is_in_a_file_of_its_own_is_asked_about(
        self, desk: Desk, asked: list[str], tmp_path: Path
    ) -> None:
        """The file said two repeats, the study three, and nothing was asked."""
        desk.small([2.0, 20.0])
        assert save(desk.work, tmp_path / "noise.json") and may_quit(desk)
        desk.work.change(lambda draft: draft.update(repeats=3))
        assert not may_quit(desk) and len(asked) == 1

    def test_one_whose_results_hold_it_as_it_is_goes_unasked(
        self, qtbot: QtBot, unnamed: Desk, tmp_path: Path, asked: list[str]
    ) -> None:
        unnamed.small([2.0])
        unnamed.work.choose_folder(tmp_path / "results")
        run(qtbot, unnamed)
        assert unnamed.work.found is not None and may_quit(unnamed) and not asked
        unnamed.small([2.0, 30.0])
        assert not may_quit(unnamed)


class TestAnotherProjectIsOpened:
    def test_a_study_that_goes_with_the_former_one_is_asked_about(self, unnamed: Desk, asked: list[str]) -> None:
        unnamed.small([2.0, 20.0])
        assert not may_go(unnamed.work, unnamed.panel, quits=False) and len(asked) == 1

    def test_one_of_base_projects_of_its_own_stays(self, unnamed: Desk, asked: list[str]) -> None:
        unnamed.work.load("quick")
        unnamed.work.change(lambda draft: draft.update(repeats=7))
        assert may_go(unnamed.work, unnamed.panel, quits=False) and not asked


class TestAnotherStudyComes:
    @pytest.mark.parametrize("way", [("New study",), ("Ready-made", "Quick"), ("Open a study's file…",)])
    def test_a_changed_one_is_asked_about_first(
        self, desk: Desk, asked: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, way: tuple[str, ...]
    ) -> None:
        """It was replaced without a word."""
        desk.small([2.0, 20.0])
        assert save(desk.work, tmp_path / "noise.json")
        choose_file(monkeypatch, tmp_path / "noise.json")
        desk.small([2.0, 30.0])
        before = desk.work.draft
        choose(desk, *way)
        assert len(asked) == 1 and desk.work.draft == before

    def test_discarded_it_gives_way(self, qtbot: QtBot, desk: Desk) -> None:
        desk.small([2.0, 20.0])
        answer(qtbot, "unsaved-study", "Discard")
        choose(desk, "New study")
        assert desk.work.sweep["vary"] == []

    def test_a_saved_or_an_untouched_one_gives_way_unasked(self, desk: Desk, asked: list[str], tmp_path: Path) -> None:
        desk.small([2.0, 20.0])
        assert save(desk.work, tmp_path / "noise.json")
        choose(desk, "Ready-made", "Quick")
        assert desk.work.draft["name"] == "quick"
        choose(desk, "New study")
        assert desk.work.sweep["vary"] == [] and not asked


class TestItsFile:
    @pytest.mark.parametrize("name", ["myquick", "myquick.v2", "myquick.json"])
    def test_it_has_the_ending_by_which_it_is_opened(
        self, desk: Desk, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
    ) -> None:
        desk.small([2.0, 20.0])
        choose_file(monkeypatch, tmp_path / name)
        choose(desk, "Save the study…")
        assert (tmp_path / f"{name.removesuffix('.json')}.json").exists()
        assert name.endswith(".json") or not (tmp_path / name).exists()

    def test_one_that_is_there_is_asked_about_by_its_whole_name(
        self, desk: Desk, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """The dialog asked about a file without the ending, which was not there."""
        desk.small([2.0, 20.0])
        (tmp_path / "mine.json").write_text("another's")
        offered: list[str] = []
        answers = iter((str(tmp_path / "mine"), ""))

        def ask(parent: object, title: str, suggestion: str, kinds: str) -> tuple[str, str]:
            offered.append(Path(suggestion).name)
            return next(answers), ""

        monkeypatch.setattr(QFileDialog, "getSaveFileName", ask)
        choose(desk, "Save the study…")
        assert offered[1] == "mine.json" and (tmp_path / "mine.json").read_text() == "another's"
