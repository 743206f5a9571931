"""No figure of another project, render or row stays on the screen."""

from __future__ import annotations

from dataclasses import replace

import pytest
from PySide6.QtCore import QPointF
from pytestqt.qtbot import QtBot

from render.checkpoint import RenderState
from studio.preview.readout_rows import Row
from studio.project.document import Document
from studio.project.project import Project
from studio.project.templates import template_folder
from studio.qt.core.jobs import JobRunner
from studio.qt.core.live_preview import live
from studio.qt.core.render import Render
from studio.qt.core.session import Session
from studio.qt.image.camera_view import CameraView
from studio.qt.render.develop_panel import DevelopPanel
from studio.qt.render.history import History
from studio.qt.render.render_panel import RenderPanel
from studio.qt.results.heads import CHANGED, STOPPED
from studio.qt.results.measures_table import MeasuresTable
from studio.qt.results.readout_panel import ReadoutPanel
from studio.qt.results.results_panel import ResultsPanel
from studio.scan.result_series import OUTLIERS
from studio.scan.stages import scaled
from tests.studio.qt.small_session import measured_view, small_project, small_render, small_session


def another_document() -> Document:
    folder = template_folder("plane")
    return Document(scaled(Project.load(folder / "project.json"), 0.125), root=folder)


def another_render(number: int = 2) -> Render:
    world, frame = small_render()
    quality = tuple(replace(one, error=2 * one.error, work=2 * one.work) for one in frame.quality)
    return Render(number, small_project(), world, replace(frame, quality=quality))


@pytest.fixture
def camera(qtbot: QtBot):
    with measured_view(qtbot) as view:
        view._moved((view.view.box.mapViewToScene(QPointF(60, 40)),))
        assert "60, 40" in view.readout.text()
        yield view


class TestReadOut:
    def test_another_project_takes_it_away(self, camera: CameraView) -> None:
        camera.session.replace_document(another_document())
        assert camera.readout.text() == ""

    def test_another_render_takes_it_away(self, camera: CameraView) -> None:
        camera.session.add_render(another_render())
        assert camera.readout.text() == ""

    def test_another_row_takes_it_away(self, camera: CameraView) -> None:
        camera.session.hover(40)
        assert camera.readout.text()
        camera.session.hover(41)
        assert camera.readout.text() == ""

    def test_another_exposure_is_read_anew(self, camera: CameraView, qtbot: QtBot) -> None:
        before, session = camera.readout.text(), camera.session
        with qtbot.waitSignal(session.developed, timeout=20_000):
            session.set(("sensor", "exposure_time"), 20 * session.project.sensor.exposure_time)
        qtbot.waitUntil(lambda: not camera.runner.busy and camera.readout.text() != before)
        assert "60, 40" in camera.readout.text()


def test_the_hovered_row_goes_with_its_project_and_with_another_size(qtbot: QtBot) -> None:
    session = small_session(rendered=True)
    session.hover(40)
    session.add_render(another_render())
    assert session.hovered == 40, "the rows are the same"
    other = another_render(3)
    session.add_render(replace(other, frame=replace(other.frame, laser_direct=(other.frame.laser_direct[0][::2],))))
    assert session.hovered is None
    session.hover(7)
    with qtbot.waitSignals([session.hover_changed, session.step_changed]):
        session.replace_document(another_document())
    assert session.hovered is None


def test_the_errors_of_the_render_panel_are_of_what_is_shown(qtbot: QtBot) -> None:
    session = small_session(rendered=True)
    panel = RenderPanel(session, JobRunner())
    qtbot.addWidget(panel)
    panel.show()
    first = session.shown
    session.add_render(another_render())
    second = panel.errors.text()
    session.show(first)
    assert panel.errors.text() and panel.errors.text() != second
    session.show(session.renders[1])
    assert panel.errors.text() == second
    session.replace_document(another_document())
    assert panel.errors.text() == "" and not panel.errors.isVisible()
    live(session).close()


def test_measures_beside_the_exposure_are_of_what_is_shown(qtbot: QtBot) -> None:
    session = small_session(rendered=True)
    panel = DevelopPanel(session)
    qtbot.addWidget(panel)
    with qtbot.waitSignal(session.measured, timeout=20_000):
        panel.refresh()
    assert panel.table.text() and panel.told.text()
    session.add_render(another_render())
    assert panel.table.text() == "" and panel.told.text() == ""
    qtbot.waitUntil(lambda: not panel.busy)
    assert panel.table.text()
    panel.close()


def test_design_figures_that_a_project_does_not_have_are_hidden(qtbot: QtBot, monkeypatch: pytest.MonkeyPatch) -> None:
    from studio.qt.results import readout_panel

    session = small_session()
    panel = ReadoutPanel(session)
    qtbot.addWidget(panel)
    panel.show()
    qtbot.waitUntil(lambda: live(session).ready and len(panel.rows()) > 2)
    row: Row = panel.rows()[0]
    monkeypatch.setattr(readout_panel, "rows", lambda *_: (row,))
    panel._refresh()
    assert [key for key, labels in panel._labels.items() if labels[1].isVisible()] == [row.key]
    live(session).close()


