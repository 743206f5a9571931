"""A session on a small sphere, and a render of it, for the tests of the panels."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache

from pytestqt.qtbot import QtBot

from render.frame import Frame
from render.render import render_world
from render.run import Run
from render.world.world import World, build_world
from studio.project.document import Document, replaced
from studio.project.project import Project
from studio.project.templates import template_folder
from studio.qt.core.live_preview import live
from studio.qt.core.render import Render
from studio.qt.core.session import Session
from studio.qt.image.camera_view import CameraView
from studio.qt.render.develop_panel import DevelopPanel
from studio.qt.results.results_panel import ResultsPanel
from studio.scan.redevelop import develop_again, development, measure_again
from studio.scan.stages import Measurement, scaled

FOLDER = template_folder("sphere")


@lru_cache(maxsize=1)
def small_project() -> Project:
    """The sphere at 306 x 256 px, for the errors of the image, so that everything takes milliseconds."""
    return replaced(scaled(Project.load(FOLDER / "project.json"), 0.125), ("render", "goal"), None)


@lru_cache(maxsize=1)
def small_render() -> tuple[World, Frame]:
    project = small_project()
    world = build_world(project.scene, FOLDER)
    settings = project.render.model_copy(update={"ambient_samples": 4})
    run = Run(seed=project.seed)
    return world, render_world(world, project.scene, settings=settings, axis=project.extraction.axis, run=run)


@lru_cache(maxsize=1)
def small_measurements() -> dict[str, list[Measurement]]:
    project, (world, frame) = small_project(), small_render()
    how = development(project, project)
    images = develop_again(frame, how)
    return measure_again(frame, world, how, images, ("likelihood",), cancelled=lambda: False)


def small_session(rendered: bool = False) -> Session:
    session = Session(Document(small_project(), root=FOLDER))
    if rendered:
        world, frame = small_render()
        session.add_render(Render(1, small_project(), world, frame))
    return session


def measured_results(qtbot: QtBot) -> ResultsPanel:
    """The results of a session with a render, on the screen, measured by maximum likelihood."""
    session = small_session(rendered=True)
    assert session.shown is not None
    session.shown.measurements = small_measurements()
    panel = ResultsPanel(session)
    qtbot.addWidget(panel)
    panel.resize(1366, 420)
    panel.show()
    qtbot.waitExposed(panel)
    return panel


@contextmanager
def measured_view(qtbot: QtBot) -> Iterator[CameraView]:
    """The camera view of a session with a render, on the screen, developed and measured."""
    session = small_session(rendered=True)
    view, develop = CameraView(session), DevelopPanel(session)
    qtbot.addWidget(view)
    qtbot.addWidget(develop)
    view.resize(800, 700)
    view.show()
    qtbot.waitExposed(view)
    with qtbot.waitSignal(session.measured, timeout=20000):
        develop.refresh()
    qtbot.waitUntil(lambda: not view.runner.busy)
    yield view
    view.close()
    develop.close()
    live(session).close()
