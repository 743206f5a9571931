"""What closing the window would end is asked about."""

from __future__ import annotations

import pytest
from PySide6.QtWidgets import QMessageBox
from pytestqt.qtbot import QtBot

from studio.qt.results.export_actions import LANE as EXPORT
from studio.qt.shell.file_actions import template
from studio.qt.shell.window import MainWindow
from tests.studio.qt.shell.window_hands import answer, until_cancelled


def test_an_export_that_is_being_written_is_asked_about_before_the_window_goes(
    window: MainWindow, qtbot: QtBot, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ctrl+Q ended it without a word, and there was no file."""
    window.runner.run(EXPORT, "export rep.pdf", until_cancelled)
    assert window.files.may_close(), "another project does not end it"
    told: list[str] = []
    monkeypatch.setattr(QMessageBox, "setInformativeText", lambda box, text: told.append(text))
    answer(qtbot, "under-way", "Stay")
    assert not window.close() and window.isVisible()
    assert told == ["rep.pdf is still being written."]
    window.runner.cancel(EXPORT)
    qtbot.waitUntil(lambda: not window.runner.busy)


def test_a_changed_study_of_a_project_without_a_file_is_asked_about_before_the_window_goes(
    window: MainWindow, qtbot: QtBot
) -> None:
    window.files.replace(template("plane", window.files.autosave))
    work = window.panels["study"].work  # type: ignore[attr-defined]
    work.load("quick")
    assert window.files.may_close(quits=True), "a ready-made one is not lost"
    work.change(lambda draft: draft.update(repeats=7))
    answer(qtbot, "unsaved-study", "Cancel")
    assert not window.close() and window.isVisible()
    work.load("quick")
