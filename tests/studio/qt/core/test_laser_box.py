"""With several lasers, what is seen and told is of the one that was selected last."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from pytestqt.qtbot import QtBot

from analysis.gauges.gauge import Gauge
from render.base.pose import Pose
from render.render import render_world
from render.run import Run
from render.world.world import build_world
from studio.editing.scene_edits import LASERS, remove
from studio.project.document import Document, replaced
from studio.qt.core.laser_box import LaserBox, laser_of
from studio.qt.core.live_preview import live
from studio.qt.core.render import Render
from studio.qt.core.session import Session
from studio.qt.image.camera_view import CameraView
from studio.qt.render.develop_panel import DevelopPanel
from studio.qt.results.results_panel import ResultsPanel
from tests.studio.qt.small_session import FOLDER, small_project


@pytest.fixture
def session() -> Session:
    first = small_project().scene.lasers[0]
    second = first.model_copy(
        update={"name": "second", "T_rig_laser": Pose(translation=(0.3, 0.0, 0.0), rotation=(0.0, -0.35, 0.0))}
    )
    return Session(Document(replaced(small_project(), LASERS, (first, second)), root=FOLDER))


@pytest.fixture
def rendered(qtbot: QtBot, session: Session) -> Iterator[tuple[Session, CameraView, ResultsPanel]]:
    project = replaced(session.project, ("render", "transport"), "direct")
    world = build_world(project.scene, FOLDER)
    frame = render_world(
        world, project.scene, settings=project.render, axis=project.extraction.axis, run=Run(threads=2)
    )
    session.add_render(Render(1, session.project, world, frame))
    view, develop, results = CameraView(session), DevelopPanel(session), ResultsPanel(session)
    for widget in (view, develop, results):
        qtbot.addWidget(widget)
        widget.resize(800, 700)
    view.show()
    results.show()
    qtbot.waitExposed(view)
    with qtbot.waitSignal(session.measured, timeout=20000):
        develop.refresh()
    yield session, view, results
    for widget in (view, develop, results):
        widget.close()
    live(session).close()


def test_a_field_of_a_laser_is_of_that_laser() -> None:
    assert laser_of((*LASERS, 1, "T_rig_laser", "translation")) == 1
    assert laser_of(LASERS) is None and laser_of(()) is None and laser_of(("scene", "objects", 1, "name")) is None


def test_choosing_a_laser_selects_it_and_every_other_box_follows(qtbot: QtBot, session: Session) -> None:
    boxes = [LaserBox(session) for _ in range(2)]
    for box in boxes:
        qtbot.addWidget(box)
        box.show_names(["laser", "second"])
    with qtbot.waitSignal(boxes[1].chosen):
        boxes[0].activated.emit(1)
    assert session.selection == (*LASERS, 1) and [box.laser for box in boxes] == [1, 1]
    session.select(("scene", "rig", "camera"))
    assert boxes[0].laser == 1
    boxes[0].show_names(["laser"])
    assert boxes[0].laser == 0 and boxes[0].isHidden()


def test_picture_row_profile_and_results_follow_the_laser_that_is_selected(
    qtbot: QtBot, rendered: tuple[Session, CameraView, ResultsPanel]
) -> None:
    session, view, results = rendered
    assert view.choice.currentText() == "Image, laser" and view.profile.laser == 0 and results.laser.laser == 0
    points = next(iter(results.shown().values()))
    session.select((*LASERS, 1))
    assert view.choice.currentText() == "Image, second" and view.profile.laser == 1
    assert results.laser.currentText() == "second"
    assert next(iter(results.shown().values())) is not points
    # what is of no laser stays
    depth = view.choice.findText("Depth")
    view.choice.setCurrentIndex(depth)
    view.choice.activated.emit(depth)
    session.select((*LASERS, 0))
    assert view.choice.currentText() == "Depth" and results.laser.currentText() == "laser"
    light = view.choice.findText("Light of laser")
    view.choice.setCurrentIndex(light)
    view.choice.activated.emit(light)
    results.laser.activated.emit(1)
    assert view.choice.currentText() == "Light of second" and session.selection == (*LASERS, 1)


def test_a_measure_stays_on_its_laser_in_a_render_from_before_another_was_deleted(
    qtbot: QtBot, rendered: tuple[Session, CameraView, ResultsPanel]
) -> None:
    session, view, results = rendered
    gauges = [
        Gauge(name=f"of {laser}", kind="radius", laser=laser, regions=((-0.02 + 0.001 * laser, 0.02),))
        for laser in range(2)
    ]
    session.set(("measures",), tuple(gauges))
    first, second = (one.value for one in results.part.readings)
    assert first != second
    session.select((*LASERS, 1))
    project, path = remove(session.project, (*LASERS, 0))
    session.document.apply("delete laser", project)
    session.select(path)
    # what is left is called as it was, by the panels of the render with both too
    assert [laser.name for laser in session.project.scene.lasers] == ["second"]
    assert [one.value for one in results.part.readings] == [second]
    assert results.laser.currentText() == "second" and view.choice.currentText() != "Image, laser"
    # a measure of the laser that is gone cannot be added
    results.laser.activated.emit(0)
    assert results.laser.currentText() == "laser"
    with qtbot.waitSignal(session.message) as told:
        results.part.start("radius")
    assert "no longer in the project" in told.args[1] and results.part.placing is None
    session.document.undo()
    assert [one.value for one in results.part.readings] == [first, second]
