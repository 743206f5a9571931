"""What the study takes of the open project, and what of it is seen in its panel."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from PySide6.QtGui import QIcon
from pytestqt.qtbot import QtBot

from analysis.gauges.gauge import Gauge
from studio.project.document import Document
from studio.project.project import Project
from studio.project.templates import template_folder
from studio.qt.core.live_preview import live
from studio.qt.core.session import Session, one_of
from studio.qt.study.study_work import StudyWork
from studio.qt.study.sweep_editor import SweepEditor
from studio.study.folder_run import found_in

GAUGE = Gauge(name="Step", kind="step", regions=((-0.062, -0.05), (-0.03, -0.018)))


@pytest.fixture
def work(qtbot: QtBot, tmp_path: Path) -> Iterator[StudyWork]:
    file = tmp_path / "plane.json"
    Project.load(template_folder("plane")).save(file)
    session = Session(Document(Project.load(file), file))
    made = one_of(StudyWork, session)
    made.change_sweep(vary=[{"field": "sensor.read_noise", "values": [2.0, 4.0]}])
    yield made
    made.close()
    live(session).close()


def begun(work: StudyWork) -> None:
    study = work.study()
    work.found = found_in(study, work.bases(study), {})


def test_measures_of_the_part_that_it_does_not_ask_for_leave_it_going_on(qtbot: QtBot, work: StudyWork) -> None:
    begun(work)
    assert work.session.set(("measures",), (GAUGE,)) and work.session.set(("measured_in",), "upright")
    work.look_ahead()
    assert work.problem == ""
    qtbot.waitUntil(lambda: work.estimate is not None)
    work.change_sweep(measure="length_error:Step")
    work.look_ahead()
    assert "Measures: Step: not there in the folder, there now" in work.problem


def test_a_measure_that_it_asks_for_counts(qtbot: QtBot, work: StudyWork) -> None:
    assert work.session.set(("measures",), (GAUGE,))
    work.change_sweep(measure="length_error:Step")
    begun(work)
    other = GAUGE.model_copy(update={"name": "Other"})
    assert work.session.set(("measures",), (GAUGE, other))
    work.look_ahead()
    assert work.problem == ""
    assert work.session.set(
        ("measures",), (GAUGE.model_copy(update={"regions": ((-0.06, -0.05), (-0.03, -0.018))}), other)
    )
    work.look_ahead()
    assert "Measures: Step: Regions:" in work.problem


def test_a_chosen_method_has_a_tick_in_its_colour(qtbot: QtBot, work: StudyWork) -> None:
    """A menu shows the colour in place of a tick, so that nobody saw which were chosen."""
    editor = SweepEditor(work)
    qtbot.addWidget(editor)
    icon = editor.methods["likelihood"].icon()
    shown = [icon.pixmap(16, 16, QIcon.Mode.Normal, state).toImage() for state in (QIcon.State.Off, QIcon.State.On)]
    assert editor.methods["likelihood"].isChecked() and shown[0] != shown[1]