def test_two_renders_of_another_project_are_compared_no_longer(qtbot: QtBot) -> None:
    session = small_session(rendered=True)
    panel = History(session)
    qtbot.addWidget(panel)
    small = replace(another_render(), image_scale=0.5)
    session.add_render(small)
    panel.list.selectAll()
    panel.compare()
    view = panel.comparison
    assert view is not None and view.isVisible() and "0.5 x" in view.right.text()
    qtbot.waitUntil(lambda: not view.runner.busy)
    session.replace_document(another_document())
    assert not view.isVisible() and view.comparison is None


def test_results_explain_what_lies_within_two_sigma(qtbot: QtBot) -> None:
    session: Session = small_session(rendered=True)
    panel, develop = ResultsPanel(session), DevelopPanel(session)
    for widget in (panel, develop):
        qtbot.addWidget(widget)
    with qtbot.waitSignal(session.measured, timeout=20_000):
        develop.refresh()
    rows = {panel.table.verticalHeaderItem(i).text(): i for i in range(panel.table.rowCount())}
    heading = panel.table.verticalHeaderItem(rows["Within 2 sigma / %"])
    assert "95 %" in heading.toolTip() and "noise" in heading.toolTip()
    assert session.shown is not None
    said = panel.notices[1].text.text()
    low = session.shown.measurements["likelihood"][0].errors.u.coverage < 0.88
    assert ("predicted sigma" in said) == low
    panel.close()
    develop.close()


def test_large_errors_are_told_in_mm(qtbot: QtBot) -> None:
    """An RMSE of 0.8 m stood there as 789531 um; and a bias in mm above what it is known to in um."""
    made = MeasuresTable()
    qtbot.addWidget(made)
    made.show_measures(
        ["likelihood"], [("RMSE", "µm", [789531.0]), ("Bias", "µm", [-9999.0]), ("Points", "", [20000.0])]
    )
    told = {made.verticalHeaderItem(i).text(): made.item(i, 0).text() for i in range(3)}
    assert told == {"RMSE / mm": "790", "Bias / mm": "-10.00", "Points": "20\u202f000"}


def test_the_words_of_outliers_say_which_completeness_counts(qtbot: QtBot) -> None:
    made = MeasuresTable()
    qtbot.addWidget(made)
    made.show_measures(["likelihood"], [(name, "%", [50.0]) for name in ("Completeness", *OUTLIERS.values())])
    tips = [made.verticalHeaderItem(i).toolTip() for i in range(4)]
    assert "no outlier in the image" in tips[0] and "leaves them out" in tips[3]
    assert all("Completeness counts them unless" in tip for tip in tips[1:3])


@pytest.fixture
def results(qtbot: QtBot) -> ResultsPanel:
    made = ResultsPanel(small_session(rendered=True))
    qtbot.addWidget(made)
    return made


def test_remarks_are_of_the_settings_that_it_was_measured_with(qtbot: QtBot) -> None:
    """Not of those with which it was rendered: another focus is measured anew without a render."""
    session = small_session(rendered=True)
    panel, develop = ResultsPanel(session), DevelopPanel(session)
    for widget in (panel, develop):
        qtbot.addWidget(widget)
    with qtbot.waitSignal(session.measured, timeout=20_000):
        develop.refresh()
    assert "would be blurred" not in panel.notices[1].text.text()
    with qtbot.waitSignal(session.measured, timeout=20_000):
        session.set(("scene", "rig", "camera", "lens", "focus_distance"), 0.05)
    assert session.shown is not None and not session.stale
    assert "would be blurred" in panel.notices[1].text.text()
    panel.close()
    develop.close()


def test_figures_of_a_scene_that_has_changed_say_so(results: ResultsPanel) -> None:
    panel, session = results, results.session
    assert not panel.head_text.text().startswith(CHANGED)
    session.set(("scene", "rig", "lasers", 0, "fan_angle"), 0.5)
    assert CHANGED in panel.head_text.text() and panel.head.isVisibleTo(panel)
    session.document.undo()
    assert CHANGED not in panel.head_text.text()


def test_a_cell_of_a_study_says_whose_it_is(results: ResultsPanel) -> None:
    panel = results
    cell = replace(another_render(), cell="key", name="Sweep 1: 0.04, repeat 1")
    panel.session.add_render(cell)
    assert "Cell of a study: Sweep 1: 0.04, repeat 1" in panel.head_text.text()
    assert "Render workspace" in panel.head_text.text()


def test_a_render_that_was_stopped_says_that_light_is_missing(results: ResultsPanel) -> None:
    stopped = replace(another_render(), final=False, state=RenderState({}))
    results.session.add_render(stopped)
    assert STOPPED in results.head_text.text()
    results.session.add_render(replace(stopped, final=False, state=None, number=3))
    assert STOPPED not in results.head_text.text(), "more is to come by itself"


def test_the_profile_of_a_render_says_that_the_scene_has_changed(camera: CameraView) -> None:
    session = camera.session
    assert "as it was" not in camera.profile.text.text()
    session.set(("scene", "rig", "lasers", 0, "fan_angle"), 0.5)
    assert "in the scene as it was rendered" in camera.profile.text.text()
    session.document.undo()
    assert "as it was" not in camera.profile.text.text()
