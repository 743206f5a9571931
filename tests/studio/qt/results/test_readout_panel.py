"""The design panel: it follows the look, says what is out of range in colour, and explains itself."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from PySide6.QtWidgets import QComboBox, QLabel, QPushButton
from pytestqt.qtbot import QtBot

from render.base.pose import Pose
from render.scene.motion import Turntable
from studio.project.document import Document
from studio.project.project import Project
from studio.qt.core import theme
from studio.qt.core.session import Session
from studio.qt.results.readout_panel import ReadoutPanel

SAMPLE = Path(__file__).parents[4] / "assets/projects/plane/project.json"
LASERS = ("scene", "rig", "lasers")


def panel_on(qtbot: QtBot) -> ReadoutPanel:
    theme.apply("light")
    panel = ReadoutPanel(Session(Document(Project.load(SAMPLE), SAMPLE)))
    qtbot.addWidget(panel)
    panel.show()
    qtbot.waitUntil(lambda: bool(panel.rows()) and panel.rows()[1].value != "-")
    return panel


def label_of(panel: ReadoutPanel, text: str) -> QLabel:
    return next(label for label in panel.findChildren(QLabel) if label.text() == text)


def value_of(panel: ReadoutPanel, key: str) -> str:
    return next(row.value for row in panel.rows() if row.key == key)


def test_a_value_out_of_range_takes_the_colour_of_a_warning(qtbot: QtBot) -> None:
    panel = panel_on(qtbot)
    session = panel._session
    session.set((*LASERS, 0, "power"), 2.0)
    qtbot.waitUntil(lambda: value_of(panel, "saturated") == "100%")
    assert theme.colours().error in label_of(panel, "100%").styleSheet()
    assert "full well" in label_of(panel, "Saturated").toolTip()
    theme.apply("dark")
    assert theme.DARK.error in label_of(panel, "100%").styleSheet()
    session.document.undo()
    qtbot.waitUntil(lambda: value_of(panel, "saturated") == "0%")
    assert theme.colours().text in label_of(panel, value_of(panel, "peak")).styleSheet()


def test_with_two_lasers_the_selected_one_is_read_out(qtbot: QtBot) -> None:
    panel = panel_on(qtbot)
    session = panel._session
    choice = panel.findChild(QComboBox)
    assert choice is not None and not choice.isVisible()
    first = session.project.scene.lasers[0]
    other = first.model_copy(
        update={"name": "second", "T_rig_laser": Pose(translation=(-0.35, 0, 0), rotation=(0, 0.4, 0))}
    )
    session.set(LASERS, (first, other))
    qtbot.waitUntil(choice.isVisible)
    assert value_of(panel, "baseline") == "200 mm"
    session.select((*LASERS, 1))
    assert value_of(panel, "baseline") == "350 mm" and choice.currentText() == "second"
    session.set(LASERS, (first,))
    qtbot.waitUntil(lambda: value_of(panel, "baseline") == "200 mm")
    # a new one is selected before anything of it is there to be read out
    session.select((*LASERS, 0))
    session.set(LASERS, (first, other))
    session.select((*LASERS, 1))
    qtbot.waitUntil(lambda: value_of(panel, "baseline") == "350 mm")


def test_of_a_scene_that_moves_it_says_which_step_it_is_of(qtbot: QtBot) -> None:
    panel = panel_on(qtbot)
    session = panel._session
    assert not panel.step.isVisible()
    session.set(("scene", "motion"), Turntable(steps=12))
    session.look_at_step(11)
    qtbot.waitUntil(lambda: panel.step.isVisible() and panel.step.text() == "As it stands at step 12 of 12")


def test_without_a_laser_it_says_what_to_do(qtbot: QtBot) -> None:
    panel = panel_on(qtbot)
    panel._session.set(LASERS, ())
    qtbot.waitUntil(lambda: panel.rows() == ())
    assert label_of(panel, "Add a laser to the rig to see what it measures.").isVisible()


def test_what_would_fix_it_is_applied_by_a_click_and_undone(qtbot: QtBot) -> None:
    panel = panel_on(qtbot)
    session, fixes = panel._session, panel.fixes
    assert not fixes.isVisible()
    session.set((*LASERS, 0, "power"), 2.0)
    qtbot.waitUntil(lambda: bool(fixes.found) and fixes.isVisible())
    bad = session.project
    apply = next(button for button in fixes.findChildren(QPushButton) if button.text() == "Apply")
    apply.click()
    qtbot.waitUntil(lambda: value_of(panel, "saturated") == "0%" and not fixes.isVisible())
    assert session.project.sensor.exposure_time < bad.sensor.exposure_time
    session.document.undo()
    assert session.project == bad
    qtbot.waitUntil(lambda: panel._fix["saturated"].isVisible())
    panel._fix["saturated"].click()  # the same in its row
    qtbot.waitUntil(lambda: value_of(panel, "saturated") == "0%" and not panel._fix["saturated"].isVisible())


def test_a_range_that_goes_moves_no_field_below_it(qtbot: QtBot) -> None:
    panel = panel_on(qtbot)
    _, _, note = panel._labels["angle"]
    note.setText("12.0 to 14.0")
    panel._rows = tuple(replace(row, note="12.0 to 14.0") if row.key == "angle" else row for row in panel._rows)
    panel._paint()
    qtbot.wait(20)
    below = panel.placing.fields["standoff"].y()
    panel._rows = tuple(replace(row, note="") if row.key == "angle" else row for row in panel._rows)
    panel._paint()
    qtbot.wait(20)
    assert panel.placing.fields["standoff"].y() == below and not note.isVisible()


@pytest.mark.parametrize("width", [0, 270, 300, 380, 460, 560])
def test_what_goes_with_a_value_is_read_beside_the_button_that_fixes_it(qtbot: QtBot, width: int) -> None:
    """Of a defocus that is off in images the panel showed an amber number, a button and a blank line."""
    panel = panel_on(qtbot)
    session = panel._session
    session.set((*LASERS, 0, "power"), 2.0)
    session.set(("scene", "rig", "camera", "lens", "f_number"), 1.4)
    keys = ("saturated", "blur")
    qtbot.waitUntil(lambda: all(panel._fix[key].isVisible() for key in keys), timeout=10_000)
    content = panel._area.widget()
    panel.resize(max(width, content.minimumSizeHint().width()), 900)
    qtbot.wait(20)
    for key in keys:
        note, button = panel._labels[key][2], panel._fix[key]
        assert note.isVisible() and note.text().endswith({"saturated": "% of full well", "blur": "off in images"}[key])
        assert note.width() >= note.fontMetrics().horizontalAdvance(note.text()), f"{key}: {note.text()} at {width} px"
        assert not note.geometry().intersects(button.geometry())
        assert content.rect().contains(button.geometry()) and content.width() <= panel.width()


@pytest.mark.parametrize("width", [270, 300, 333, 374, 499, 560])
def test_a_median_and_a_share_of_the_brightest_place_say_which_they_are_and_are_read_whole(
    qtbot: QtBot, width: int
) -> None:
    """A peak of 4,576 e- stood over 90 % of a full well of 10,500 e-. Widths: of windows of 1280, 1440 and 1920 px."""
    panel = panel_on(qtbot)
    session = panel._session
    session.set(("sensor", "speckle"), "polarised")
    session.set((*LASERS, 0, "power"), 0.03)
    qtbot.waitUntil(lambda: panel._fix["saturated"].isVisible(), timeout=10_000)
    panel.resize(width, 900)
    qtbot.wait(20)
    (name, value, note), (_, _, share) = panel._labels["peak"], panel._labels["saturated"]
    assert name.text() == "Median peak signal" and value.text().endswith(" e-")
    assert share.text().startswith("up to ") and share.text().endswith("% of full well without speckle")
    assert "the median along the line" in name.toolTip() and "the brightest place" in share.toolTip()
    for label in (note, share) if width < 300 else (name, note, share):
        assert label.width() >= label.fontMetrics().horizontalAdvance(label.text()), label.text()
    content = panel._area.widget()
    assert content.rect().contains(share.geometry()) and content.width() <= panel.width()
