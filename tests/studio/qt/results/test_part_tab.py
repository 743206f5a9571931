"""Measures of the part in the window: dragged in the profile, judged, undone; and the figures of a region."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtGui import QColor
from pytestqt.qtbot import QtBot

from analysis.gauges.gauge import Gauge
from analysis.gauges.read import OTHER_SHAPE
from analysis.report.gauge_table import UNPROVED
from studio.qt.core import theme
from studio.qt.core.session import Session
from studio.qt.results.plots import PointedPlots
from studio.qt.results.results_panel import PART, REGION, ResultsPanel
from studio.scan.gauging import readings
from studio.scan.region import Region
from studio.scan.sheet_lean import sheet_lean
from tests.studio.qt.small_session import measured_results

SIDES = ((-0.25, -0.15), (0.15, 0.25))
"""m, of the ground beside the sphere."""
SELDOM_MS = 20
"""Between two moves of the mouse: a scene leaves out those that follow within 10 ms."""


@pytest.fixture
def panel(qtbot: QtBot) -> ResultsPanel:
    """The small sphere, measured, on the screen."""
    made = measured_results(qtbot)
    # axes are fitted to the profile as they are painted, which a busy machine does late
    qtbot.waitUntil(lambda: made.profile.plot.vb.width() > 100 and shows(made.profile, *(1e3 * np.ravel(SIDES))))
    return made


def shows(plots: PointedPlots, *places: float) -> bool:
    """Whether all places of the x axis are in view."""
    low, high = plots.plots[0].vb.viewRange()[0]
    return all(low < place < high for place in places)


def drag(qtbot: QtBot, plots: PointedPlots, low: float, high: float, k: int = 0) -> None:
    """With the left button, from one place of a plot's x axis to another."""
    box, view = plots.plots[k].vb, plots.viewport()
    height = 0.5 * sum(box.viewRange()[1])
    ends = [plots.mapFromScene(box.mapViewToScene(QPointF(x, height))) for x in (low, high)]
    qtbot.mouseMove(view, ends[0] - QPoint(9, 0))  # what is under the mouse is known by where it moved
    qtbot.wait(SELDOM_MS)
    qtbot.mouseMove(view, ends[0])
    qtbot.wait(SELDOM_MS)
    qtbot.mousePress(view, Qt.MouseButton.LeftButton, pos=ends[0])
    for share in (0.3, 0.7, 1.0):
        qtbot.mouseMove(view, QPoint(*(round(a + share * (b - a)) for a, b in zip(*map(_pair, ends), strict=True))))
        qtbot.wait(SELDOM_MS)
    qtbot.mouseRelease(view, Qt.MouseButton.LeftButton, pos=ends[1])


def _pair(point: QPoint) -> tuple[int, int]:
    return point.x(), point.y()


def texts(panel: ResultsPanel, row: int) -> list[str]:
    table = panel.part.table
    return [table.item(row, column).text() for column in range(table.columnCount())]


def with_a_step(session: Session, **tolerance: float) -> Gauge:
    gauge = Gauge(name="level", kind="step", regions=SIDES, **tolerance)
    session.set(("measures",), (gauge,))
    return gauge


def test_drags_in_the_profile_make_a_measure_and_undo_removes_it(panel: ResultsPanel, qtbot: QtBot) -> None:
    session = panel.session
    panel.part.start("step")
    for low, high in SIDES:
        drag(qtbot, panel.profile, 1e3 * low, 1e3 * high)
    (made,) = session.project.measures
    a_pixel = 1e-3 * panel.profile.plot.vb.viewPixelSize()[0]
    assert np.abs(np.array(made.regions) - SIDES).max() < 2.0 * a_pixel
    assert panel.figures.currentIndex() == PART and panel.part.placing is None
    # the number of the table is the one that a scan writes
    render = session.shown
    assert render is not None
    project = render.project.model_copy(update={"measures": session.project.measures})
    (expected,) = readings(project, render.frame, render.measurements["likelihood"])
    assert panel.part.readings[0].value == expected.value and "mm" in texts(panel, 0)[1]
    assert len(panel.part.drawing.spans) == 2
    session.document.undo()
    assert session.project.measures == () and panel.part.table.rowCount() == 0 and not panel.part.drawing.spans
    session.document.redo()
    assert session.project.measures == (made,) and panel.part.table.rowCount() == 1


