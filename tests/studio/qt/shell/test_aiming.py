"""Aiming a laser: a click in the 3D view or in the camera's picture, and Escape from wherever the keys go."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from PySide6.QtCore import QPointF, Qt
from pytestqt.qtbot import QtBot

from studio.qt.core.live_preview import live
from studio.qt.shell.window import MainWindow
from tests.studio.qt.shell.window_hands import until_cancelled

LASER = ("scene", "rig", "lasers", 0)


@pytest.fixture
def viewport(window: MainWindow, qtbot: QtBot) -> Any:
    window.activateWindow()
    qtbot.waitUntil(window.isActiveWindow)
    there = len(window.session.project.scene.visible_objects)
    qtbot.waitUntil(lambda: len(live(window.session).look.placed) == there, timeout=60000)
    return window.panels["viewport"]


def click_picture(window: MainWindow, qtbot: QtBot, column: float, row: float) -> None:
    view = window.panels["camera"].view  # type: ignore[attr-defined]
    where = view.mapFromScene(view.box.mapViewToScene(QPointF(column, row)))
    qtbot.mouseClick(view.viewport(), Qt.MouseButton.LeftButton, pos=where)


@pytest.mark.parametrize("focus", ["scene", "inspector", "camera", "viewport"])
def test_escape_ends_aim_wherever_the_keys_go(window: MainWindow, viewport: Any, qtbot: QtBot, focus: str) -> None:
    window.session.select(LASER)
    viewport.begin_aim()
    panel: Any = window.panels[focus]
    target = {"scene": panel, "inspector": panel, "camera": getattr(panel, "view", None), "viewport": viewport.view}
    target[focus].setFocus()
    qtbot.keyClick(window.focusWidget() or window, Qt.Key.Key_Escape)
    assert not viewport.bar.aim.isChecked()


def test_escape_ends_aim_before_it_tells_how_a_job_is_stopped(window: MainWindow, viewport: Any, qtbot: QtBot) -> None:
    told: list[str] = []
    window.session.message.connect(lambda level, text: told.append(text))
    window.runner.run("render", "render", until_cancelled)
    qtbot.waitUntil(lambda: window.status.job is not None)
    viewport.begin_aim()
    for expected in (0, 1):
        qtbot.keyClick(window, Qt.Key.Key_Escape)
        assert not viewport.bar.aim.isChecked()
        assert sum("does not stop" in text for text in told) == expected


@pytest.mark.parametrize("mode", ["box", "snap", "typed"])
def test_escape_ends_what_waits_for_a_click_or_a_number(
    window: MainWindow, viewport: Any, qtbot: QtBot, mode: str
) -> None:
    window.session.select(("scene", "objects", 0))
    before = window.session.project
    waiting = getattr(viewport, mode)
    waiting.begin(*((False,) if mode == "typed" else ()))
    assert waiting.active
    qtbot.keyClick(window, Qt.Key.Key_Escape)
    assert not waiting.active and window.session.project.scene == before.scene


def test_a_click_in_the_camera_view_aims_at_the_surface_under_that_pixel(
    window: MainWindow, viewport: Any, qtbot: QtBot
) -> None:
    session, told = window.session, []
    session.message.connect(lambda level, text: told.append(text))
    scene = session.project.scene
    seen = np.argwhere(live(session).look.image(seconds=1.0).object_id >= 0)
    scale = live(session).look.image(seconds=1.0).scale
    row, column = (round(float(at)) for at in (np.median(seen, axis=0) + 0.5) / scale - 0.5)
    click_picture(window, qtbot, column, row)
    assert session.project.scene == scene, "a click means nothing while nobody aims"
    viewport.begin_aim()
    click_picture(window, qtbot, column, row)
    assert not viewport.bar.aim.isChecked(), told
    qtbot.waitUntil(lambda: live(session).look.project is session.project)
    # the laser's axis meets the pixel's surface: the camera sees that point where the click was, to half a screen pixel
    look = live(session).look
    image = look.image(seconds=1.0)
    i, j = (min(int((at + 0.5) * image.scale), side - 1) for at, side in
            zip((row, column), image.depth_z.shape, strict=True))  # fmt: skip
    camera, axis = look.scene.camera, look.scene.T_camera_laser(0)
    depth = float(image.depth_z[i, j])
    lit, valid = camera.project(axis[:3, 3] + axis[:3, 2] * (depth - axis[2, 3]) / axis[2, 2])
    zoom = window.panels["camera"].view.zoom  # type: ignore[attr-defined]
    assert valid and np.abs(lit - (column, row)).max() < 1.0 / zoom + 2.0 / image.scale
    assert session.selection == LASER
    session.document.undo()
    assert session.project.scene == scene


def test_a_picture_of_the_scene_before_is_not_aimed_by(window: MainWindow, viewport: Any, qtbot: QtBot) -> None:
    told: list[str] = []
    window.session.message.connect(lambda level, text: told.append(text))
    before = window.session.project
    viewport.begin_aim()
    window.session.pixel_clicked.emit(10.0, 10.0, False)
    assert viewport.bar.aim.isChecked() and window.session.project is before
    assert "live estimate" in told[-1]


def test_another_workspace_ends_aim(window: MainWindow, viewport: Any) -> None:
    viewport.begin_aim()
    window.switch_to("render")
    assert not viewport.bar.aim.isChecked()
