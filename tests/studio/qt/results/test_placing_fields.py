"""Baseline, angle and stand-off of Design are numbers that move things, each to where it then reads what was asked."""

from __future__ import annotations

import math

import pytest
from pytestqt.qtbot import QtBot

from studio.preview.readouts import readouts
from studio.qt.core.live_preview import live
from studio.qt.results.readout_panel import ReadoutPanel
from tests.studio.qt.results.test_readout_panel import panel_on


def read(panel: ReadoutPanel, key: str) -> float:
    """After the view has followed the project."""
    view = live(panel._session)
    view.refresh()
    found = readouts(view.look, 0)
    assert found.triangulation_angle is not None and found.distance is not None
    return {
        "baseline": found.baseline,
        "angle": found.triangulation_angle.middle,
        "standoff": found.distance.middle,
    }[key]


@pytest.mark.parametrize(
    ("key", "text", "value"),
    [("baseline", "150+2 in", 0.2008), ("angle", "30", math.radians(30.0)), ("standoff", "1 m", 1.0)],
)
def test_a_number_that_is_typed_is_read_afterwards(qtbot: QtBot, key: str, text: str, value: float) -> None:
    panel = panel_on(qtbot)
    field, session = panel.placing.fields[key], panel._session
    before, distance = session.project, read(panel, "standoff")
    field.setText(text)
    field.pending = True
    field.enter()
    assert read(panel, key) == pytest.approx(value, abs=1e-5)
    if key != "standoff":
        assert read(panel, "standoff") == pytest.approx(distance, rel=0.02)
    session.document.undo()
    assert session.project == before


def test_a_drag_is_one_step_to_undo_and_escape_gives_it_up(qtbot: QtBot) -> None:
    panel = panel_on(qtbot)
    field, session = panel.placing.fields["baseline"], panel._session
    before = session.project
    for keep in (False, True):
        field.drag_began.emit()
        for value in (0.21, 0.25, 0.3):
            field.dragged.emit(value)
        assert read(panel, "baseline") == pytest.approx(0.3)
        field.drag_ended.emit(keep)
        assert (session.project == before) is not keep
    session.document.undo()
    assert session.project == before


def test_a_number_that_cannot_be_is_dropped_and_said_why(qtbot: QtBot) -> None:
    panel = panel_on(qtbot)
    field, session = panel.placing.fields["standoff"], panel._session
    before, shown = session.project, field.text()
    field.setText("0")
    field.textEdited.emit("0")
    assert field.invalid
    with qtbot.waitSignal(session.message) as told:
        field.leave()
    assert told.args[0] == "warning" and "at least 1 mm. The value is as it was" in told.args[1]
    assert session.project == before and field.text() == shown and not field.invalid


@pytest.mark.parametrize("text", ["300", "350+10"])
def test_at_another_stand_off_the_laser_meets_the_same_point_with_the_same_baseline(qtbot: QtBot, text: str) -> None:
    panel = panel_on(qtbot)
    field, session = panel.placing.fields["standoff"], panel._session
    before, baseline = session.project, read(panel, "baseline")
    field.setText(text)
    field.pending = True
    field.enter()
    assert read(panel, "standoff") == pytest.approx(1e-3 * (300 if text == "300" else 360), abs=1e-5)
    assert read(panel, "baseline") == pytest.approx(baseline, abs=1e-8)
    assert all(each.isEnabled() for each in panel.placing.fields.values())
    session.document.undo()
    assert session.project == before


def test_a_field_that_takes_nothing_says_why(qtbot: QtBot) -> None:
    panel = panel_on(qtbot)
    field, session = panel.placing.fields["standoff"], panel._session
    assert "along its axis" in field.toolTip() and field.placeholderText() == "", "emptied, it says nothing wrong"
    session.set(("scene", "objects", 0, "visible"), False)
    qtbot.waitUntil(lambda: not field.isEnabled())
    assert field.placeholderText() == "no line"
    assert "not in the image" in field.toolTip() and "T" in field.toolTip()
    session.document.undo()
    qtbot.waitUntil(field.isEnabled)
    assert "along its axis" in field.toolTip()


def test_a_rig_that_sees_its_line_no_longer_is_told(qtbot: QtBot) -> None:
    panel = panel_on(qtbot)
    field, session = panel.placing.fields["angle"], panel._session
    field.setText("170")
    field.pending = True
    with qtbot.waitSignal(session.message) as told:
        field.enter()
    assert told.args[0] == "warning" and "sees nothing that the laser lights" in told.args[1]
    assert session.document.undo_label == "set the triangulation angle"
