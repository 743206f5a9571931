"""The result views are one: what is pointed at in one of them is marked in all."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QPoint, QPointF, QRect, Qt
from PySide6.QtTest import QTest
from pytestqt.qtbot import QtBot

from analysis.gauges.gauge import Gauge
from analysis.report.units import percent
from render.world.world import build_world
from studio.project.document import Document
from studio.project.project import Project
from studio.qt.core.render import Render
from studio.qt.results.measures_table import shown
from studio.qt.results.results_panel import ResultsPanel
from studio.qt.shell.window import MainWindow
from studio.qt.viewport.error_cloud import ErrorCloud
from studio.qt.viewport.measure_marks import FONT_PX, MeasureMarks
from studio.scan.region import Region, members
from studio.scan.stages import Clock, develop_step, measure_step, render_step

METHODS = ("likelihood", "gaussian", "centre_of_mass")


@pytest.fixture(scope="module")
def render(tmp_path_factory: pytest.TempPathFactory) -> Render:
    """The step block in 244 x 204 px, measured by three methods."""
    from studio.project.templates import template_folder
    from studio.scan.stages import scaled

    folder = template_folder("step_block")
    project = scaled(Project.load(folder / "project.json"), 0.1)
    settings = project.render.model_copy(update={"ambient_samples": 1, "laser_error": 0.05, "goal": None})
    project = project.model_copy(update={"render": settings})
    clock = Clock(lambda *_: None, lambda: False)
    world = build_world(project.scene, folder, 0)
    frame = render_step(project, world, 0, clock)
    images = develop_step(project, frame, clock, None)
    found = {method: measure_step(project, frame, world, images, clock, None, method) for method in METHODS}
    return Render(1, project, world, frame, measurements=found, images=images)


@pytest.fixture
def results(window: MainWindow, render: Render, qtbot: QtBot) -> ResultsPanel:
    window.switch_to("measure")
    window.session.add_render(render)
    panel = window.panels["results"]
    assert isinstance(panel, ResultsPanel)
    qtbot.waitUntil(lambda: panel.rows.isVisible() and panel.rows.width() > 100)
    return panel


def scan_line_in(window: MainWindow) -> int:
    """One with a point and a true crossing."""
    render = window.session.shown
    assert render is not None
    one = render.measurements["likelihood"][0]
    here = np.flatnonzero(np.isfinite(one.errors.depth))
    return int(one.points.index[here[len(here) // 3]])


def test_pointing_at_a_row_marks_it_everywhere(window: MainWindow, results: ResultsPanel, qtbot: QtBot) -> None:
    row = scan_line_in(window)
    plot = results.rows.depth
    series, _ = results.rows._shown["likelihood"]
    at = plot.vb.mapViewToScene(QPointF(row, float(series.depth[series.index == row][0])))
    qtbot.mouseMove(results.rows.viewport(), results.rows.mapFromScene(at))
    qtbot.waitUntil(lambda: window.session.hovered is not None)
    hovered = window.session.hovered
    assert hovered is not None and abs(hovered - row) <= 1
    assert all(line.isVisible() and line.value() == hovered for line in results.rows.cursors)
    assert len(results.profile.ring.data) > 0
    assert results.histogram.cursor.isVisible()
    assert f"Row {hovered}" in results.reading.text()
    assert np.all(window.cloud.rows[window.cloud.rows == hovered] == hovered) and window.cloud._marks.n_points > 0


def test_a_click_keeps_the_row_when_the_mouse_leaves(window: MainWindow, results: ResultsPanel, qtbot: QtBot) -> None:
    row = scan_line_in(window)
    at = results.rows.error.vb.mapViewToScene(QPointF(row, 0.0))
    place = results.rows.mapFromScene(at)
    qtbot.mouseMove(results.rows.viewport(), place)
    qtbot.mouseClick(results.rows.viewport(), Qt.MouseButton.LeftButton, pos=place)
    pinned = results.pinned
    assert pinned is not None and abs(pinned - row) <= 1
    results.rows.hovered.emit(3)
    assert window.session.hovered == 3
    results.rows.hovered.emit(None)
    assert window.session.hovered == pinned


def test_pointing_at_the_profile_finds_the_nearest_sample(
    window: MainWindow, results: ResultsPanel, qtbot: QtBot
) -> None:
    from studio.scan.result_series import measured_series

    render = window.session.shown
    assert render is not None
    series = measured_series(render.measurements["likelihood"][0], render.project.scene)
    i = int(np.flatnonzero(np.isfinite(series.distance))[20])
    at = results.profile.plot.vb.mapViewToScene(QPointF(series.across[i], series.distance[i]))
    found = results.profile.scan_line_at(at)
    assert found is not None and abs(found - series.index[i]) <= 1


def test_pointing_at_a_point_in_3d_marks_its_row(window: MainWindow, results: ResultsPanel, qtbot: QtBot) -> None:
    cloud: ErrorCloud = window.cloud
    assert cloud.visible and len(cloud.points) > 50
    cloud.frame()
    i = len(cloud.points) // 2
    x, y = cloud.view.eye.project(cloud.points[i : i + 1], cloud.view.pixels)[0]
    qtbot.mouseMove(cloud.view, QPoint(5, 5))
    qtbot.mouseMove(cloud.view, QPoint(round(x), round(y)))
    qtbot.waitUntil(lambda: window.session.hovered is not None)
    hovered = window.session.hovered
    assert hovered is not None
    apart = cloud.view.eye.project(cloud.points[cloud.rows == hovered], cloud.view.pixels) - (x, y)
    assert np.linalg.norm(apart, axis=1).min() < 3.0


def test_the_menu_walks_along_the_line_and_to_the_worst(
    window: MainWindow, results: ResultsPanel, qtbot: QtBot
) -> None:
    session = window.session
    qtbot.keyClick(window, Qt.Key.Key_Down, Qt.KeyboardModifier.AltModifier)
    first = session.hovered
    qtbot.keyClick(window, Qt.Key.Key_Down, Qt.KeyboardModifier.AltModifier)
    assert first is not None and session.hovered == first + 1
    qtbot.keyClick(window, Qt.Key.Key_W, Qt.KeyboardModifier.AltModifier)
    assert session.shown is not None
    errors = session.shown.measurements["likelihood"][0].errors.depth
    worst = np.nanmax(np.abs(errors))
    row = session.shown.measurements["likelihood"][0].points.index == session.hovered
    assert np.nanmax(np.abs(errors[row])) == worst


def test_methods_can_be_switched_off(window: MainWindow, results: ResultsPanel, qtbot: QtBot) -> None:
    assert list(results.shown()) == list(METHODS) and results.table.columnCount() == 3
    button = results.findChild(type(results.switches.itemAt(1).widget()), "gaussian")
    qtbot.mouseClick(button, Qt.MouseButton.LeftButton)
    assert "gaussian" not in results.shown() and results.table.columnCount() == 2
    qtbot.mouseClick(button, Qt.MouseButton.LeftButton)
    assert list(results.shown()) == list(METHODS)


def test_the_table_says_what_the_measures_say(window: MainWindow, results: ResultsPanel) -> None:
    render = window.session.shown
    assert render is not None
    rows = {results.table.verticalHeaderItem(i).text(): i for i in range(results.table.rowCount())}
    rmse = render.measurements["likelihood"][0].errors.depth_z.rmse
    assert float(results.table.item(rows["RMSE / µm"], 0).text()) == pytest.approx(1e6 * rmse, rel=5e-3)
    results.error.setCurrentIndex(2)
    assert float(results.table.item(rows["RMSE / µm"], 0).text()) == pytest.approx(
        render.measurements["likelihood"][0].errors.u.rmse, rel=5e-3
    )
    assert window.cloud.error_view.kind == "position"
    results.error.setCurrentIndex(0)


def test_a_share_that_is_not_all_is_never_rounded_up_to_it() -> None:
    assert [shown(100.0 * count / 2044, "%") for count in (2044, 2043, 2041, 1)] == ["100", "99.9", "99.9", "0.0489"]
    assert [percent(count / 2044) for count in (2044, 2043)] == ["100.0\u00a0%", "99.9\u00a0%"]
    assert percent(0.99999, 2) == "99.99\u00a0%" and shown(99.96, "µm") == "100.0"


def test_points_hide_when_the_scene_has_changed_but_not_while_measuring(
    window: MainWindow, results: ResultsPanel, qtbot: QtBot
) -> None:
    window.session.set(("scene", "objects", 0, "scale"), 1.5)
    assert window.cloud.visible, "the measure workspace keeps what was measured"
    window.switch_to("setup")
    assert not window.cloud.visible
    window.session.document.undo()


def test_without_a_render_the_panel_says_what_to_do(window: MainWindow) -> None:
    panel = window.panels["results"]
    assert isinstance(panel, ResultsPanel)
    assert panel.stack.currentIndex() == 0
    assert not window.commands["export_html"].isEnabled()


class TestMotion:
    @pytest.fixture
    def moving(self, window: MainWindow, tmp_path: Path) -> MainWindow:
        from render.scene.motion import LinearStage
        from studio.project.document import replaced

        motion = LinearStage(step=(0.0, 0.002, 0.0), steps=3)
        window.session.document.apply("move", replaced(window.session.project, ("scene", "motion"), motion))
        window.show_panel("motion")
        return window

    def test_the_slider_moves_what_every_view_shows(self, moving: MainWindow, qtbot: QtBot) -> None:
        from studio.qt.core.live_preview import live
        from studio.qt.render.motion_panel import MotionPanel

        panel = moving.panels["motion"]
        assert isinstance(panel, MotionPanel) and panel.steps.slider.maximum() == 2
        panel.steps.slider.setValue(2)
        assert moving.session.step == 2
        qtbot.waitUntil(lambda: live(moving.session).look.step == 2)
        assert "step 3 of 3" in panel.told.text() and "4.00" in panel.told.text()

    def test_playing_goes_to_the_end_and_stops(self, moving: MainWindow, qtbot: QtBot) -> None:
        panel = moving.panels["motion"]
        panel.steps._timer.setInterval(1)  # type: ignore[attr-defined]
        qtbot.mouseClick(panel.steps.play, Qt.MouseButton.LeftButton)  # type: ignore[attr-defined]
        qtbot.waitUntil(lambda: moving.session.step == 2 and not panel.steps._timer.isActive())  # type: ignore[attr-defined]

    def test_undoing_the_motion_leads_back_to_a_step_that_is_there(self, moving: MainWindow) -> None:
        moving.session.look_at_step(2)
        moving.session.document.undo()
        assert moving.session.step == 0

    def test_a_scan_grows_its_cloud_step_by_step(self, moving: MainWindow, qtbot: QtBot, tmp_path: Path) -> None:
        panel = moving.panels["motion"]
        sizes: list[int] = []
        panel.grew.connect(lambda _: sizes.append(len(moving.cloud.points)))  # type: ignore[attr-defined]
        panel.scale.setCurrentText("full size")  # type: ignore[attr-defined]
        with qtbot.waitSignal(moving.runner.finished, timeout=60_000):
            assert panel.run_into(tmp_path / "scan", report=False) is not None  # type: ignore[attr-defined]
        assert len(sizes) == 3 and sizes[0] < sizes[1] < sizes[2]
        qtbot.waitUntil(lambda: len(moving.cloud.points) > 0)  # those of the results take the place of what grew
        ys = moving.cloud.points[:, 1]
        assert math.isclose(np.ptp(ys), np.ptp(ys[: sizes[0]]) + 0.004, abs_tol=0.002)
        assert (tmp_path / "scan" / "points.ply").is_file()


def test_a_click_on_a_point_in_3d_keeps_its_row_and_selects_nothing(
    window: MainWindow, results: ResultsPanel, qtbot: QtBot
) -> None:
    cloud: ErrorCloud = window.cloud
    cloud.frame()
    window.session.select(())
    i = len(cloud.points) // 2
    x, y = cloud.view.eye.project(cloud.points[i : i + 1], cloud.view.pixels)[0]
    qtbot.mouseClick(cloud.view, Qt.MouseButton.LeftButton, pos=QPoint(round(x), round(y)))
    assert results.pinned is not None and window.session.hovered == results.pinned
    assert window.session.selection == ()
    # of two points that lie one over the other either may be meant
    apart = cloud.view.eye.project(cloud.points[cloud.rows == results.pinned], cloud.view.pixels) - (x, y)
    assert np.linalg.norm(apart, axis=1).min() < 3.0
    results.pin(results.pinned)
    assert results.pinned is None


def test_a_measure_stands_in_3d_where_it_was_read_with_its_verdict(
    window: MainWindow, results: ResultsPanel, qtbot: QtBot
) -> None:
    session, cloud = window.session, window.cloud
    profile = results.part._profiles[0][0].position
    ground = profile[profile[:, 1] < np.median(profile[:, 1]) + 0.002, 0]
    top = float(profile[np.nanargmax(profile[:, 1]), 0])
    regions = ((float(ground.min()) + 0.001, float(ground.min()) + 0.05), (top - 0.008, top + 0.008))
    gauge = Gauge(name="Step", kind="step", regions=regions)
    session.set(("measures",), (gauge,))
    (one,) = session.measures_in_3d
    value = results.part.readings[0].value
    assert one.verdict is None and one.text.startswith(f"Step: {1e3 * value:.2f}"[:9])
    # its lines are where the points are, by the value apart
    nearest = [np.linalg.norm(cloud.points - end, axis=1).min() for line in one.lines[:-1] for end in line[[0, -1]]]
    assert max(nearest) < 0.004
    assert np.linalg.norm(np.diff(one.lines[-1][[0, -1]], axis=0)) == pytest.approx(abs(value), rel=1e-3)
    marks = next(child for child in cloud.view.children() if isinstance(child, MeasureMarks))
    assert [label.GetInput() for label in marks.labels] == [one.text.replace("\u00a0", " ")]
    session.set(("measures",), (gauge.model_copy(update={"nominal": value, "lower": -0.02, "upper": 0.02}),))
    assert session.measures_in_3d[0].verdict == "pass" and "pass" in marks.labels[0].GetInput()
    # another that is read nearby stands a line above it
    session.set(("measures",), (gauge, gauge.model_copy(update={"name": "Again"})))
    first, second = (label.GetDisplayOffset()[1] for label in marks.labels)
    assert second >= first + FONT_PX
    session.set(("measures",), (gauge,))
    # it goes with the points that it was read off
    scene = session.project.scene
    session.set(("scene", "rig", "lasers", 0, "fan_angle"), 0.9 * scene.lasers[0].fan_angle)
    assert cloud.visible and marks.labels
    window.switch_to("setup")
    assert not cloud.visible and not marks.labels


def test_a_rectangle_about_points_is_a_region_of_them(
    window: MainWindow, results: ResultsPanel, qtbot: QtBot, tmp_path: Path
) -> None:
    from studio.qt.viewport.viewport import Viewport
    from studio.scan.region import Box

    viewport, cloud = window.panels["viewport"], window.cloud
    assert isinstance(viewport, Viewport)
    cloud.frame()
    viewport.box.begin()
    places = cloud.view.eye.project(cloud.points, cloud.view.pixels)
    ends = [QPoint(*(round(float(x)) for x in np.percentile(places, share, axis=0))) for share in (30.0, 70.0)]
    low, high = np.minimum(_xy(ends[0]), _xy(ends[1])), np.maximum(_xy(ends[0]), _xy(ends[1]))
    qtbot.mousePress(viewport.view, Qt.MouseButton.LeftButton, pos=ends[0])
    qtbot.mouseMove(viewport.view, ends[1])
    qtbot.mouseRelease(viewport.view, Qt.MouseButton.LeftButton, pos=ends[1])
    box = results.region.region
    assert isinstance(box, Box) and cloud.box == box and not viewport.box.active
    inside = np.all((places > low + 1) & (places < high - 1), axis=1)
    assert inside.any() and box.holds(cloud.points[inside]).all()
    found = results.shown()["likelihood"]
    count = np.count_nonzero(box.of(found, window.session.shown.project.scene))
    assert int(results.region.table.item(0, 0).text()) == count >= np.count_nonzero(inside)
    results.region.write(tmp_path / "box.csv")
    scene = window.session.shown.project.scene
    counts = [np.count_nonzero(here) for here in members(box, list(results.shown().values()), scene)]
    assert counts[0] == count and len((tmp_path / "box.csv").read_text().splitlines()) == sum(counts) + 1
    # the others are compared at the same scan lines: by their own errors some of their points lie outside
    lines = set(found.points.index[box.of(found, scene)])
    for one, number in zip(results.shown().values(), counts, strict=True):
        assert number == np.count_nonzero(one.points.valid & np.isin(one.points.index, list(lines)))
    assert "the scan lines whose points by maximum likelihood" in results.region.title.text()
    results.region.clear.click()
    assert cloud.box is None


@pytest.mark.parametrize("parallel", [False, True])
def test_of_a_turned_view_a_rectangle_holds_what_is_seen_in_it_and_nothing_beside(
    window: MainWindow, results: ResultsPanel, qtbot: QtBot, parallel: bool
) -> None:
    cloud: ErrorCloud = window.cloud
    cloud.frame()
    cloud.view.look_from(replace(cloud.view.eye.orbit(50.0, 25.0), parallel=parallel))
    x, y = cloud.view.eye.project(cloud.points, cloud.view.pixels).T
    middle = np.argmin(np.hypot(x - np.median(x), y - np.median(y)))
    rectangle = QRect(round(float(x[middle])) - 5, round(float(y[middle])) - 40, 10, 80)
    cloud.take_box(rectangle)
    seen = (x >= rectangle.left()) & (x <= rectangle.right()) & (y >= rectangle.top()) & (y <= rectangle.bottom())
    box = results.region.region
    assert box is not None and 5 < seen.sum() < 0.3 * len(x)
    np.testing.assert_array_equal(box.holds(cloud.points), seen)  # type: ignore[union-attr]
    assert int(results.region.table.item(0, 0).text()) == seen.sum()
    assert results.region.title.text().startswith("<b>What was drawn around")


def test_a_rectangle_about_nothing_is_told_and_escape_gives_up(
    window: MainWindow, results: ResultsPanel, qtbot: QtBot
) -> None:
    from studio.qt.viewport.viewport import Viewport

    viewport, told = window.panels["viewport"], []
    assert isinstance(viewport, Viewport)
    window.session.message.connect(lambda level, text: told.append(text))
    window.cloud.frame()
    viewport.box.begin()
    QTest.keyClick(viewport.view, Qt.Key.Key_Escape)
    assert not viewport.box.active and viewport.view.tool is not viewport.box
    viewport.box.begin()
    qtbot.mousePress(viewport.view, Qt.MouseButton.LeftButton, pos=QPoint(1, 1))
    qtbot.mouseMove(viewport.view, QPoint(8, 8))
    qtbot.mouseRelease(viewport.view, Qt.MouseButton.LeftButton, pos=QPoint(8, 8))
    assert "no point" in told[-1] and results.region.region is None


def _xy(point: QPoint) -> np.ndarray:
    return np.array([point.x(), point.y()])


def test_region_and_row_stay_where_the_next_render_has_the_same_scan_lines(
    window: MainWindow, results: ResultsPanel, render: Render
) -> None:
    """They were lost when the rest of the light came."""
    row = scan_line_in(window)
    results.choose(Region("scan lines", row - 5, row + 5))
    results.pin(row)
    window.session.add_render(replace(render, number=2))
    assert results.region.region == Region("scan lines", row - 5, row + 5) and results.pinned == row
    assert results.region.table.rowCount() > 0
    turned = render.project.model_copy(
        update={"extraction": render.project.extraction.model_copy(update={"axis": "columns"})}
    )
    window.session.add_render(replace(render, number=3, project=turned))
    assert results.region.region is None and results.pinned is None


def test_a_range_goes_with_its_project(window: MainWindow, results: ResultsPanel, render: Render) -> None:
    row = scan_line_in(window)
    window.session.range_dragged.emit(row - 5.5, row + 5.5)
    assert results.region.region is not None and window.session.range is not None
    window.files.replace(Document(window.session.project, None))
    window.session.add_render(replace(render))
    assert results.region.region is None and window.session.range is None
    assert not any(span.isVisible() for plot in (results.rows, results.profile) for span in plot.spans)
