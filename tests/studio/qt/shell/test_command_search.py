"""Any command of the menus by a few letters (Ctrl+P)."""

from __future__ import annotations

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from analysis.gauges.gauge import TITLES
from studio.qt.core.render import Render
from studio.qt.forms.form import Section
from studio.qt.shell.command_search import NEAREST, WORDS, CommandSearch
from studio.qt.shell.window import MainWindow
from tests.studio.qt.small_session import small_project, small_render


def test_a_command_is_found_by_a_few_letters_and_done(window: MainWindow, qtbot: QtBot) -> None:
    session = window.session
    count = len(session.project.scene.lights)
    qtbot.keyClick(window, Qt.Key.Key_P, Qt.KeyboardModifier.ControlModifier)
    search = next(one for one in QApplication.topLevelWidgets() if isinstance(one, CommandSearch))
    names = {entry.name for entry in search.entries}
    assert {"Undo", "Report as PDF", "Turntable", "Sphere", "Messages", "Inspector"} <= names
    qtbot.keyClicks(search.line, "poi li")
    assert search.list.item(0).text() == "Scene > Add > Point light"
    qtbot.keyClick(search.line, Qt.Key.Key_Down)
    qtbot.keyClick(search.line, Qt.Key.Key_Up)
    with qtbot.waitSignal(session.project_changed):
        qtbot.keyClick(search.line, Qt.Key.Key_Return)
    assert len(session.project.scene.lights) == count + 1


def test_a_command_that_is_not_possible_now_stays_undone(window: MainWindow, qtbot: QtBot) -> None:
    before = window.session.project
    search = CommandSearch(window)
    qtbot.addWidget(search)
    search.show_found("redo")
    search.choose()
    search.show_found("no such thing")
    (only,) = [search.list.item(i) for i in range(search.list.count())]
    assert only.text().startswith("Nothing found") and not only.flags()
    search.choose()
    search.list.setCurrentRow(0)
    search.choose()
    assert search.isVisible() is False and window.session.project is before


def test_a_field_is_found_by_a_few_letters_and_has_the_focus(window: MainWindow, qtbot: QtBot) -> None:
    search = CommandSearch(window)
    assert not any(": " in search.list.item(i).text() for i in range(search.list.count()))
    search.show_found("speckle")
    texts = [search.list.item(i).text() for i in range(search.list.count())]
    row = texts.index("Sensor: Laser speckle")
    search.list.setCurrentRow(row)
    Section.folded = dict.fromkeys(("Sensor", "Noise", "Laser speckle"), True)
    window.session.select(())
    search.choose()
    form = window.panels["inspector"].form  # type: ignore[attr-defined]
    qtbot.waitUntil(lambda: window.session.selection == ("sensor",))
    field = form.rows[("sensor", "speckle")][0].editor
    qtbot.waitUntil(lambda: window.focusWidget() is field or field.isAncestorOf(window.focusWidget()))
    Section.folded = {}
    qtbot.waitUntil(field.isVisible)


def test_what_removes_the_calibration_is_found_by_that_word(window: MainWindow, qtbot: QtBot) -> None:
    search = CommandSearch(window)
    qtbot.addWidget(search)
    search.show_found("calibration")
    texts = [search.list.item(i).text() for i in range(search.list.count())]
    assert "Calibrate > Remove it from the project" in texts
    assert "Calibrate > Use it in the project" in texts


@pytest.mark.parametrize(
    ("typed", "text"),
    [("thickness", "Measures of the part > Add > Thickness"), ("video", "File > Export > Film of the scan")],
)
def test_what_is_called_otherwise_or_is_in_a_panel_is_found(
    window: MainWindow, qtbot: QtBot, typed: str, text: str
) -> None:
    """Neither word found anything."""
    search = CommandSearch(window)
    qtbot.addWidget(search)
    search.show_found(typed)
    assert text in [search.list.item(i).text() for i in range(search.list.count())]


