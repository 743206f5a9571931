"""The render panel: a render that refines, waits, is kept or forgotten; its history and comparisons."""

from __future__ import annotations

from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QLineEdit

from render.render import render_world
from render.run import Run
from render.scene.settings import DepthGoal, RenderSettings
from studio.qt.core.jobs import JobRunner
from studio.qt.image.compare_view import DIFFERENCE
from studio.qt.render.develop_panel import DevelopPanel
from studio.qt.render.render_panel import TRANSPORT, RenderPanel
from studio.runtime.jobs import State
from studio.scan.compare import compare, resampled
from studio.scan.redevelop import develop_again, development
from studio.scan.render_goal import goal_of
from tests.studio.qt.small_session import small_project, small_render, small_session


@pytest.fixture
def panel(qtbot):
    session = small_session()
    runner = JobRunner()
    made = RenderPanel(session, runner)
    qtbot.addWidget(made)
    made.resize(340, 700)
    made.show()
    qtbot.waitExposed(made)
    yield made
    runner.close()
    if made.history.comparison is not None:
        made.history.comparison.runner.close()


def press(qtbot, button):
    qtbot.mouseClick(button, Qt.MouseButton.LeftButton)


def finish(qtbot, panel):
    qtbot.waitUntil(lambda: panel.runner.job() is None)


def long_render(qtbot, panel):
    """A render that would take minutes, with its first frames there."""
    panel.session.set(("render", "ambient_samples"), 65536)
    panel.session.set(("render", "goal"), None)
    panel.session.set(("render", "ambient_error"), 2e-4)
    press(qtbot, panel.start_button)
    session = panel.session
    qtbot.waitUntil(lambda: session.shown is not None and session.shown.frame.ambient is not None)


def test_the_image_refines_until_it_is_the_final_one(qtbot, panel):
    session, seen = panel.session, []
    session.set(("render", "goal"), DepthGoal())
    session.renders_changed.connect(lambda: seen.append((len(session.renders), session.shown.final)))
    press(qtbot, panel.start_button)
    finish(qtbot, panel)
    assert seen[0] == (1, False) and seen[-1] == (1, True) and len(seen) >= 5
    project = session.project
    world, _ = small_render()
    run = Run(seed=project.seed, goal=goal_of(project))
    whole = render_world(world, project.scene, settings=project.render, run=run)
    assert np.array_equal(session.shown.frame.laser_direct[0], whole.laser_direct[0])
    assert "error" in panel.errors.text() and panel.start_button.isVisible()


def test_keep_stops_and_leaves_the_frame_so_far(qtbot, panel):
    long_render(qtbot, panel)
    press(qtbot, panel.keep_button)
    finish(qtbot, panel)
    (render,) = panel.session.renders
    assert not render.final and render.frame.ambient is not None and panel.session.shown is render
    assert "stopped early" in panel.history.list.item(0).toolTip()


