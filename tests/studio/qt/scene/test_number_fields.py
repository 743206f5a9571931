"""What a number's field says where it is empty, typed wrongly, or stepped to what will not do."""

from __future__ import annotations

from PySide6.QtCore import Qt
from pytestqt.qtbot import QtBot

from analysis.report.units import grouped
from render.scene.motion import MAX_STEPS, Turntable
from studio.qt.core.session import Session
from studio.qt.scene.inspector import Inspector
from tests.studio.qt.scene.inspector_hands import field, row, type_into


def test_whole_numbers_say_from_where_to_where_they_go(qtbot: QtBot, session: Session, inspector: Inspector) -> None:
    session.set(("scene", "motion"), Turntable())
    session.select(("scene", "motion"))
    editor = field(inspector, "scene", "motion", "steps")
    type_into(qtbot, editor, "many", key=None)
    told = row(inspector, "scene", "motion", "steps").reason.text()
    assert told == f"This is not a number; allowed: a whole number from 1 to {grouped(MAX_STEPS)}"


def test_an_arrow_that_would_take_the_last_of_an_axis_leaves_it_as_it_was(
    qtbot: QtBot, session: Session, inspector: Inspector
) -> None:
    """The number was red with its complaint, though it was one that does."""
    session.set(("scene", "motion"), Turntable(axis=(0.0, 0.0, 0.01)))
    session.select(("scene", "motion"))
    told: list[str] = []
    session.message.connect(lambda kind, text: told.append(text))
    editor, line = (of(inspector, "scene", "motion", "axis") for of in (field, row))
    editor.fields[2].setFocus()
    qtbot.keyClick(editor.fields[2], Qt.Key.Key_Down)
    assert editor.fields[2].text() == "0.01" and not editor.fields[2].invalid
    assert not line.reason.isVisible() and "no direction" in told[-1]
    assert session.project.scene.motion.axis == (0.0, 0.0, 0.01)


def test_a_field_that_may_be_empty_has_its_unit_then_too(qtbot: QtBot, session: Session, inspector: Inspector) -> None:
    session.select(("delivery",))
    lower = field(inspector, "delivery", "lower")
    lower.resize(160, lower.height())
    assert lower.text() == "" and lower.suffix == "µm"
    with_unit = lower.grab().toImage()
    lower.suffix = ""
    assert lower.grab().toImage() != with_unit
