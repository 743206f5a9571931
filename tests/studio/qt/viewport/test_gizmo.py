"""The gizmo: what the mouse asks for is what the item does, and one undo takes all of it back."""

from __future__ import annotations

import math

import numpy as np
import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from render.base.pose import Pose, rotation_vector
from render.scene.motion import LinearStage
from studio.preview.gizmo_geometry import Frame, Handle, arm_end, plane_corners, ring_points
from studio.project.document import FieldPath, value_at
from studio.qt.results.readout_panel import ReadoutPanel
from studio.qt.viewport.viewport import Viewport
from tests.studio.qt.viewport.viewport_hands import drag, mouse, pixel

RIG, CAMERA, LASER, PLATE, LAMP = (
    ("scene", "rig"),
    ("scene", "rig", "camera"),
    ("scene", "rig", "lasers", 0),
    ("scene", "objects", 0),
    ("scene", "lights", 0),
)
POSE = {RIG: "T_world_rig", CAMERA: "T_rig_camera", LASER: "T_rig_laser", PLATE: "T_world_object",
        LAMP: "T_world_light"}  # fmt: skip


def pose_of(viewport: Viewport, path: FieldPath) -> Pose:
    pose = value_at(viewport.session.project, (*path, POSE[path]))
    assert isinstance(pose, Pose)
    return pose


def in_world(viewport: Viewport, path: FieldPath) -> np.ndarray:
    scene = viewport.session.project.scene
    if path == CAMERA:
        return scene.T_world_camera()
    if path == LASER:
        return scene.T_world_laser(0)
    return pose_of(viewport, path).matrix


def select(viewport: Viewport, path: FieldPath) -> Frame:
    """Select an item and bring it into view; the frame of its gizmo."""
    viewport.session.select(path)
    viewport.frame(path)
    # as a person would: a view from which all three axes can be had
    viewport.view.look_from(viewport.view.eye.orbit(17.0, 4.0))
    QApplication.processEvents()
    frame = viewport.gizmo.frame()
    assert frame is not None
    return frame


@pytest.mark.parametrize("path", [LASER, PLATE, CAMERA, RIG, LAMP])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_an_arm_moves_by_what_the_mouse_asks(viewport: Viewport, path: FieldPath, axis: int) -> None:
    frame = select(viewport, path)
    before, project = in_world(viewport, path), viewport.session.project
    asked = 0.6 * np.linalg.norm(arm_end(frame, axis) - frame.centre)
    grip = frame.centre + 0.7 * (arm_end(frame, axis) - frame.centre)
    drag(viewport, pixel(viewport, grip), pixel(viewport, grip + asked * frame.axes[:, axis]))
    after = in_world(viewport, path)
    moved = after[:3, 3] - before[:3, 3]
    assert moved[axis] == pytest.approx(asked, rel=0.02)
    assert np.abs(np.delete(moved, axis)).max() < 1e-8
    np.testing.assert_allclose(after[:3, :3], before[:3, :3], atol=1e-12)
    viewport.session.document.undo()
    assert viewport.session.project is project


