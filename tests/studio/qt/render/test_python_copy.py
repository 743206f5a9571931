"""Copy as Python: what is on the clipboard gives what is on the screen."""

from __future__ import annotations

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QApplication, QMenu

from render.render import render_world
from render.run import Run
from render.world.world import build_world
from studio.project.document import Document
from studio.qt.core.session import Render, Session
from studio.qt.render import history
from studio.qt.render.develop_panel import DevelopPanel
from studio.qt.render.python_copy import copy_as_python
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
