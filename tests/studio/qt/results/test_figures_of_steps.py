"""Of a scan each figure in Measure says whether it is of the step that is looked at or of all."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from pytestqt.qtbot import QtBot

from analysis.gauges.gauge import Gauge
from analysis.report.gauge_table import cells, over_steps_of
from studio.project.document import Document
from studio.project.project import Project
from studio.qt.core.scan_steps import scan_steps
from studio.qt.core.session import Session
from studio.qt.render.develop_panel import DevelopPanel
from studio.qt.results.heads import CHANGED, MEASURED_OTHERWISE, UNMEASURED
from studio.qt.results.results_panel import PART, ResultsPanel
from studio.scan.gauging import measures_record, step_readings
from studio.scan.options import ScanOptions
from studio.scan.region import Region
from studio.scan.scan import run_scan
from studio.scan.scan_folder import open_folder
from tests.studio.scan_of_steps import SCALE, small_project

LEVEL = Gauge(name="level", kind="step", regions=((-0.2, -0.1), (0.1, 0.2)), nominal=0.0, lower=-0.1, upper=0.1)
FLAT = Gauge(name="flat", kind="flatness", regions=((-0.2, 0.2),))


@pytest.fixture(scope="module")
def scanned(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    folder = tmp_path_factory.mktemp("steps")
    file = folder / "project" / "steps.json"
    project = small_project().model_copy(update={"measures": (LEVEL, FLAT)}).save(file)
    run_scan(project, file.parent, out=folder / "scan", options=ScanOptions(image_scale=SCALE, report=False))
    return file, folder / "scan"


@pytest.fixture
def panel(scanned: tuple[Path, Path], qtbot: QtBot) -> Iterator[ResultsPanel]:
    file, folder = scanned
    session = Session(Document(Project.load(file), file))
    made = ResultsPanel(session)
    qtbot.addWidget(made)
    made.resize(1366, 420)
    made.show()
    develop = DevelopPanel(session)
    qtbot.addWidget(develop)
    steps = scan_steps(session)
    with qtbot.waitSignal(session.measured, timeout=20_000):
        steps.show(open_folder(folder))
    made.figures.setCurrentIndex(PART)
    yield made
    steps.close()
    develop.close()


def verdict(panel: ResultsPanel, row: int = 0) -> str:
    return panel.part.table.item(row, 4).text()


def test_a_verdict_is_over_all_steps_or_names_its_step(panel: ResultsPanel) -> None:
    """The first step's "pass" stood beside a measure of which the scan's report said "undecided"."""
    session, part = panel.session, panel.part
    assert session.shown is not None and session.shown.scan is not None
    steps = step_readings(session.shown.scan.found.folder / "measures.csv", (LEVEL,))[LEVEL]
    second, highest = sorted(one.value + 2.0 * one.sigma for one in steps)[1:]
    gauge = LEVEL.model_copy(update={"upper": 0.5 * (second + highest)})
    session.set(("measures", 0), gauge)
    (row,) = measures_record((gauge,), [replace(one, gauge=gauge) for one in steps])
    worst = row["step"] + 1
    assert row["verdict"] != "pass" and row["verdicts"]["pass"] == 2
    shown = [part.table.item(0, column).text() for column in range(4)]
    value, *others = (cells(row)[column] for column in (1, 2, 6))
    assert shown[1:] == [f"{value} (step {worst})", *others]
    assert verdict(panel).endswith(row["verdict"])
    assert cells(row)[5] in part.table.item(0, 4).toolTip(), "as in the report"
    assert f": 2 pass, 1 {row['verdict']}, worst: step {worst} of 3" in cells(row)[5]
    assert not part.table.horizontalScrollBar().isVisible(), "the verdict is seen"
    part.table.selectRow(0)
    assert f"2 pass, 1 {row['verdict']}. Its value is of the worst: step {worst} of 3." in part.told.text()
    panel.scan_bar.scope.setCurrentIndex(1)
    assert verdict(panel).endswith(f"{gauge.verdict(steps[0].value, steps[0].sigma)}, step 1")
    assert part.told.text().startswith("Of step 1 of 3. All steps, as measured last")
    assert "(step" not in part.table.item(0, 1).text()


def test_a_row_of_all_steps_tells_what_they_come_to_and_that_of_one_does_not(panel: ResultsPanel) -> None:
    """The worst step alone was told, and nothing of the others."""
    table = panel.part.table
    assert panel.session.shown is not None and panel.session.shown.scan is not None
    steps = step_readings(panel.session.shown.scan.found.folder / "measures.csv", (LEVEL,))[LEVEL]
    (row,) = measures_record((LEVEL,), steps)
    told = over_steps_of(row)
    assert told.startswith("median ") and told.endswith("over the 3 steps")
    assert f"<p>M{told[1:]}</p>" in table.item(0, 0).toolTip() and "edian" not in table.item(1, 0).toolTip()
    panel.scan_bar.scope.setCurrentIndex(1)
    assert "edian" not in table.item(0, 0).toolTip()


def test_a_step_that_is_looked_at_has_no_value_of_stray_points_and_draws_none(
    panel: ResultsPanel, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Window, chart and 3D view had a value and a verdict of points where the exact line is not."""
    part = panel.part
    panel.scan_bar.scope.setCurrentIndex(1)
    part.table.selectRow(0)
    assert len(panel.session.measures_in_3d) == len(part.drawing.texts) == 1
    monkeypatch.setattr("analysis.gauges.read.is_stray", lambda *_: True)
    part.refresh()
    assert verdict(panel) == "not measured, step 1" and part.readings[0].reason.startswith(
        "the exact line does not reach"
    )
    assert len(panel.session.measures_in_3d) == len(part.drawing.texts) == 0
    assert part.told.text().startswith("Of step 1 of 3") and "stray light or noise" in part.told.text()