@pytest.mark.parametrize(
    ("tolerance", "verdict"),
    [
        ({"nominal": 0.0, "lower": -0.01, "upper": 0.01}, "pass"),
        ({"nominal": 0.1, "lower": -0.01, "upper": 0.01}, "fail"),
        ({"nominal": 0.0, "lower": -1e-9, "upper": 1e-9}, "undecided"),
    ],
)
def test_the_verdict_is_told_in_a_word(panel: ResultsPanel, tolerance: dict[str, float], verdict: str) -> None:
    with_a_step(panel.session, **tolerance)
    assert texts(panel, 0)[-1].endswith(verdict)


def test_a_moved_edge_is_one_step_of_undo_and_reads_the_measure_anew(panel: ResultsPanel) -> None:
    session, part = panel.session, panel.part
    gauge = with_a_step(session)
    part.table.selectRow(0)
    before = part.readings[0].points
    span = part.drawing.spans[1]
    span.lines[1].setValue(200.0)
    assert session.project.measures == (gauge,) and part.readings[0].points < before, "only looked at while it moves"
    span.lineMoveFinished()
    assert session.project.measures[0].regions[1] == (0.15, 0.2)
    session.document.undo()
    assert session.project.measures == (gauge,) and part.readings[0].points == before


def test_a_tolerance_needs_its_nominal(panel: ResultsPanel, qtbot: QtBot) -> None:
    gauge = with_a_step(panel.session)
    panel.figures.setCurrentIndex(PART)
    panel.part.table.selectRow(0)
    editor = panel.part.editor
    lower = editor.fields["lower"]
    assert not lower.isEnabled() and "nominal first" in lower.toolTip() and lower.placeholderText() == "nominal first"
    assert panel.session.project.measures == (gauge,)
    for name, text in (("nominal", "0"), ("lower", "-0.1"), ("nominal", ""), ("name", "ground")):
        field = editor.fields[name]
        field.setFocus()
        field.selectAll()
        qtbot.keyClicks(field, text) if text else qtbot.keyClick(field, Qt.Key.Key_Delete)
        qtbot.keyClick(field, Qt.Key.Key_Return)
        refused = text == ""  # the lower one is a deviation from it
        assert editor.problem.isVisible() == refused
        if refused:
            assert "nominal" in editor.problem.text() and panel.session.project.measures[0].nominal == 0.0
            qtbot.keyClick(field, Qt.Key.Key_Escape)
    changed = panel.session.project.measures[0]
    assert (changed.name, changed.nominal, changed.lower) == ("ground", 0.0, pytest.approx(-1e-4))


@pytest.mark.parametrize(("typed", "why"), [("abc", "this is not a number"), ("1e30", "must be at most")])
def test_what_tab_drops_is_told(panel: ResultsPanel, qtbot: QtBot, typed: str, why: str) -> None:
    with_a_step(panel.session)
    panel.figures.setCurrentIndex(PART)
    panel.part.table.selectRow(0)
    nominal = panel.part.editor.fields["nominal"]
    panel.activateWindow()
    qtbot.waitUntil(panel.isActiveWindow)
    nominal.setFocus()
    qtbot.keyClicks(nominal, typed)
    with qtbot.waitSignal(panel.session.message) as told:
        qtbot.keyClick(nominal, Qt.Key.Key_Tab)
    assert told.args[0] == "warning" and told.args[1].startswith(f"Nominal: {why}")
    assert told.args[1].endswith("The value is as it was") and nominal.text() == ""