@pytest.mark.parametrize("typed", ["choose", "accuracy", "speed", "lens"])
def test_where_a_scanner_is_designed_is_found_by_what_is_chosen_there(
    window: MainWindow, qtbot: QtBot, typed: str
) -> None:
    """Only fields were found, of those that have the word in their name."""
    search = CommandSearch(window)
    qtbot.addWidget(search)
    search.show_found(typed)
    shown = [search.list.item(i).text() for i in range(search.list.count())]
    for text in ("View > Set up   F6", "View > Panels > Design"):
        assert text in shown[:12]


@pytest.mark.parametrize(
    ("typed", "text"),
    [("training", "View > Dataset"), ("checkerboard", "View > Calibrate"), ("settings", "Edit > Preferences")],
)
def test_workspaces_and_commands_are_found_by_words_of_others(
    window: MainWindow, qtbot: QtBot, typed: str, text: str
) -> None:
    search = CommandSearch(window)
    qtbot.addWidget(search)
    search.show_found(typed)
    assert search.list.item(0).text().startswith(text)


def test_a_panel_that_is_there_is_not_closed_by_looking_for_it(window: MainWindow, qtbot: QtBot) -> None:
    window.switch_to("setup")
    assert not window.docks["readout"].isHidden() and window.docks["log"].isHidden()
    for typed, key in (("baseline", "readout"), ("messages", "log")):
        search = CommandSearch(window)
        qtbot.addWidget(search)
        search.show_found(typed)
        texts = [search.list.item(i).text() for i in range(search.list.count())]
        search.list.setCurrentRow(next(i for i, text in enumerate(texts) if text.startswith("View > ")))
        search.choose()
        QApplication.processEvents()
        qtbot.waitUntil(lambda key=key: not window.docks[key].isHidden())


def test_every_word_for_a_command_is_of_one_that_there_is(window: MainWindow, qtbot: QtBot) -> None:
    search = CommandSearch(window)
    qtbot.addWidget(search)
    assert sum(bool(entry.words) for entry in search.entries) == len(WORDS)


def test_a_measure_is_added_from_the_search_once_there_is_a_profile(window: MainWindow, qtbot: QtBot) -> None:
    session, before = window.session, CommandSearch(window)
    qtbot.addWidget(before)
    of_kinds = {entry.name: entry for entry in before.entries if entry.text.startswith("Measures of the part")}
    assert set(of_kinds) == set(TITLES.values()) and not any(entry.possible for entry in of_kinds.values())
    with qtbot.waitSignal(session.measured, timeout=20_000):
        session.add_render(Render(1, small_project(), *small_render()))
    search = CommandSearch(window)
    qtbot.addWidget(search)
    search.show_found("thickness")
    search.choose()
    part = window.panels["results"].part  # type: ignore[attr-defined]
    qtbot.waitUntil(lambda: part.placing == "thickness")
    part.cancel()


@pytest.mark.parametrize(
    ("typed", "text"),
    [
        ("export photograph points", "File > Export > Line in photographs"),
        ("save points", "File > Export > Points as PLY"),
        ("tilt the laser", "Scene > Aim the laser at a click"),
    ],
)
def test_a_command_is_found_by_what_is_to_be_done(window: MainWindow, qtbot: QtBot, typed: str, text: str) -> None:
    search = CommandSearch(window)
    qtbot.addWidget(search)
    search.show_found(typed)
    assert search.list.item(0).text().startswith(text)


def test_where_nothing_has_all_words_the_nearest_are_offered(window: MainWindow, qtbot: QtBot) -> None:
    search = CommandSearch(window)
    qtbot.addWidget(search)
    search.show_found("automatic expozure")
    heading, first = search.list.item(0), search.list.item(1)
    assert heading.text() == NEAREST and not heading.flags()
    assert first.text().startswith("Render > Automatic exposure") and search.list.currentItem() is first