def test_a_second_click_on_render_ends_nothing(qtbot, panel):
    """What holds and ends a render comes beside the button that starts it, never below the mouse."""
    panel.session.set(("render", "goal"), None)
    panel.session.set(("render", "ambient_samples"), 65536)
    panel.session.set(("render", "ambient_error"), 2e-4)
    QApplication.processEvents()
    places = [QPoint(x, panel.start_button.height() // 2) for x in range(2, panel.start_button.width(), 20)]
    places = [panel.start_button.mapTo(panel, place) for place in places]
    press(qtbot, panel.start_button)
    job = panel.runner.job()
    qtbot.waitUntil(lambda: panel.cancel_button.isVisible() and job.state is State.RUNNING)
    QApplication.processEvents()
    assert {panel.childAt(place) for place in places} == {panel.start_button} and not panel.start_button.isEnabled()
    for place in places:
        QTest.mouseClick(panel.childAt(place), Qt.MouseButton.LeftButton)
    assert panel.runner.job() is job and job.state is State.RUNNING and not job.cancel_asked
    press(qtbot, panel.cancel_button)
    finish(qtbot, panel)
    assert panel.start_button.isEnabled() and not panel.cancel_button.isVisible()


def test_every_way_of_light_is_told_in_the_words_of_the_project(panel):
    kinds = get_args(RenderSettings.model_fields["transport"].annotation)
    assert tuple(TRANSPORT) == kinds
    shown = [panel.transport.itemText(i).lower().replace(" ", "-") for i in range(panel.transport.count())]
    assert tuple(shown) == kinds


def test_cancel_forgets_the_render_and_shows_the_one_before(qtbot, panel):
    press(qtbot, panel.start_button)
    finish(qtbot, panel)
    before = panel.session.shown
    panel.session.set(("render", "ambient_samples"), 65536)
    panel.session.set(("render", "goal"), None)
    panel.session.set(("render", "ambient_error"), 2e-4)
    press(qtbot, panel.start_button)
    qtbot.waitUntil(lambda: len(panel.session.renders) == 2)
    press(qtbot, panel.cancel_button)
    finish(qtbot, panel)
    assert len(panel.session.renders) == 1 and panel.session.shown is before


def test_pause_holds_the_render_and_go_on_continues_it(qtbot, panel):
    long_render(qtbot, panel)
    job = panel.runner.job()
    press(qtbot, panel.pause_button)
    assert job.state is State.PAUSED and panel.pause_button.text() == "Go on"
    job.resume()
    panel.runner.progress.emit(job)  # as the status bar does
    assert panel.pause_button.text() == "Pause"
    press(qtbot, panel.pause_button)

    def stands() -> bool:
        before = panel.session.shown.world.rays.rays
        qtbot.wait(150)
        return panel.session.shown.world.rays.rays == before

    qtbot.waitUntil(stands)  # when chunks under way have ended
    rays = panel.session.shown.world.rays.rays
    press(qtbot, panel.pause_button)
    qtbot.waitUntil(lambda: panel.session.shown.world.rays.rays > rays)
    press(qtbot, panel.cancel_button)
    finish(qtbot, panel)


def test_a_time_limit_keeps_what_there_is(qtbot, panel):
    panel.session.set(("render", "ambient_samples"), 65536)
    panel.session.set(("render", "goal"), None)
    panel.session.set(("render", "ambient_error"), 2e-4)
    panel.limit.setValue(1)
    press(qtbot, panel.start_button)
    finish(qtbot, panel)
    assert len(panel.session.renders) == 1 and not panel.session.shown.final


def test_a_render_that_was_kept_goes_on_from_where_it_was(qtbot, panel):
    long_render(qtbot, panel)
    assert not panel.continue_button.isVisible()
    press(qtbot, panel.keep_button)
    finish(qtbot, panel)
    (render,) = panel.session.renders
    samples = render.frame.quality_of("ambient").work
    assert panel.continue_button.isVisible() and render.state is not None
    render.kept = Path("renders", "stopped")
    press(qtbot, panel.continue_button)
    qtbot.waitUntil(lambda: render.frame.quality_of("ambient").work > samples)
    assert render.frame.ambient is not None
    # to cancel is to stop there: what was kept before is not lost
    press(qtbot, panel.cancel_button)
    finish(qtbot, panel)
    assert panel.session.renders == [render] and panel.continue_button.isVisible()
    assert render.kept is None, "the project's files have less of its light"


def test_the_settings_are_edits_of_the_project_that_undo(qtbot, panel):
    document = panel.session.document
    panel.laser_error.setFocus()
    panel.laser_error.selectAll()
    qtbot.keyClicks(panel.laser_error, "2")
    qtbot.keyClick(panel.laser_error, Qt.Key.Key_Return)
    assert document.project.render.laser_error == pytest.approx(0.02)
    document.undo()
    assert panel.laser_error.value() == pytest.approx(100 * small_project().render.laser_error)


def test_the_plan_says_what_will_be_computed(qtbot, panel):
    assert "306 x 256" in panel.plan.text() or "none" in panel.plan.text()
    assert "interreflection" in panel.plan.text()


def test_a_missing_mesh_is_told_and_nothing_is_left_behind(qtbot, panel):
    from render.scene.shape import MeshFile

    session = panel.session
    session.set(("scene", "objects", 0, "shape"), MeshFile(path="gone.stl"))
    with qtbot.waitSignal(session.message) as told:
        press(qtbot, panel.start_button)
    finish(qtbot, panel)
    level, text = told.args
    assert level == "error" and "gone.stl" in text and "Traceback" not in text
    assert session.renders == [] and panel.start_button.isVisible()


def test_opening_another_project_ends_the_render(qtbot, panel):
    from studio.project.document import Document

    long_render(qtbot, panel)
    panel.session.replace_document(Document(small_project(), root=panel.session.document.root))
    finish(qtbot, panel)
    assert panel.session.renders == [] and panel.session.shown is None


def test_renders_are_shown_named_and_deleted(qtbot, panel):
    for _ in range(2):
        press(qtbot, panel.start_button)
        finish(qtbot, panel)
    session, history = panel.session, panel.history.list
    first, second = session.renders
    assert session.shown is second
    place = history.visualItemRect(history.item(1)).center()
    qtbot.mouseClick(history.viewport(), Qt.MouseButton.LeftButton, pos=place)
    assert session.shown is first
    qtbot.keyClick(history, Qt.Key.Key_F2)
    editor = history.findChild(QLineEdit)
    qtbot.keyClicks(editor, "rough")
    qtbot.keyClick(editor, Qt.Key.Key_Return)
    qtbot.waitUntil(lambda: first.name == "rough")  # Qt commits an edit on its next turn
    assert history.item(1).text() == "rough"
    history.item(1).setSelected(True)
    qtbot.keyClick(history, Qt.Key.Key_Delete)
    assert session.renders == [second] and session.shown is second


def test_the_same_objects_are_not_loaded_twice(qtbot, panel):
    press(qtbot, panel.start_button)
    finish(qtbot, panel)
    panel.session.set(("scene", "rig", "camera", "fx"), 500.0)
    press(qtbot, panel.start_button)
    finish(qtbot, panel)
    first, second = panel.session.renders
    assert second.world is first.world


def test_two_renders_are_compared_by_wipe_and_difference(qtbot, panel):
    session = panel.session
    session.set(("render", "goal"), None)  # how well the light is known would depend on the power
    press(qtbot, panel.start_button)
    finish(qtbot, panel)
    session.set(("scene", "rig", "lasers", 0, "power"), 0.5 * session.project.scene.lasers[0].power)
    press(qtbot, panel.start_button)
    finish(qtbot, panel)
    for render in session.renders:
        render.images = develop_again(render.frame, development(render.project, render.project), noise=False)
    panel.history.list.selectAll()
    press(qtbot, panel.history.compare_button)
    window = panel.history.comparison
    qtbot.waitUntil(lambda: window.comparison is not None)
    window.quantity.setCurrentIndex(1)
    window.quantity.activated.emit(1)
    qtbot.waitUntil(lambda: window.comparison.unit == "W/(m² sr)")
    a, b = window.comparison.a, window.comparison.b
    assert np.allclose(b, a / 2, rtol=1e-5)
    assert window.over.isVisible()
    assert "developed" not in window.told.text()  # light is of no exposure
    how = development(session.renders[0].project, session.renders[0].project)
    for render in session.renders:
        render.made_from["images"] = render.frame, how
    window.quantity.setCurrentIndex(0)
    window.quantity.activated.emit(0)
    qtbot.waitUntil(lambda: "both developed with" in window.told.text())
    watts = session.renders[0].project.scene.lasers[0].power
    assert f" ms, {1e3 * watts:g} mW" in window.told.text()  # of now, whatever it was when the light was rendered
    window.mode.setCurrentText(DIFFERENCE)
    assert not window.over.isVisible() and "RMS" in window.told.text()
    window.close()


def test_renders_of_other_sizes_meet_on_the_grid_of_the_first():
    small = np.arange(6, dtype=np.float32).reshape(2, 3)
    assert resampled(small, (4, 6))[:2, :2].tolist() == [[0, 0], [0, 0]]
    assert np.array_equal(resampled(resampled(small, (8, 12)), (2, 3)), small)
    _, frame = small_render()
    project = small_project()
    images = develop_again(frame, development(project, project))
    same = compare("image", (frame, images), (frame, images))
    assert same is not None and same.rms == 0.0


def test_what_inspect_warns_of_is_told_once_as_it_is_measured(qtbot, panel):
    session, told, develop = panel.session, [], DevelopPanel(panel.session)
    qtbot.addWidget(develop)
    session.message.connect(lambda level, text: told.append((level, text)))
    session.set(("scene", "rig", "lasers", 0, "power"), 0.0)
    press(qtbot, panel.start_button)
    finish(qtbot, panel)
    qtbot.waitUntil(lambda: session.shown.final and not develop.busy)
    dark = [text for level, text in told if level == "warning" and "power is 0 W" in text]
    assert len(dark) == 1
    develop.close()


def test_the_goal_is_the_line_or_the_errors_of_the_image(panel: RenderPanel) -> None:
    session = panel.session
    session.set(("render", "goal"), DepthGoal())
    assert panel.goal.value() == 0.1 and not panel.ambient_error.isEnabled()
    panel.goal.setValue(0.0)
    assert session.project.render.goal is None and panel.goal.text() == "errors of the image"
    assert panel.ambient_error.isEnabled()
    panel.goal.setValue(0.25)
    assert session.project.render.goal is not None and session.project.render.goal.depth == 0.25
    session.document.undo()
    assert panel.goal.value() == 0.0


def test_texts_of_a_render_leave_the_list_where_it_is(qtbot, panel):
    panel.resize(340, 1200)
    places = []
    for errors in ("", "laser: error 0.05%<br>" * 8):
        panel.errors.setText(errors)
        panel.errors.setVisible(bool(errors))
        panel.layout().activate()
        watched = (panel.history.list, panel.history.delete_button, panel.start_button)
        places.append([widget.mapTo(panel, QPoint(0, 0)).y() for widget in watched])
    assert places[0] == places[1]