def test_a_tolerance_that_tab_drops_is_told_until_something_else_is_typed(panel: ResultsPanel, qtbot: QtBot) -> None:
    with_a_step(panel.session, nominal=0.0, lower=2e-6)
    panel.figures.setCurrentIndex(PART)
    panel.part.table.selectRow(0)
    editor = panel.part.editor
    upper = editor.fields["upper"]
    panel.activateWindow()
    qtbot.waitUntil(panel.isActiveWindow)
    upper.setFocus()
    qtbot.keyClicks(upper, "-0.002")
    qtbot.keyClick(upper, Qt.Key.Key_Tab)
    told = editor.problem.text()
    assert upper.text() == "" and editor.problem.isVisible()
    assert told.startswith("Upper") and "lower" in told and told.endswith("The value is as it was")
    upper.setFocus()
    assert editor.problem.text() == told
    qtbot.keyClicks(upper, "0.004")
    assert not editor.problem.isVisible()


def test_tab_goes_from_the_nominal_on_to_its_tolerances(panel: ResultsPanel, qtbot: QtBot) -> None:
    with_a_step(panel.session)
    panel.figures.setCurrentIndex(PART)
    panel.part.table.selectRow(0)
    fields = panel.part.editor.fields
    panel.activateWindow()
    qtbot.waitUntil(panel.isActiveWindow)
    fields["nominal"].setFocus()
    for text in ("4", "-0.01", "0.02"):
        focused = panel.focusWidget()
        focused.selectAll()
        qtbot.keyClicks(focused, text)
        qtbot.keyClick(focused, Qt.Key.Key_Tab)
    made = panel.session.project.measures[0]
    assert (made.nominal, made.lower, made.upper) == pytest.approx((0.004, -1e-5, 2e-5))


