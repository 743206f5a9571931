"""Tolerances of measures whose nominal every drawing leaves out, as it is 0."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from PySide6.QtCore import Qt
from pytestqt.qtbot import QtBot

from analysis.gauges.gauge import REGIONS, Gauge, Kind
from studio.qt.core.session import Session
from studio.qt.results.part_editor import PartEditor
from tests.studio.qt.small_session import small_session

PLACES = ((-0.25, -0.15), (0.0, 0.1), (0.15, 0.25))


@pytest.fixture
def session() -> Iterator[Session]:
    yield small_session()


def editor_of(session: Session, kind: Kind, qtbot: QtBot, **more: float) -> PartEditor:
    session.set(("measures",), (Gauge(name="it", kind=kind, regions=PLACES[: len(REGIONS[kind])], **more),))
    made = PartEditor(session)
    qtbot.addWidget(made)
    session.project_changed.connect(lambda: made.show_gauge(0, session.project.measures[0]))
    made.show_gauge(0, session.project.measures[0])
    made.show()
    return made


@pytest.mark.parametrize("kind", ["flatness", "straightness", "flush"])
def test_a_tolerance_alone_is_of_a_nominal_of_0(session: Session, kind: Kind, qtbot: QtBot) -> None:
    editor = editor_of(session, kind, qtbot)
    upper = editor.fields["upper"]
    assert upper.isEnabled() and "becomes 0" in upper.toolTip()
    upper.setFocus()
    qtbot.keyClicks(upper, "0.05")
    qtbot.keyClick(upper, Qt.Key.Key_Return)
    changed = session.project.measures[0]
    # a bow or a flush may be to either side
    lower = None if kind == "flatness" else pytest.approx(-5e-5)
    assert (changed.nominal, changed.lower, changed.upper) == (0.0, lower, pytest.approx(5e-5))
    assert editor.fields["nominal"].text() == "0" and not editor.problem.isVisible()
    session.document.undo()
    assert session.project.measures[0].nominal is session.project.measures[0].upper is None, "one step"


def test_a_nominal_that_is_given_stays(session: Session, qtbot: QtBot) -> None:
    editor = editor_of(session, "flush", qtbot, nominal=0.002)
    editor.fields["lower"].setFocus()
    qtbot.keyClicks(editor.fields["lower"], "-0.1")
    qtbot.keyClick(editor.fields["lower"], Qt.Key.Key_Return)
    assert (session.project.measures[0].nominal, session.project.measures[0].lower) == (0.002, pytest.approx(-1e-4))


@pytest.mark.parametrize("kind", [kind for kind in REGIONS if kind not in ("flatness", "straightness", "flush")])
def test_of_all_others_a_person_says_it_first(session: Session, kind: Kind, qtbot: QtBot) -> None:
    editor = editor_of(session, kind, qtbot)
    assert [editor.fields[name].isEnabled() for name in ("lower", "upper")] == [False, False]
    assert editor.fields["upper"].placeholderText() == "nominal first"


@pytest.mark.parametrize(("kind", "unit"), [("step", "mm"), ("angle", "deg"), ("area", "mm²")])
def test_nominal_and_tolerance_name_the_unit_that_they_are_typed_in(
    session: Session, kind: Kind, unit: str, qtbot: QtBot
) -> None:
    """Of a field that takes mm the tip said m, rad, m²."""
    editor = editor_of(session, kind, qtbot, nominal=0.002)
    for name in ("nominal", "lower", "upper"):
        tip = editor.fields[name].toolTip()
        assert f"In {unit}, unless another unit is typed." in tip and "m, rad" not in tip