def test_what_is_drawn_of_one_step_beside_figures_of_all_names_it(panel: ResultsPanel) -> None:
    """The table's value was of the worst step, that of the label in 3D of the first, and neither said so."""
    session, part = panel.session, panel.part
    part.table.selectRow(0)
    measures = session.measures_in_3d
    assert [one.text.split(":")[0] for one in measures] == ["level, step 1"], "a flatness has no lines"
    assert [item.toPlainText().split(":")[0] for item in part.drawing.texts] == ["level, step 1"]
    panel.scan_bar.scope.setCurrentIndex(1)
    assert [one.text.split(":")[0] for one in session.measures_in_3d] == ["level"]
    assert [item.toPlainText().split(":")[0] for item in part.drawing.texts] == ["level"]


def test_counts_of_all_steps_follow_the_tolerance(panel: ResultsPanel) -> None:
    session, told = panel.session, panel.part.told
    panel.scan_bar.scope.setCurrentIndex(1)
    panel.part.table.selectRow(0)
    assert told.text().startswith("Of step 1 of 3. All steps, as measured last, by the tolerance of now: 3 pass.")
    session.set(("measures", 0, "nominal"), 1.0)
    assert "3 fail." in told.text() and "pass" not in told.text()
    session.set(("measures", 0, "regions"), ((-0.2, -0.15), (0.1, 0.2)))
    assert "not measured like this yet: Measure > Measure the scan again" in told.text() and "fail" not in told.text()
    panel.scan_bar.scope.setCurrentIndex(0)
    assert verdict(panel).endswith("fail, step 1"), "all steps were measured otherwise"
    without = dict.fromkeys(("nominal", "lower", "upper"))
    session.set(("measures", 0), session.project.measures[0].model_copy(update=without))
    assert verdict(panel) == "step 1", "its value is no less of one step where nothing is asked of it"


def test_steps_without_measures_were_not_measured_in_another_section(
    panel: ResultsPanel, monkeypatch: pytest.MonkeyPatch
) -> None:
    session, told, scan = panel.session, panel.part.told, panel.session.shown.scan
    panel.part.table.selectRow(0)
    bare = scan.measured_as.model_copy(update={"measures": ()})
    monkeypatch.setitem(vars(scan), "measured_as", bare)  # as a scan without measures keeps it
    session.set(("measured_in",), "across_x" if bare.measured_in != "across_x" else "across_y")
    assert "not measured like this yet" in told.text() and "another section" not in told.text()


def test_a_flatness_is_of_all_steps(panel: ResultsPanel) -> None:
    told = panel.part.told
    panel.part.table.selectRow(1)
    assert told.text().startswith("It is of all 3 steps together, as measured last.") and "step 1" not in told.text()
    panel.session.set(("measures", 1, "regions"), ((-0.15, 0.2),))
    assert "as measured last" not in told.text() and "Measure the scan again" in told.text()


def test_scan_lines_are_of_the_step_that_is_looked_at(panel: ResultsPanel, qtbot: QtBot) -> None:
    assert panel.scan_bar.whole is not None
    panel.choose(Region("scan lines", 10.0, 60.0))
    assert panel.region.title.text() == "<b>Scan lines 10 to 60, of step 1 of 3</b>"
    panel.session.look_at_step(2)
    qtbot.waitUntil(lambda: "of step 3 of 3" in panel.region.title.text())


@pytest.mark.parametrize("width", [1366, 900, 640])
def test_what_stands_above_the_figures_is_seen_whole(panel: ResultsPanel, qtbot: QtBot, width: int) -> None:
    """Of one line that was cut off nobody could read what to do."""
    panel.resize(width, 300)
    panel.session.set(("sensor", "exposure_time"), 0.5 * panel.session.project.sensor.exposure_time)
    panel.session.set(("scene", "rig", "lasers", 0, "fan_angle"), 0.5)
    label = panel.head_text
    assert label.text().startswith(CHANGED) and MEASURED_OTHERWISE in label.text() and label.isVisible()
    qtbot.waitUntil(lambda: label.height() >= label.heightForWidth(label.width()) > 0)
    assert label.width() >= max(label.fontMetrics().horizontalAdvance(word) for word in label.text().split())
    assert label.width() > label.height(), "a sliver beside the steps held a word in each line"
    assert panel.rect().contains(label.mapTo(panel, label.rect().bottomRight()))


def test_a_step_that_plays_past_says_that_its_points_are_to_come(panel: ResultsPanel, qtbot: QtBot) -> None:
    """Its charts had the true line alone, and said "no point" of scan lines that have one."""
    session = panel.session
    with qtbot.waitSignal(session.renders_changed):
        session.look_at_step(1)
    assert session.shown is not None and not session.shown.measurements
    session.hover(40)
    assert UNMEASURED in panel.head_text.text() and "not measured yet" in panel.reading.text()
    with qtbot.waitSignal(session.measured, timeout=20_000):
        pass
    assert UNMEASURED not in panel.head_text.text() and "not measured yet" not in panel.reading.text()