def test_a_laser_is_placed_by_whole_pixels_through_the_real_mouse(viewport: Viewport, qtbot: QtBot) -> None:
    frame = select(viewport, LASER)
    before = in_world(viewport, LASER)[:3, 3]
    grip = pixel(viewport, frame.centre + 0.8 * (arm_end(frame, 2) - frame.centre)).toPoint()
    step = pixel(viewport, arm_end(frame, 2)) - pixel(viewport, frame.centre)
    view = viewport.view
    qtbot.mouseMove(view, grip)
    qtbot.mousePress(view, Qt.MouseButton.LeftButton, pos=grip)
    assert viewport.session.dragging
    end = grip + QPoint(round(1.2 * step.x()), round(1.2 * step.y()))
    for share in (0.3, 0.6, 1.0):
        qtbot.mouseMove(view, grip + (end - grip) * share)
        QApplication.processEvents()
    qtbot.mouseRelease(view, Qt.MouseButton.LeftButton, pos=end)
    assert not viewport.session.dragging
    moved = in_world(viewport, LASER)[:3, 3] - before
    # the arm's pixels at its start and end, by the eye that looks on
    asked = np.linalg.norm(arm_end(frame, 2) - frame.centre) * 1.2
    assert moved[2] == pytest.approx(asked, rel=0.1)
    shown = viewport.gizmo.frame()
    assert shown is not None
    np.testing.assert_allclose(shown.centre, before + moved, atol=1e-9, err_msg="the gizmo follows")


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_ring_turns_by_what_the_mouse_asks(viewport: Viewport, axis: int) -> None:
    frame = select(viewport, PLATE)
    before, project = in_world(viewport, PLATE), viewport.session.project
    ring = ring_points(frame, axis, 361)
    # begin where no other handle is near
    start = next(i for i in range(20, 340) if hit(viewport, ring[i]) == Handle("ring", axis))
    turn = 40
    for i in range(start, start + turn + 1, 8):
        kind = "press" if i == start else "move"
        mouse(viewport, kind, pixel(viewport, ring[i % 360]), Qt.KeyboardModifier.NoModifier)
    mouse(viewport, "release", pixel(viewport, ring[(start + turn) % 360]), Qt.KeyboardModifier.NoModifier)
    after = in_world(viewport, PLATE)
    vector = rotation_vector(after[:3, :3] @ before[:3, :3].T)
    np.testing.assert_allclose(np.degrees(vector), turn * np.eye(3)[axis], atol=0.02 * turn)
    np.testing.assert_array_equal(after[:3, 3], before[:3, 3])
    viewport.session.document.undo()
    assert viewport.session.project is project


def hit(viewport: Viewport, point: np.ndarray) -> Handle | None:
    from studio.preview.gizmo_geometry import handle_at

    frame, at = viewport.gizmo.frame(), pixel(viewport, point)
    assert frame is not None
    return handle_at(frame, viewport.view.eye, at.x(), at.y(), viewport.view.pixels)


def test_a_square_moves_across_its_axis(viewport: Viewport) -> None:
    frame = select(viewport, PLATE)
    before = in_world(viewport, PLATE)[:3, 3]
    grip = plane_corners(frame, 2).mean(axis=0)
    drag(viewport, pixel(viewport, grip), pixel(viewport, grip + np.array([0.05, -0.03, 0.0])))
    np.testing.assert_allclose(in_world(viewport, PLATE)[:3, 3] - before, (0.05, -0.03, 0.0), atol=1e-6)


def test_ctrl_snaps_to_the_steps(viewport: Viewport) -> None:
    frame = select(viewport, LASER)
    before = in_world(viewport, LASER)[:3, 3]
    viewport.gizmo.move_step = 0.01
    grip = frame.centre + 0.7 * (arm_end(frame, 0) - frame.centre)
    asked = np.array([0.0337, 0.0, 0.0])
    drag(viewport, pixel(viewport, grip), pixel(viewport, grip + asked), Qt.KeyboardModifier.ControlModifier)
    np.testing.assert_allclose(in_world(viewport, LASER)[:3, 3] - before, (0.03, 0.0, 0.0), atol=1e-8)


def test_own_axes_move_along_the_items_own_axis(viewport: Viewport) -> None:
    viewport.set_local(True)
    select(viewport, LASER)
    viewport.view.look_from(viewport.view.eye.orbit(50.0, 20.0))
    frame = viewport.gizmo.frame()
    assert frame is not None
    before = in_world(viewport, LASER)
    np.testing.assert_allclose(frame.axes, before[:3, :3])
    grip = frame.centre + 0.7 * (arm_end(frame, 2) - frame.centre)
    drag(viewport, pixel(viewport, grip), pixel(viewport, grip + 0.04 * before[:3, 2]))
    np.testing.assert_allclose(in_world(viewport, LASER)[:3, 3] - before[:3, 3], 0.04 * before[:3, 2], atol=1e-6)


def test_two_drags_are_two_entries_and_escape_leaves_none(viewport: Viewport, qtbot: QtBot) -> None:
    document = viewport.session.document
    frame = select(viewport, PLATE)
    first = viewport.session.project
    grip, up = frame.centre + 0.7 * (arm_end(frame, 2) - frame.centre), np.array([0.0, 0.0, 0.02])
    drag(viewport, pixel(viewport, grip), pixel(viewport, grip + up))
    second = viewport.session.project
    drag(viewport, pixel(viewport, grip + up), pixel(viewport, grip + 2 * up))
    assert viewport.session.project not in (first, second)
    document.undo()
    assert viewport.session.project is second
    document.undo()
    assert viewport.session.project is first and document.undo_label is None
    mouse(viewport, "press", pixel(viewport, grip), Qt.KeyboardModifier.NoModifier)
    mouse(viewport, "move", pixel(viewport, grip + up), Qt.KeyboardModifier.NoModifier)
    assert viewport.session.project != first
    qtbot.keyClick(viewport.view, Qt.Key.Key_Escape)
    assert viewport.session.project is first and not viewport.session.dragging and document.undo_label is None
    mouse(viewport, "move", pixel(viewport, grip + 2 * up), Qt.KeyboardModifier.NoModifier)
    assert viewport.session.project is first


