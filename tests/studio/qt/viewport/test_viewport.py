"""The 3D viewport: what is drawn, how it is looked at, and what a click selects; with real mouse and keys."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtGui import QWheelEvent
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from render.base.pose import Pose
from render.scene.motion import LinearStage, NoMotion, Turntable
from render.scene.shape import Box
from studio.editing.placement import target
from studio.editing.units import SHOWN
from studio.project.document import Document, replaced
from studio.project.project import Project
from studio.project.templates import template_folder
from studio.qt.core import theme
from studio.qt.core.session import Session
from studio.qt.viewport.viewport import Viewport
from tests.studio.qt.viewport.viewport_hands import pixel

SAMPLE = Path(__file__).parents[4] / "assets/projects/plane/project.json"
CAMERA, LASER, PLATE, BOX = (
    ("scene", "rig", "camera"),
    ("scene", "rig", "lasers", 0),
    ("scene", "objects", 0),
    ("scene", "objects", 1),
)


def project_with_box() -> Project:
    """The tilted plane and a small box before it."""
    project = Project.load(SAMPLE)
    place = target(project.scene) - 0.1 * project.scene.T_world_camera()[:3, 2]
    item = project.scene.objects[0].model_copy(
        update={
            "name": "box",
            "shape": Box(size_x=0.05, size_y=0.05, size_z=0.05),
            "T_world_object": Pose(translation=tuple(place.tolist())),
        }
    )
    return replaced(project, ("scene", "objects"), (*project.scene.objects, item))


@pytest.fixture
def viewport(qtbot: QtBot) -> Iterator[Viewport]:
    theme.apply("dark")
    made = Viewport(Session(Document(project_with_box(), SAMPLE)))
    made.resize(640, 480)
    qtbot.addWidget(made)
    made.show()
    # keys need an active window, which no window manager makes one here
    made.activateWindow()
    made.view.setFocus()
    qtbot.waitUntil(lambda: len(made.live.look.placed) == 2 and made.view.paints > 0, timeout=10_000)
    yield made
    made.close()


def on_screen(viewport: Viewport, point: np.ndarray) -> QPoint:
    x, y = viewport.view.eye.project(point, viewport.view.pixels)[0]
    return QPoint(round(x), round(y))


def middle_of(viewport: Viewport, visible_index: int) -> np.ndarray:
    item = viewport.live.look.placed[visible_index]
    return item.T_world_object[:3, 3]


def picture(viewport: Viewport) -> np.ndarray:
    image = viewport.view.grab().toImage().convertToFormat(viewport.view.grab().toImage().Format.Format_RGB888)
    rows = np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), image.bytesPerLine())
    return rows[:, : 3 * image.width()].reshape(image.height(), image.width(), 3).astype(int)


def share_of(colour: tuple[int, int, int], image: np.ndarray, within: int = 40) -> float:
    return float(np.mean(np.abs(image - colour).max(axis=2) < within))


def test_a_click_aims_the_laser_at_the_surface_there(viewport: Viewport, qtbot: QtBot) -> None:
    session, view = viewport.session, viewport.view
    viewport.frame(BOX)
    before = session.project.scene.lasers[0].T_rig_laser
    at = on_screen(viewport, middle_of(viewport, 1)) + QPoint(9, -6)
    qtbot.keyClick(view, Qt.Key.Key_T)
    assert viewport.bar.aim.isChecked()
    qtbot.mouseClick(view, Qt.MouseButton.LeftButton, pos=at)
    laser = session.project.scene.T_world_laser(0)
    assert session.project.scene.lasers[0].T_rig_laser.translation == before.translation
    assert session.selection == LASER and not viewport.bar.aim.isChecked()
    # the ray of the laser's axis and that of the mouse meet on the box
    origin, direction = view.eye.ray(at.x(), at.y(), view.pixels)
    normal = np.cross(direction, laser[:3, 2])
    apart = abs(float((laser[:3, 3] - origin) @ normal)) / np.linalg.norm(normal)
    assert apart < 1e-6
    session.document.undo()
    assert session.project.scene.lasers[0].T_rig_laser == before


def test_an_aim_at_nothing_is_told_and_another_press_ends_it(viewport: Viewport, qtbot: QtBot) -> None:
    session, view, told = viewport.session, viewport.view, []
    session.message.connect(lambda level, text: told.append(level))
    before = session.project
    viewport.begin_aim()
    qtbot.mouseClick(view, Qt.MouseButton.LeftButton, pos=QPoint(3, 3))
    assert told == ["error"] and session.project is before and viewport.bar.aim.isChecked()
    qtbot.keyClick(view, Qt.Key.Key_T)
    assert not viewport.bar.aim.isChecked()
    session.set(("scene", "rig", "lasers"), (), "no lasers")
    qtbot.keyClick(view, Qt.Key.Key_T)
    assert told[-1] == "error" and not viewport.bar.aim.isChecked()


def test_a_click_selects_what_is_under_the_mouse(viewport: Viewport, qtbot: QtBot) -> None:
    session, view = viewport.session, viewport.view
    viewport.frame(BOX)
    qtbot.mouseClick(view, Qt.MouseButton.LeftButton, pos=on_screen(viewport, middle_of(viewport, 1)))
    assert session.selection == BOX
    viewport.frame()
    T = session.project.scene.T_world_laser(0)
    behind = T[:3, 3] - 0.5 * viewport.scene.size * T[:3, 2]
    qtbot.mouseClick(view, Qt.MouseButton.LeftButton, pos=on_screen(viewport, behind))
    assert session.selection == LASER
    qtbot.mouseClick(view, Qt.MouseButton.LeftButton, pos=QPoint(3, 3))
    assert session.selection == ()


def test_a_double_click_selects_and_frames(viewport: Viewport, qtbot: QtBot) -> None:
    viewport.frame()
    far = viewport.view.eye.distance
    qtbot.mouseDClick(viewport.view, Qt.MouseButton.LeftButton, pos=on_screen(viewport, middle_of(viewport, 1)))
    assert viewport.session.selection == BOX
    assert viewport.view.eye.distance < 0.3 * far
    np.testing.assert_allclose(viewport.view.eye.centre, middle_of(viewport, 1), atol=1e-9)


def drag(viewport: Viewport, qtbot: QtBot, button: Qt.MouseButton, by: QPoint, *, shift: bool = False) -> None:
    start = QPoint(40, 440)
    modifier = Qt.KeyboardModifier.ShiftModifier if shift else Qt.KeyboardModifier.NoModifier
    qtbot.mousePress(viewport.view, button, modifier, start)
    for share in (0.3, 0.6, 1.0):
        qtbot.mouseMove(viewport.view, start + QPoint(round(by.x() * share), round(by.y() * share)))
        QApplication.processEvents()
    qtbot.mouseRelease(viewport.view, button, modifier, start + by)


def test_the_mouse_turns_shifts_and_zooms(viewport: Viewport, qtbot: QtBot) -> None:
    viewport.frame()
    before = viewport.view.eye
    drag(viewport, qtbot, Qt.MouseButton.LeftButton, QPoint(50, 0))
    turned = viewport.view.eye
    np.testing.assert_array_equal(turned.centre, before.centre)
    assert abs(turned.rotation[2, 0]) < 1e-12, "the horizon stays level"
    cosine = (np.trace(turned.rotation.T @ before.rotation) - 1) / 2
    assert 10 < math.degrees(math.acos(cosine)) < 21
    assert viewport.session.selection == (), "turning is not clicking"
    drag(viewport, qtbot, Qt.MouseButton.MiddleButton, QPoint(60, -30))
    moved = on_screen(viewport, turned.centre) - QPoint(320, viewport.view.pixels[1] // 2)
    assert abs(moved.x() - 60) <= 1 and abs(moved.y() + 30) <= 1
    at = QPointF(200, 150)
    origin, direction = viewport.view.eye.ray(200, 150, viewport.view.pixels)
    target = origin + direction * viewport.view.eye.distance
    wheel = QWheelEvent(
        at, viewport.view.mapToGlobal(at), QPoint(), QPoint(0, 240), Qt.MouseButton.NoButton,
        Qt.KeyboardModifier.NoModifier, Qt.ScrollPhase.NoScrollPhase, False,
    )  # fmt: skip
    QApplication.sendEvent(viewport.view, wheel)
    assert viewport.view.eye.distance == pytest.approx(turned.distance / 1.15**2)
    assert np.linalg.norm(viewport.view.eye.project(target, viewport.view.pixels)[0] - (200, 150)) < 8


def test_keys_give_the_standard_views(viewport: Viewport, qtbot: QtBot) -> None:
    for key, back in ((Qt.Key.Key_1, (0, -1, 0)), (Qt.Key.Key_2, (-1, 0, 0)), (Qt.Key.Key_3, (0, 0, 1))):
        qtbot.keyClick(viewport.view, key)
        np.testing.assert_allclose(viewport.view.eye.rotation[:, 2], back, atol=1e-3)
    np.testing.assert_allclose(viewport.view.eye.rotation[:, 0], (1, 0, 0), atol=1e-9, err_msg="top: x to the right")
    viewport.session.select(BOX)
    qtbot.keyClick(viewport.view, Qt.Key.Key_F)
    np.testing.assert_allclose(viewport.view.eye.centre, middle_of(viewport, 1), atol=1e-9)
    qtbot.keyClick(viewport.view, Qt.Key.Key_5)
    assert viewport.view.eye.parallel


def test_through_the_camera_a_point_stands_where_the_image_has_it(viewport: Viewport, qtbot: QtBot) -> None:
    qtbot.keyClick(viewport.view, Qt.Key.Key_C)
    scene = viewport.session.project.scene
    camera, (width, height) = scene.camera, viewport.view.pixels
    for point in (np.array([0.05, -0.08, 0.8]), np.array([-0.1, 0.1, 0.95])):
        (u, v), _ = camera.project(point)
        world = scene.T_world_camera()[:3, :3] @ point + scene.T_world_camera()[:3, 3]
        x, y = viewport.view.eye.project(world, viewport.view.pixels)[0]
        scale = height / (camera.height * 1.02)
        assert x - width / 2 == pytest.approx((u - camera.cx) * scale, abs=0.01)
        assert y - height / 2 == pytest.approx((v - camera.cy) * scale, abs=0.01)
    # it stays with a camera that moves, until a person turns the view
    viewport.session.set((*CAMERA, "T_rig_camera"), Pose(translation=(0.01, 0.02, 0.03)))
    qtbot.waitUntil(lambda: viewport.live.look.project is viewport.session.project)
    np.testing.assert_allclose(viewport.view.eye.position, viewport.session.project.scene.T_world_camera()[:3, 3])
    drag(viewport, qtbot, Qt.MouseButton.LeftButton, QPoint(30, 10))
    assert viewport.scene.through == () and viewport.view.eye.angle == 30.0
    qtbot.keyClick(viewport.view, Qt.Key.Key_L)
    np.testing.assert_allclose(viewport.view.eye.position, viewport.session.project.scene.T_world_laser(0)[:3, 3])


def test_a_moved_mesh_keeps_its_actor_and_its_triangles(viewport: Viewport, qtbot: QtBot) -> None:
    actors = {id(actor): actor.GetMapper().GetInput().GetMTime() for _, actor in viewport.scene._meshes.values()}
    pose = Pose(translation=(0.01, 0.02, 0.5), rotation=(0.1, 0.2, 0.3))
    viewport.session.set((*BOX, "T_world_object"), pose)
    qtbot.waitUntil(lambda: viewport.live.look.project is viewport.session.project)
    after = {id(actor): actor.GetMapper().GetInput().GetMTime() for _, actor in viewport.scene._meshes.values()}
    assert after == actors
    box = next(actor for actor, path in viewport.scene.paths.items() if path == BOX)
    matrix = box.GetUserMatrix()
    found = np.array([[matrix.GetElement(i, j) for j in range(4)] for i in range(4)])
    np.testing.assert_allclose(found, pose.matrix)


def test_many_changes_in_one_turn_of_the_event_loop_are_drawn_once(viewport: Viewport, qtbot: QtBot) -> None:
    looks = []
    viewport.live.changed.connect(lambda: looks.append(viewport.live.look))
    QApplication.processEvents()
    before = viewport.view.paints
    for i in range(20):
        viewport.session.set((*LASER, "T_rig_laser", "translation"), (0.2 + 1e-3 * i, 0.0, 0.0))
    qtbot.waitUntil(lambda: viewport.live.look.project is viewport.session.project and viewport.view.paints > before)
    QApplication.processEvents()
    assert len(looks) == 1
    assert viewport.view.paints - before <= 2


def test_the_lit_line_and_the_sheet_are_drawn_in_the_lasers_colour(viewport: Viewport, qtbot: QtBot) -> None:
    session = viewport.session
    session.set((*LASER, "wavelength_nm"), 520.0)
    viewport.frame(PLATE)
    viewport.gizmo.retarget()
    qtbot.waitUntil(lambda: viewport.live.look.project is session.project)
    with_line = picture(viewport)
    green = with_line[:, :, 1] - np.maximum(with_line[:, :, 0], with_line[:, :, 2])
    assert np.count_nonzero(green > 60) > 100, "the lit line"
    sheet = np.mean(green > 10)
    viewport.show_part("sheets", False)
    QApplication.processEvents()
    plain = picture(viewport)
    assert np.mean(plain[:, :, 1] - np.maximum(plain[:, :, 0], plain[:, :, 2]) > 10) < 0.7 * sheet


def test_hidden_and_removed_things_leave_the_view(viewport: Viewport, qtbot: QtBot) -> None:
    session = viewport.session
    session.set((*BOX, "visible"), False)
    qtbot.waitUntil(lambda: len(viewport.live.look.placed) == 1)
    assert BOX not in viewport.scene.paths.values()
    session.document.undo()
    qtbot.waitUntil(lambda: len(viewport.live.look.placed) == 2)
    assert BOX in viewport.scene.paths.values()
    session.set(("scene", "rig", "lasers"), ())
    qtbot.waitUntil(lambda: not viewport.live.look.scene.lasers)
    assert LASER not in viewport.scene.paths.values()
    session.select(("scene", "rig", "lasers", 0))
    assert viewport.gizmo.frame() is None


def test_both_themes_change_the_ground(viewport: Viewport, qtbot: QtBot) -> None:
    dark = picture(viewport).mean()
    theme.apply("light")
    QApplication.processEvents()
    light = picture(viewport).mean()
    theme.apply("dark")
    assert light > dark + 80


def test_another_project_is_framed_anew(viewport: Viewport, qtbot: QtBot) -> None:
    other = SAMPLE.parents[1] / "sphere/project.json"
    viewport.look_through(CAMERA)
    viewport.session.replace_document(Document(Project.load(other), other))
    qtbot.waitUntil(lambda: viewport.live.look.project is viewport.session.project)
    qtbot.waitUntil(lambda: len(viewport.live.look.placed) == len(viewport.session.project.scene.objects))
    qtbot.waitUntil(lambda: not viewport._frame_soon)
    low, high = viewport.scene.bounds(viewport.live.look)
    np.testing.assert_allclose(viewport.view.eye.centre, (low + high) / 2, atol=1e-6)
    assert viewport.scene.through == ()


def test_a_missing_mesh_is_told_once_and_the_rest_is_shown(viewport: Viewport, qtbot: QtBot) -> None:
    told: list[tuple[str, str]] = []
    session = viewport.session
    session.message.connect(lambda level, text: told.append((level, text)))
    lost = session.project.scene.objects[0].model_dump() | {"name": "lost", "shape": {"kind": "file", "path": "no.ply"}}
    objects = (*session.project.scene.objects, type(session.project.scene.objects[0]).model_validate(lost))
    session.set(("scene", "objects"), objects)
    qtbot.waitUntil(lambda: bool(told))
    session.set((*LASER, "power"), 0.01)
    qtbot.waitUntil(lambda: viewport.live.look.project is session.project and not viewport.live.is_loading)
    assert len(told) == 1 and told[0][0] == "error" and "lost" in told[0][1]
    assert len(viewport.live.look.placed) == 2


@pytest.mark.parametrize("name", ["shiny_weld_seam", "step_block"])
def test_a_template_is_drawn_with_all_its_meshes(qtbot: QtBot, name: str) -> None:
    folder = template_folder(name)
    made = Viewport(Session(Document(Project.load(folder / "project.json"), None, folder)))
    made.show()
    qtbot.addWidget(made)
    qtbot.waitUntil(lambda: not made.live.is_loading and not made._frame_soon and made.view.paints > 0)
    assert len(made.scene._meshes) == len(made.session.project.scene.visible_objects)
    made.close()


def test_the_board_s_ghost_stands_before_the_camera(viewport: Viewport) -> None:
    session = viewport.session
    actor, data = viewport.ghost.shapes.actor, viewport.ghost.shapes.data
    assert not actor.GetVisibility()
    square = np.array([[[-0.1, -0.1, 0.5], [0.1, -0.1, 0.5], [0.1, 0.1, 0.5], [-0.1, 0.1, 0.5]]])
    session.show_ghost(square)
    assert actor.GetVisibility() and data.n_cells == 1
    pose = session.project.scene.T_world_camera()
    np.testing.assert_allclose(data.points, square[0] @ pose[:3, :3].T + pose[:3, 3], atol=1e-6)
    viewport.ghost.show(False)
    assert not actor.GetVisibility()
    viewport.ghost.show(True)
    assert actor.GetVisibility()
    session.show_ghost(np.zeros((0, 4, 3)))
    assert not actor.GetVisibility()


def test_everything_is_in_view_lamps_as_well(viewport: Viewport) -> None:
    viewport.frame()
    width, height = viewport.view.pixels
    scene = viewport.live.look.scene
    assert scene.lights
    for light in scene.lights:
        x, y = viewport.view.eye.project(light.T_world_light.matrix[None, :3, 3], viewport.view.pixels)[0]
        assert 0.0 <= x <= width and 0.0 <= y <= height


def test_the_axis_of_a_turntable_is_drawn_and_neither_picked_nor_framed(viewport: Viewport, qtbot: QtBot) -> None:
    scene, session = viewport.scene, viewport.session
    axis, low, high = scene._turning, *scene.bounds(viewport.live.look)
    assert axis.data.n_points == 0
    for motion, drawn in ((LinearStage(steps=5), False), (Turntable(centre=(0.02, 0.0, 0.0), steps=5), True)):
        session.set(("scene", "motion"), motion)
        qtbot.waitUntil(lambda: viewport.live.look.project is session.project)
        assert (axis.data.n_points > 0) == drawn
    assert np.array_equal(scene.bounds(viewport.live.look), (low, high))
    top = pixel(viewport, axis.data.points[1])
    found = viewport.path_at(top.x(), top.y())
    session.set(("scene", "motion"), NoMotion())
    qtbot.waitUntil(lambda: viewport.live.look.project is session.project)
    assert axis.data.n_points == 0
    assert viewport.path_at(top.x(), top.y()) == found, "a click there means what is behind it"


def test_the_ground_is_labelled_in_the_unit_that_lengths_are_shown_in(
    viewport: Viewport, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(SHOWN, "m", "cm")
    scene = viewport.scene
    scene._grid_box = ()  # as at the next start, from which another unit holds
    viewport._draw()
    texts = [label.GetInput() for label in scene._labels]
    assert texts[-1].endswith(" cm") and not any("mm" in text for text in texts)
    step = 100.0 * scene.spacing
    assert all(abs(float(text.removesuffix(" cm")) / step % 1.0) < 1e-6 for text in texts)
