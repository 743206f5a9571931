"""G and R: by mouse or number along or about an axis, one undo, and no key does anything else meanwhile."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from render.base.pose import rotation_matrix
from studio.preview.gizmo_geometry import Drag
from studio.qt.viewport.viewport import Viewport

SAMPLE = Path(__file__).parents[4] / "assets/projects/plane/project.json"
LASER = ("scene", "rig", "lasers", 0)


@pytest.fixture(autouse=True)
def selected(viewport: Viewport) -> None:
    viewport.session.select(LASER)


def type_keys(viewport: Viewport, text: str) -> None:
    """One key after the other, as from a keyboard; < is Backspace, ! Escape, $ Return."""
    named = {"<": Qt.Key.Key_Backspace, "!": Qt.Key.Key_Escape, "$": Qt.Key.Key_Return}
    for letter in text:
        QTest.keyClick(viewport.view, named.get(letter, letter))
        QApplication.processEvents()


def laser_in_world(viewport: Viewport) -> np.ndarray:
    return viewport.session.project.scene.T_world_laser(0)


@pytest.mark.parametrize(
    ("keys", "offset"),
    [("gx50$", (0.05, 0.0, 0.0)), ("gz-1.5$", (0.0, 0.0, -0.0015)), ("g2<30$", (0.03, 0.0, 0.0)),
     ("gy100+2*25$", (0.0, 0.15, 0.0)), ("gx50y$", (0.0, 0.05, 0.0)), ("gx5x!", (0.0, 0.0, 0.0))],
)  # fmt: skip
def test_a_number_moves_by_as_much(viewport: Viewport, keys: str, offset: tuple[float, float, float]) -> None:
    before, eye = laser_in_world(viewport), viewport.view.eye
    type_keys(viewport, keys)
    after = laser_in_world(viewport)
    np.testing.assert_allclose(after[:3, 3] - before[:3, 3], offset, atol=2e-9)
    np.testing.assert_allclose(after[:3, :3], before[:3, :3], atol=1e-12)
    # 1 to 5 are views and X the gizmo's axes, but not while a number is typed
    assert viewport.view.eye is eye and not viewport.gizmo.local and not viewport.typed.active
    if any(offset):
        assert viewport.session.document.undo_label == "move laser"
        viewport.session.document.undo()
        np.testing.assert_allclose(laser_in_world(viewport), before, atol=1e-12)


def test_the_axis_twice_is_the_items_own(viewport: Viewport) -> None:
    before = laser_in_world(viewport)
    type_keys(viewport, "gzz20$")
    moved = laser_in_world(viewport)[:3, 3] - before[:3, 3]
    np.testing.assert_allclose(moved, 0.02 * before[:3, 2], atol=2e-9)


def test_r_turns_by_degrees_about_where_it_stands(viewport: Viewport) -> None:
    before = laser_in_world(viewport)
    type_keys(viewport, "rz-30$")
    after = laser_in_world(viewport)
    np.testing.assert_allclose(after[:3, 3], before[:3, 3], atol=1e-12)
    turned = rotation_matrix(np.array([0.0, 0.0, -math.radians(30.0)])) @ before[:3, :3]
    np.testing.assert_allclose(after[:3, :3], turned, atol=1e-6)


def test_escape_leaves_neither_a_change_nor_an_undo(viewport: Viewport) -> None:
    project = viewport.session.project
    type_keys(viewport, "gx50!")
    assert viewport.session.project == project and viewport.session.document.undo_label is None
    assert not viewport.session.dragging and viewport.view.tool is not None


def test_it_follows_the_mouse_along_the_axis_until_a_click(viewport: Viewport) -> None:
    before = laser_in_world(viewport)
    type_keys(viewport, "gx")
    start = viewport.typed._drag
    assert start is not None
    eye, size = viewport.view.eye, viewport.view.pixels
    pixel = eye.project(np.stack([before[:3, 3], before[:3, 3] + (0.04, 0.0, 0.0)]), size)
    # what lies under the mouse when the key is pressed goes with it
    viewport.typed._drag = Drag(start.frame, start.handle, *eye.ray(*pixel[0], size))
    viewport.view.hovered.emit(*pixel[1])
    np.testing.assert_allclose(laser_in_world(viewport)[:3, 3] - before[:3, 3], (0.04, 0.0, 0.0), atol=1e-6)
    viewport.view.clicked.emit(*pixel[1])
    assert not viewport.typed.active and viewport.session.selection == LASER


def test_a_command_ends_it_and_nothing_selected_says_so(viewport: Viewport) -> None:
    type_keys(viewport, "gx50")
    QTest.keyClick(viewport.view, Qt.Key.Key_S, Qt.KeyboardModifier.ControlModifier)
    assert not viewport.typed.active and viewport.session.document.undo_label == "move laser"
    told: list[str] = []
    viewport.session.message.connect(lambda level, text: told.append(text))
    viewport.session.select(())
    type_keys(viewport, "g")
    assert told == ["nothing that can be moved is selected; click on it"] and not viewport.typed.active