def test_at_a_later_step_of_a_motion_the_gizmo_stands_where_the_object_is(viewport: Viewport, qtbot: QtBot) -> None:
    viewport.session.set(("scene", "motion"), LinearStage(moves="objects", step=(0.0, 0.01, 0.0), steps=9))
    viewport.live.show_step(5)
    qtbot.waitUntil(lambda: viewport.live.look.step == 5)
    frame = select(viewport, PLATE)
    before = pose_of(viewport, PLATE)
    np.testing.assert_allclose(frame.centre, np.add(before.translation, (0.0, 0.05, 0.0)))
    grip = frame.centre + 0.7 * (arm_end(frame, 0) - frame.centre)
    drag(viewport, pixel(viewport, grip), pixel(viewport, grip + np.array([0.03, 0.0, 0.0])))
    np.testing.assert_allclose(
        np.subtract(pose_of(viewport, PLATE).translation, before.translation), (0.03, 0, 0), atol=1e-6
    )


def test_the_read_outs_follow_a_drag(viewport: Viewport, qtbot: QtBot) -> None:
    panel = ReadoutPanel(viewport.session)
    qtbot.addWidget(panel)
    panel.show()
    frame = select(viewport, LASER)

    def shown(key: str) -> str:
        return next(row.value for row in panel.rows() if row.key == key)

    assert shown("baseline") == "200 mm"
    grip = frame.centre + 0.7 * (arm_end(frame, 0) - frame.centre)
    mouse(viewport, "press", pixel(viewport, grip), Qt.KeyboardModifier.NoModifier)
    mouse(viewport, "move", pixel(viewport, grip + np.array([0.05, 0, 0])), Qt.KeyboardModifier.NoModifier)
    qtbot.waitUntil(lambda: viewport.live.look.project is viewport.session.project)
    moved = viewport.session.project.scene.T_camera_laser(0)[:3, 3]
    assert viewport.session.dragging and shown("baseline") == f"{1e3 * np.linalg.norm(moved):.0f} mm"
    assert shown("baseline") != "200 mm"
    mouse(viewport, "release", pixel(viewport, grip + np.array([0.05, 0, 0])), Qt.KeyboardModifier.NoModifier)


def test_a_full_turn_and_more_does_not_jump_back() -> None:
    from studio.preview.gizmo_geometry import Drag
    from studio.preview.view_camera import Eye

    eye = Eye.standing(np.zeros(3), 1.0, -90.0, 90.0)
    frame = Frame(np.zeros(3), np.eye(3), 1e-3)
    ring = ring_points(frame, 2, 361)

    def ray(degrees: int) -> tuple[np.ndarray, np.ndarray]:
        x, y = eye.project(ring[degrees % 360], (600, 600))[0]
        return eye.ray(x, y, (600, 600))

    turning = Drag(frame, Handle("ring", 2), *ray(10))
    for degrees in range(10, 500, 10):
        turning.to(*ray(degrees))
    assert math.degrees(turning.angle) == pytest.approx(480.0, abs=0.01)


@pytest.mark.parametrize("path", [CAMERA, LASER])
def test_there_is_no_gizmo_where_the_eye_stands(viewport: Viewport, path: FieldPath) -> None:
    select(viewport, path)
    viewport.look_through(path)
    paints = viewport.view.paints
    viewport.view.redraw()
    QApplication.processEvents()
    # drawn at the eye, of no size, it would end the program
    assert viewport.view.paints > paints and viewport.gizmo.frame() is None
    assert not any(lines.actor.GetVisibility() for lines in viewport.gizmo._shapes.values())
    viewport.frame(path)
    QApplication.processEvents()
    assert any(lines.actor.GetVisibility() for lines in viewport.gizmo._shapes.values())
