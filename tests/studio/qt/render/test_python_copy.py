"""Copy as Python: what is on the clipboard gives what is on the screen."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QApplication, QMenu

from render.render import render_world
from render.run import Run
from render.scene.shape import MeshFile
from render.world.world import build_world
from studio.project.document import Document
from studio.qt.core.render import Render
from studio.qt.core.session import Session
from studio.qt.render import history
from studio.qt.render.develop_panel import DevelopPanel
from studio.qt.render.python_copy import copy_as_python, copy_shown
from studio.scan.render_goal import goal_of
from tests.studio.qt.render.test_develop_panel import settle
from tests.studio.qt.small_session import FOLDER, small_project


@pytest.fixture
def session():
    project = small_project().replaced({"render.ambient_samples": 1, "render.transport": "direct"})
    world = build_world(project.scene, FOLDER)
    settings, axis = project.render, project.extraction.axis
    run = Run(seed=project.seed, goal=goal_of(project))
    frame = render_world(world, project.scene, settings=settings, axis=axis, run=run)
    made = Session(Document(project, root=FOLDER))
    made.add_render(Render(1, project, world, frame))
    return made


def copied():
    names = {}
    exec(QApplication.clipboard().text(), names)
    return names


def test_the_lines_give_the_line_and_the_errors_on_the_screen(qtbot, session):
    panel = DevelopPanel(session)
    qtbot.addWidget(panel)
    session.set(("sensor", "exposure_time"), 2.0 * session.project.sensor.exposure_time)
    panel.noise.setChecked(False)
    settle(qtbot, panel)
    told = []
    session.message.connect(lambda level, text: told.append((level, text)))
    copy_as_python(session, session.shown)
    assert told == [("info", f"Copied {len(QApplication.clipboard().text().splitlines())} lines of Python")]
    names, measured = copied(), session.shown.measurements
    assert len(measured) == 3
    for method, name in (("likelihood", "errors"), ("gaussian", "errors_gaussian")):
        shown = measured[method][0]
        np.testing.assert_array_equal(names[name].points.line.u, shown.line.u)
        assert names[name].depth_z == shown.errors.depth_z
    panel.close()


def test_before_a_render_the_lines_make_one_of_the_step_that_is_looked_at():
    session = Session(Document(small_project(), root=FOLDER))
    copy_as_python(session, session.shown)
    text = QApplication.clipboard().text()
    assert 'load("sphere")' in text and text.index("blazer.render(") < text.index("blazer.compare(")


def test_a_project_that_has_changed_since_is_copied_as_it_is_now(qtbot, session):
    told = []
    session.message.connect(lambda level, text: told.append((level, text)))
    copy_shown(session)
    assert "compare" in QApplication.clipboard().text() and "changed" not in told[-1][1]
    pose = ("scene", "objects", 0, "T_world_object", "translation")
    session.set(pose, (0.01234, 0.0, 0.0))
    copy_shown(session)
    assert "0.01234" in QApplication.clipboard().text()
    assert told[-1][0] == "info" and "as it is now, which has changed since the render" in told[-1][1]


def test_what_an_unsaved_project_reads_is_said_to_go_with_the_window(tmp_path):
    trimesh.creation.box((10, 10, 10)).export(tmp_path / "part.stl")
    project = small_project()
    part = project.scene.objects[0].model_copy(update={"shape": MeshFile(path="part.stl", unit="mm")})
    scene = project.scene.model_copy(update={"objects": (part, *project.scene.objects[1:])})
    session, told = Session(Document(project.model_copy(update={"scene": scene}), root=tmp_path)), []
    session.message.connect(lambda level, text: told.append((level, text)))
    copy_shown(session)
    assert told[-1][0] == "warning" and "save it, then copy again" in told[-1][1]


def test_the_history_copies_the_render_that_was_clicked(qtbot, session, monkeypatch):
    class Clicked(QMenu):
        """Where a person would choose."""

        def exec(self, at):
            (chosen,) = (action for action in self.actions() if action.text() == "Copy as Python")
            chosen.trigger()

    monkeypatch.setattr(history, "QMenu", Clicked)
    panel = history.History(session)
    qtbot.addWidget(panel)
    session.set(("seed",), 11)
    panel._menu(panel.list.visualItemRect(panel.list.item(0)).center())
    assert 'developed = project.replaced({"seed": 11})' in QApplication.clipboard().text()


def test_the_shortcut_copies_the_open_project_by_its_file(qtbot, window):
    QApplication.clipboard().clear()
    qtbot.keyClick(window, Qt.Key.Key_C, Qt.KeyboardModifier.ControlModifier | Qt.KeyboardModifier.ShiftModifier)
    qtbot.waitUntil(lambda: "steps.json" in QApplication.clipboard().text())
    assert ".replaced(" not in QApplication.clipboard().text()
