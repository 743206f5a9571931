"""Several items selected at once: they move and turn as one, are copied and deleted together, in one step of undo."""

from __future__ import annotations

import numpy as np
import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from render.base.pose import invert
from render.scene.shape import Box
from studio.editing import scene_edits
from studio.editing.scene_edits import OBJECTS
from studio.qt.scene import scene_actions
from studio.qt.viewport.viewport import Viewport
from tests.studio.qt.viewport.viewport_hands import pixel

RIG, LASER = ("scene", "rig"), ("scene", "rig", "lasers", 0)


@pytest.fixture
def two(viewport: Viewport, qtbot: QtBot) -> Viewport:
    """The plane, and two boxes apart from each other, which are selected."""
    project = viewport.session.project
    for shift in (0.0, 0.1):
        project, path = scene_edits.add_primitive(project, Box)
        pose = scene_edits.value_at(project, path).T_world_object
        x, y, z = pose.translation
        project = scene_edits.replaced(
            project, (*path, "T_world_object"), pose.model_copy(update={"translation": (x + shift, y, z)})
        )
    viewport.session.document.apply("add boxes", project)
    viewport.session.document.end_merge()
    viewport.session.select_all([(*OBJECTS, 1), (*OBJECTS, 2)])
    qtbot.waitUntil(lambda: len(viewport.live.look.placed) == 3)
    return viewport


def pose(viewport: Viewport, index: int) -> np.ndarray:
    return np.asarray(viewport.session.project.scene.objects[index].T_world_object.matrix)


def type_keys(viewport: Viewport, text: str) -> None:
    for letter in text:
        QTest.keyClick(viewport.view, Qt.Key.Key_Return if letter == "$" else letter)
        QApplication.processEvents()


def spot(viewport: Viewport, index: int) -> QPoint:
    """Where the view shows an object and nothing before it, unless it is a handle."""
    middle = pixel(viewport, pose(viewport, index)[:3, 3]).toPoint()
    around = [QPoint(x, y) for x in range(-24, 25, 4) for y in range(-24, 25, 4)]
    return next(p for p in (middle + d for d in around) if viewport.path_at(p.x(), p.y()) == (*OBJECTS, index))


def test_they_move_by_as_much_in_one_step_of_undo(two: Viewport) -> None:
    before = [pose(two, i) for i in range(3)]
    type_keys(two, "gx50$")
    after = [pose(two, i) for i in range(3)]
    np.testing.assert_allclose([b[:3, 3] - a[:3, 3] for a, b in zip(before, after, strict=True)],
                               [[0, 0, 0], [0.05, 0, 0], [0.05, 0, 0]], atol=2e-9)  # fmt: skip
    assert two.session.document.undo_label == "move 2 items"
    two.session.document.undo()
    assert all(np.array_equal(pose(two, i), before[i]) for i in range(3))


def test_they_turn_about_the_one_that_was_selected_last(two: Viewport) -> None:
    before = [pose(two, i) for i in range(3)]
    type_keys(two, "rz90$")
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    apart = before[1][:3, 3] - before[2][:3, 3]
    np.testing.assert_allclose(pose(two, 2)[:3, 3], before[2][:3, 3], atol=2e-9)
    np.testing.assert_allclose(pose(two, 1)[:3, 3], before[2][:3, 3] + turn @ apart, atol=2e-9)
    # as a rigid body: the one seen from the other stays
    np.testing.assert_allclose(
        invert(pose(two, 2)) @ pose(two, 1), invert(before[2]) @ before[1], atol=1e-8
    )  # fmt: skip
    two.session.document.undo()
    assert np.array_equal(pose(two, 1), before[1])


def test_who_is_carried_by_another_is_not_moved_twice(viewport: Viewport) -> None:
    session = viewport.session
    session.select_all([RIG, LASER])
    before = session.project.scene.T_world_laser(0)
    type_keys(viewport, "gy20$")
    np.testing.assert_allclose(session.project.scene.T_world_laser(0)[:3, 3] - before[:3, 3], [0, 0.02, 0], atol=2e-9)


def test_escape_puts_all_of_them_back(two: Viewport) -> None:
    before = [pose(two, i) for i in range(3)]
    type_keys(two, "gz5")
    assert not np.array_equal(pose(two, 1), before[1])
    QTest.keyClick(two.view, Qt.Key.Key_Escape)
    assert all(np.array_equal(pose(two, i), before[i]) for i in range(3))


def test_a_click_with_ctrl_takes_one_more_or_one_less(two: Viewport) -> None:
    session = two.session
    session.select(())
    two.frame()
    for index, expected in ((1, [1]), (2, [1, 2]), (1, [2])):
        QTest.mouseClick(two.view, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.ControlModifier, spot(two, index))
        QApplication.processEvents()
        assert list(session.selections) == [(*OBJECTS, one) for one in expected]


def test_copies_and_deletes_are_of_all(two: Viewport) -> None:
    session = two.session
    scene_actions.duplicate(session)
    names = [item.name for item in session.project.scene.objects]
    assert names[1:] == ["box", "box 4", "box 2", "box 3"]
    assert [session.project.scene.objects[int(path[2])].name for path in session.selections] == ["box 4", "box 3"]
    scene_actions.toggle_visible(session)
    assert [item.visible for item in session.project.scene.objects] == [True, True, False, True, False]
    session.document.undo()
    scene_actions.remove(session)
    assert [item.name for item in session.project.scene.objects][1:] == ["box", "box 2"]
    assert session.document.undo_label == "delete 2 items"
    session.document.undo()
    session.document.undo()
    # the copies are there no longer, and so are not selected
    assert all(int(path[2]) < 3 for path in session.selections)
