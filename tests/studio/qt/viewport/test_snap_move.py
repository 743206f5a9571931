"""V: by a corner or a face onto another corner, a face or the ground, exactly, and one step to undo."""

from __future__ import annotations

import numpy as np
import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from render.base.pose import transform_points
from render.scene.shape import Box
from studio.editing import scene_edits
from studio.editing.scene_edits import OBJECTS
from studio.preview.ray_pick import spot_at
from studio.qt.viewport.snap_move import PUT, TAKE
from studio.qt.viewport.viewport import Viewport
from tests.studio.qt.viewport.viewport_hands import pixel

BOX, OTHER = (*OBJECTS, 1), (*OBJECTS, 2)


@pytest.fixture
def two(viewport: Viewport, qtbot: QtBot) -> Viewport:
    """Two boxes that stand apart, high above the plane, seen at an angle; the first is selected."""
    project = viewport.session.project
    for shift in (-0.1, 0.1):
        project, path = scene_edits.add_primitive(project, Box)
        pose = scene_edits.value_at(project, path).T_world_object.model_copy(update={"translation": (shift, 0.0, 0.2)})
        project = scene_edits.replaced(project, (*path, "T_world_object"), pose)
    viewport.session.document.apply("add boxes", project)
    viewport.session.select(BOX)
    qtbot.waitUntil(lambda: len(viewport.live.look.placed) == 3)
    viewport.frame(BOX)
    viewport.view.look_from(viewport.view.eye.zoom(0.2, 350, 280, viewport.view.pixels))
    return viewport


def corners(viewport: Viewport, index: int) -> np.ndarray:
    placed = next(one for one in viewport.live.look.placed if one.index == index)
    surface = placed.body.surface
    return np.unique(transform_points(placed.T_world_object, surface.vertices).round(9), axis=0)


def top_corner(viewport: Viewport, index: int) -> np.ndarray:
    """The corner of the upper face that is nearest to the eye: it is seen, whatever stands behind."""
    there = corners(viewport, index)
    upper = there[there[:, 2] > there[:, 2].max() - 1e-6]
    return upper[np.argmin(np.linalg.norm(upper - viewport.view.eye.position, axis=1))]


def inside(viewport: Viewport, index: int, corner: np.ndarray) -> np.ndarray:
    """A place on the upper face, a few pixels from its corner."""
    there = corners(viewport, index)
    middle = there[there[:, 2] > there[:, 2].max() - 1e-6].mean(axis=0)
    return corner + 0.08 * (middle - corner)


def click(viewport: Viewport, point: np.ndarray) -> None:
    QTest.mouseClick(viewport.view, Qt.MouseButton.LeftButton, pos=pixel(viewport, point).toPoint())
    QApplication.processEvents()


def place(viewport: Viewport) -> np.ndarray:
    return np.array(viewport.session.project.scene.objects[1].T_world_object.translation)


def test_a_corner_goes_exactly_onto_another(two: Viewport) -> None:
    before, take, put = place(two), top_corner(two, 1), top_corner(two, 2)
    told = []
    two.snap.told.connect(told.append)
    QTest.keyClick(two.view, "v")
    click(two, inside(two, 1, take))
    assert told[0] == TAKE and PUT in told
    click(two, inside(two, 2, put))
    np.testing.assert_allclose(place(two) - before, put - take, atol=2e-9)
    assert not two.snap.active and told[-1] == ""
    assert two.session.document.undo_label == "move box"
    two.session.document.undo()
    assert np.array_equal(place(two), before)


def test_a_face_goes_onto_a_face_where_it_was_clicked(two: Viewport) -> None:
    before = place(two)
    middles = [corners(two, index).mean(axis=0) for index in (1, 2)]
    for middle, index in zip(middles, (1, 2), strict=True):
        middle[2] = corners(two, index)[:, 2].max()
    QTest.keyClick(two.view, "v")
    for middle in middles:
        click(two, middle)
    # to the pixel
    near = 1.5 * two.view.eye.metres_per_pixel(middles[1], two.view.pixels)
    np.testing.assert_allclose(place(two) - before, middles[1] - middles[0], atol=3.0 * near)
    assert abs((place(two) - before)[2]) < 1e-6


def test_where_nothing_stands_it_goes_onto_the_ground(two: Viewport, qtbot: QtBot) -> None:
    session = two.session
    session.document.apply("without the plane", scene_edits.remove(session.project, (*OBJECTS, 0))[0])
    session.select((*OBJECTS, 0))
    qtbot.waitUntil(lambda: len(two.live.look.placed) == 2)
    free = (8.0, two.view.pixels[1] - 8.0)
    spot = spot_at(two.live.look, two.view.eye, free, two.view.pixels, ground=0.0)
    assert spot is not None and spot.kind == "ground"
    assert spot_at(two.live.look, two.view.eye, free, two.view.pixels) is None
    take = top_corner(two, 0)
    before = np.array(session.project.scene.objects[0].T_world_object.translation)
    QTest.keyClick(two.view, "v")
    click(two, inside(two, 0, take))
    QTest.mouseClick(two.view, Qt.MouseButton.LeftButton, pos=QPoint(int(free[0]), int(free[1])))
    after = np.array(session.project.scene.objects[0].T_world_object.translation)
    assert take[2] + after[2] - before[2] == pytest.approx(0.0, abs=2e-9)
    np.testing.assert_allclose(take + after - before, spot.point, atol=2e-9)


def test_a_laser_is_taken_by_its_origin(two: Viewport) -> None:
    two.session.select(("scene", "rig", "lasers", 0))
    put = top_corner(two, 2)
    QTest.keyClick(two.view, "v")
    click(two, inside(two, 2, put))
    np.testing.assert_allclose(two.session.project.scene.T_world_laser(0)[:3, 3], put, atol=3e-9)


def test_another_tool_takes_its_place(two: Viewport) -> None:
    QTest.keyClick(two.view, "v")
    QTest.keyClick(two.view, "b")
    assert two.box.active and not two.snap.active
    QTest.keyClick(two.view, "v")
    assert two.snap.active and not two.box.active
    QTest.keyClick(two.view, "v")
    assert not two.snap.active and two.view.tool is not None


def test_escape_gives_up_and_a_miss_is_told(two: Viewport) -> None:
    before, messages = place(two), []
    two.session.message.connect(lambda level, text: messages.append(text))
    QTest.keyClick(two.view, "v")
    click(two, top_corner(two, 2) + np.array([0.0, 0.0, 0.01]))
    assert messages == ["that is no place of what is selected"] and two.snap.active
    QTest.keyClick(two.view, Qt.Key.Key_Escape)
    assert not two.snap.active and two.view.tool is not None and np.array_equal(place(two), before)
    two.session.select(())
    QTest.keyClick(two.view, "v")
    assert "nothing that can be moved" in messages[-1] and not two.snap.active
