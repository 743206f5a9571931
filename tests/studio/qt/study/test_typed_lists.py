"""Values of a sweep that are typed as a list."""

from __future__ import annotations

from PySide6.QtCore import Qt
from pytestqt.qtbot import QtBot

from tests.studio.qt.study.desk import Desk


def test_a_list_with_a_bad_entry_stays_typed_and_names_it(qtbot: QtBot, desk: Desk) -> None:
    """All of it was thrown away for one slip."""
    desk.small([1.0, 2.0])
    (row,) = desk.panel.editor.rows
    said: list[str] = []
    desk.session.message.connect(lambda _, text: said.append(text))
    row.values.selectAll()
    qtbot.keyClicks(row.values, "0.5, x, 2")
    row.values.leave()
    assert row.values.text() == "0.5, x, 2" and row.values.invalid
    assert row.reason.text().startswith("“x”: this is not a number") and "values from before" in row.reason.text()
    assert desk.work.sweep["vary"][0]["values"] == [1.0, 2.0] and not said, "it is told where it is mended"
    row.values.selectAll()
    qtbot.keyClicks(row.values, "0.5, -3, 2")
    assert row.reason.text().startswith("“-3” must be at least 0")
    row.values.selectAll()
    qtbot.keyClicks(row.values, "0.5, 2")
    assert row.reason.isHidden() and not row.values.invalid
    row.values.leave()
    assert desk.work.sweep["vary"][0]["values"] == [0.5, 2.0]


def test_escape_brings_the_list_back_and_takes_what_was_told_away(qtbot: QtBot, desk: Desk) -> None:
    desk.small([1.0, 2.0])
    (row,) = desk.panel.editor.rows
    row.values.selectAll()
    qtbot.keyClicks(row.values, "1, y")
    row.values.leave()
    qtbot.keyClick(row.values, Qt.Key.Key_Escape)
    assert row.values.text() == "1  2" and row.reason.isHidden() and not row.values.invalid