def test_a_drag_over_rows_tells_of_their_errors_and_writes_their_points(
    panel: ResultsPanel, qtbot: QtBot, tmp_path: Path
) -> None:
    drag(qtbot, panel.rows, 40.0, 90.0, 2)
    region = panel.region.region
    assert region is not None and panel.figures.currentIndex() == REGION
    assert region.low == pytest.approx(40.0, abs=2.0) and region.high == pytest.approx(90.0, abs=2.0)
    found = panel.shown()["likelihood"]
    here = (found.points.index >= region.low) & (found.points.index <= region.high) & found.points.valid
    error = 1e6 * found.errors.depth[here & np.isfinite(found.errors.depth)]
    shown = [panel.region.table.item(row, 0).text() for row in range(panel.region.table.rowCount())]
    assert shown[0] == str(here.sum())
    mean, sigma = (float(part) for part in shown[1].split(" ± "))
    assert mean == pytest.approx(error.mean(), abs=sigma) and sigma >= 0.9 * error.std() / np.sqrt(len(error)) - 0.01
    panel.region.write(tmp_path / "region.csv")
    with open(tmp_path / "region.csv", newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [int(row["row"]) for row in rows] == found.points.index[here].tolist()
    # of two methods, which are both in the table, both are in the file
    panel.region._shown = {"likelihood": found, "gaussian": found}
    panel.region.write(tmp_path / "both.csv")
    with open(tmp_path / "both.csv", newline="", encoding="utf-8") as file:
        both = list(csv.DictReader(file))
    assert [row.pop("method") for row in both] == ["likelihood"] * len(rows) + ["gaussian"] * len(rows)
    assert both == rows + rows
    panel.region.clear.click()
    assert not panel.rows.spans[0].isVisible()


def test_scan_lines_chosen_in_the_picture_are_marked_in_the_charts_and_back(panel: ResultsPanel, qtbot: QtBot) -> None:
    session, told = panel.session, []
    session.range_dragged.emit(39.5, 90.5)
    assert panel.region.region == Region("scan lines", 39.5, 90.5) and panel.figures.currentIndex() == REGION
    assert panel.rows.spans[0].isVisible() and panel.rows.spans[0].ends == (39.5, 90.5)
    drag(qtbot, panel.rows, 40.0, 60.0, 2)
    region = panel.region.region
    assert region is not None and session.range == (region.low, region.high)
    panel.region.clear.click()
    assert session.range is None
    session.message.connect(lambda level, text: told.append(text))
    panel.hide()
    session.range_dragged.emit(39.5, 90.5)
    assert told == ["Measure, Region tells of scan lines 40 to 90"]


def test_scan_lines_dragged_in_the_picture_are_a_measures_region_while_it_is_added(panel: ResultsPanel) -> None:
    panel.part.start("straightness")
    panel.session.range_dragged.emit(40.0, 90.0)
    (made,) = panel.session.project.measures
    assert made.kind == "straightness" and panel.session.range is None


def test_a_flatness_of_a_still_frame_says_that_it_wants_a_scan(panel: ResultsPanel) -> None:
    panel.part.start("flatness")
    assert "drag across the surface" in panel.part.told.text() and "whole scan" in panel.part.told.text()
    panel.part.cancel()
    flat = Gauge(name="flat", kind="flatness", regions=((-0.25, 0.25),))
    assert panel.session.set(("measures",), (flat,), "add a flatness")
    panel.part.table.selectRow(0)
    assert "whole scan" in panel.part.told.text()
    assert [panel.part.table.item(0, k).text() for k in (0, 4)] == ["flat", "not measured"]


def test_a_tolerance_without_its_nominal_says_so(panel: ResultsPanel) -> None:
    """Who means plus or minus 0.02 may give 0.02 twice, and everything fails."""
    with_a_step(panel.session, nominal=0.021, lower=2e-5, upper=2e-5)
    panel.figures.setCurrentIndex(PART)
    panel.part.table.selectRow(0)
    assert "Allowed is 21.02\u00a0mm to 21.02\u00a0mm, without the nominal itself" in panel.part.told.text()
    with_a_step(panel.session, nominal=0.021, lower=0.0, upper=0.0)
    assert "Both limits are zero: no part passes" in panel.part.told.text()


def test_an_upright_section_moves_plot_and_measures_and_is_one_step_of_undo(panel: ResultsPanel) -> None:
    session, part = panel.session, panel.part
    slope = Gauge(name="slope", kind="point_to_point", regions=(SIDES[0], (-0.05, 0.05)))
    session.set(("measures",), (slope,))
    leaning, drawn = part.readings[0], panel.profile.truth.getData()[1]
    render = session.shown
    assert render is not None
    lean = sheet_lean(render.project.scene, 0)

    part.section.setCurrentIndex(1)
    part.section.activated.emit(1)
    upright = part.readings[0]
    assert session.project.measured_in == "upright" and "section" in panel.profile.plot.getAxis("left").labelText
    rise = [np.sqrt(one.truth**2 - 0.2**2) for one in (leaning, upright)]
    assert rise[1] / rise[0] == pytest.approx(np.cos(lean), rel=0.02)
    span = [np.ptp(values[np.isfinite(values)]) for values in (drawn, panel.profile.truth.getData()[1])]
    assert span[1] / span[0] == pytest.approx(np.cos(lean), rel=1e-3)
    session.document.undo()
    assert part.readings[0].value == leaning.value and part.section.currentIndex() == 0


def test_an_oblique_section_stands_beside_the_verdict(panel: ResultsPanel) -> None:
    """A right joint failed by the slant of the section alone, and the table had no more than a fail."""
    with_a_step(panel.session, nominal=0.1, lower=-0.01, upper=0.01)
    panel.part.table.selectRow(0)
    remark = "the section crosses its faces 13.0° obliquely: square to them it is 100.0000 mm; turn the laser"
    panel.part.readings = (replace(panel.part.readings[0], oblique=0.2269, square=0.1, remark=remark),)
    panel.part._show()
    normal = panel.part._profiles[0][0].normal
    assert normal is not None and np.nanmax(np.abs(np.linalg.norm(normal, axis=1) - 1.0)) < 1e-9
    assert texts(panel, 0)[-1].endswith("fail, 13.0° oblique") and "square to them it is" in panel.part.told.text()
    panel.part.readings = (replace(panel.part.readings[0], oblique=np.nan, remark=OTHER_SHAPE.format(63.0)),)
    panel.part._show()
    item = panel.part.table.item(0, 4)
    assert texts(panel, 0)[-1].endswith("undecided, misfit") and "by 63 times" in item.toolTip()
    assert UNPROVED in item.toolTip() and UNPROVED in panel.part.told.text()
    assert item.foreground().color() == QColor(theme.colours().warning)


def test_the_hint_names_the_list_of_sections(panel: ResultsPanel) -> None:
    with_a_step(panel.session)
    assert "The list of sections has others" in panel.part.told.text()
    assert panel.part.section.toolTip().startswith("List of sections")


def test_a_measure_is_deleted_by_its_key_and_not_by_chance(panel: ResultsPanel, qtbot: QtBot) -> None:
    gauge = with_a_step(panel.session)
    panel.figures.setCurrentIndex(PART)
    part = panel.part
    part.table.selectRow(0)
    panel.activateWindow()
    qtbot.waitUntil(panel.isActiveWindow)
    part.table.setFocus()
    for key in (Qt.Key.Key_Tab, Qt.Key.Key_Backtab):
        for _ in range(8):
            qtbot.keyClick(panel.focusWidget(), key)
            assert panel.focusWidget() is not part.remove
    part.table.setFocus()
    with qtbot.waitSignal(panel.session.message) as told:
        qtbot.keyClick(part.table, Qt.Key.Key_Delete)
    assert told.args == ["info", f"deleted {gauge.name} (Ctrl+Z brings it back)"]
    assert panel.session.project.measures == ()
    panel.session.document.undo()
    assert panel.session.project.measures == (gauge,)


def test_del_after_a_measure_was_made_or_moved_is_about_it_and_not_about_a_part(
    panel: ResultsPanel, qtbot: QtBot
) -> None:
    panel.activateWindow()
    qtbot.waitUntil(panel.isActiveWindow)
    panel.part.start("step")
    panel.profile.setFocus()
    for low, high in SIDES:
        drag(qtbot, panel.profile, 1e3 * low, 1e3 * high)
    assert panel.focusWidget() is panel.part.table
    panel.profile.setFocus()
    panel.part.drawing.moved.emit((SIDES[0], (SIDES[1][0], SIDES[1][1] + 1e-3)))
    assert panel.focusWidget() is panel.part.table
    qtbot.keyClick(panel.focusWidget(), Qt.Key.Key_Delete)
    assert panel.session.project.measures == ()


def test_the_axes_stay_while_a_measure_is_placed(panel: ResultsPanel, qtbot: QtBot) -> None:
    """What is measured anew meanwhile moved the places that were just dragged to."""
    panel.part.start("step")
    view = panel.profile.plot.vb
    panel.profile.plot.setRange(xRange=(-10.0, 10.0), yRange=(100.0, 200.0), padding=0.0)
    panel.refresh()
    assert view.viewRange()[0] == pytest.approx([-10.0, 10.0])
    panel.part.cancel()
    panel.refresh()
    assert view.viewRange()[0] != pytest.approx([-10.0, 10.0])


def test_another_section_is_brought_into_view_also_while_a_measure_is_placed(panel: ResultsPanel) -> None:
    panel.part.start("step")
    panel.session.set(("measured_in",), "upright", "section")
    series = next(iter(panel.profile._shown.values()))
    low, high = panel.profile.plot.vb.viewRange()[1]
    there = series.distance[np.isfinite(series.distance)]
    assert np.mean((there > low) & (there < high)) > 0.9


def test_texts_that_come_and_go_leave_table_and_fields_where_they_are(panel: ResultsPanel, qtbot: QtBot) -> None:
    with_a_step(panel.session)
    panel.figures.setCurrentIndex(PART)
    panel.part.table.selectRow(0)
    qtbot.waitUntil(panel.part.editor.isVisible)

    def places() -> list[int]:
        panel.part.layout().activate()
        panel.part.editor.layout().activate()
        watched = (panel.part.table, panel.part.editor.fields["nominal"])
        return [widget.mapTo(panel.part, QPoint(0, 0)).y() for widget in watched]

    before = places()
    panel.part.start("step")
    panel.part.editor._tell("must be at most 1 m")
    assert panel.part.told.isVisible() and panel.part.editor.problem.isVisible() and places() == before
    panel.part.told.hide()
    panel.part.editor._tell("")
    assert places() == before
