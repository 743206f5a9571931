"""Eye and handles: rays and pixels are each other's inverse, and a drag says what the mouse did, from everywhere."""

from __future__ import annotations

import math

import numpy as np
import pytest

from render.base.pose import rotation_matrix, rotation_vector
from studio.preview.gizmo_geometry import (
    HANDLES,
    Drag,
    Frame,
    Handle,
    arm_end,
    handle_at,
    offered,
    plane_corners,
    ring_points,
)
from studio.preview.view_camera import STANDARD, Eye, angles, through, turntable

SIZE = (640, 480)


def eyes(count: int) -> list[Eye]:
    random = np.random.default_rng(8)
    found = []
    for i in range(count):
        centre = random.normal(0, 0.3, 3)
        azimuth, elevation = random.uniform(-180, 180), random.uniform(-85, 85)
        eye = Eye.standing(centre, random.uniform(0.2, 3.0), azimuth, elevation)
        found.append(eye if i % 3 else Eye(eye.centre, eye.distance, eye.rotation, eye.angle, parallel=True))
    return found


@pytest.mark.parametrize("eye", eyes(9))
def test_a_ray_goes_through_the_pixel_that_its_points_project_to(eye: Eye) -> None:
    for x, y in ((0.0, 0.0), (320.0, 240.0), (615.3, 17.8)):
        origin, direction = eye.ray(x, y, SIZE)
        assert np.linalg.norm(direction) == pytest.approx(1.0)
        points = origin + np.array([[0.3], [1.0], [7.0]]) * direction
        np.testing.assert_allclose(eye.project(points, SIZE), np.tile((x, y), (3, 1)), atol=1e-8)


@pytest.mark.parametrize("eye", eyes(6))
def test_a_pixel_is_as_long_as_it_says(eye: Eye) -> None:
    point = eye.centre + 0.1 * eye.rotation[:, 0]
    length = eye.metres_per_pixel(point, SIZE)
    a, b = eye.project(np.stack([point, point + length * eye.rotation[:, 1]]), SIZE)
    np.testing.assert_allclose(a - b, (0.0, 1.0), atol=1e-9)


def test_panning_moves_the_scene_with_the_mouse_and_zooming_keeps_what_is_under_it() -> None:
    for eye in eyes(6):
        before = eye.project(eye.centre, SIZE)[0]
        np.testing.assert_allclose(
            eye.pan(31.0, -12.0, SIZE).project(eye.centre, SIZE)[0], np.add(before, (31.0, -12.0))
        )
        origin, direction = eye.ray(100.0, 400.0, SIZE)
        back = eye.rotation[:, 2]
        under = origin + direction * ((eye.centre - origin) @ back / (direction @ back))
        nearer = eye.zoom(1.7, 100.0, 400.0, SIZE)
        np.testing.assert_allclose(nearer.project(under, SIZE)[0], (100.0, 400.0), atol=1e-8)
        assert nearer.distance == pytest.approx(eye.distance / 1.7)


def test_orbiting_turns_about_the_centre_with_a_level_horizon() -> None:
    eye = Eye.standing(np.array([0.1, 0.2, 0.3]), 1.0, 20.0, 30.0)
    turned = eye.orbit(15.0, 10.0)
    assert angles(turned.rotation) == pytest.approx((5.0, 40.0))
    assert abs(turned.rotation[2, 0]) < 1e-15
    steep = eye.orbit(0.0, 500.0)
    assert angles(steep.rotation)[0] == pytest.approx(20.0)
    assert angles(steep.orbit(0.0, -30.0).rotation) == pytest.approx((20.0, 59.99))


def test_standard_views_have_the_axes_where_drawings_have_them() -> None:
    right_up = {"front": ((1, 0, 0), (0, 0, 1)), "left": ((0, -1, 0), (0, 0, 1)), "top": ((1, 0, 0), (0, 1, 0))}
    for name, (right, up) in right_up.items():
        rotation = turntable(*STANDARD[name])
        np.testing.assert_allclose(rotation[:, 0], right, atol=1e-12)
        np.testing.assert_allclose(rotation[:, 1], up, atol=2e-4)


def test_a_framed_box_is_in_view() -> None:
    low, high = np.array([-0.2, 0.1, 0.0]), np.array([0.5, 0.2, 0.9])
    corners = np.array([(x, y, z) for x in (-0.2, 0.5) for y in (0.1, 0.2) for z in (0.0, 0.9)])
    for eye in eyes(6):
        pixels = eye.framed(low, high, SIZE).project(corners, SIZE)
        assert (pixels > 0).all() and (pixels < SIZE).all()
        assert np.ptp(pixels, axis=0).max() > 100


def test_the_eye_of_a_camera_has_its_axes() -> None:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = rotation_matrix(np.array([0.3, -1.2, 0.4])), (1.0, 2.0, 3.0)
    eye = through(T, 0.7, 40.0)
    np.testing.assert_allclose(eye.position, T[:3, 3])
    np.testing.assert_allclose(eye.project(T[:3, 3] + T[:3, :3] @ (0.0, 0.1, 1.0), SIZE)[0][0], 320.0)
    assert eye.project(T[:3, 3] + T[:3, :3] @ (0.0, 0.1, 1.0), SIZE)[0][1] > 240, "y points down"


def frames() -> list[tuple[Eye, Frame]]:
    random = np.random.default_rng(3)
    found = []
    for eye in eyes(12):
        centre = eye.centre + 0.1 * eye.distance * random.normal(size=3)
        axes = rotation_matrix(random.normal(size=3))
        found.append((eye, Frame(centre, axes, eye.metres_per_pixel(centre, SIZE))))
    return found


@pytest.mark.parametrize(("eye", "frame"), frames())
def test_a_drag_follows_the_mouse_from_every_side(eye: Eye, frame: Frame) -> None:
    def ray(point: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return eye.ray(*eye.project(point, SIZE)[0], SIZE)

    for handle in HANDLES:
        if not offered(frame, eye, handle):
            continue
        axis = frame.axes[:, handle.axis]
        if handle.kind == "ring":
            ring = ring_points(frame, handle.axis, 361)
            drag = Drag(frame, handle, *ray(ring[10]))
            for degrees in range(10, 71, 10):
                motion = drag.to(*ray(ring[degrees]))
            assert motion is not None
            np.testing.assert_allclose(rotation_vector(motion[:3, :3]), math.radians(60) * axis, atol=1e-6)
            np.testing.assert_allclose(motion[:3, :3] @ frame.centre + motion[:3, 3], frame.centre, atol=1e-12)
            continue
        start = arm_end(frame, handle.axis) if handle.kind == "axis" else plane_corners(frame, handle.axis).mean(axis=0)
        asked = 40 * frame.pixel * axis
        if handle.kind == "plane":
            asked = frame.pixel * (30 * frame.axes[:, (handle.axis + 1) % 3] - 50 * frame.axes[:, handle.axis - 1])
        motion = Drag(frame, handle, *ray(start)).to(*ray(start + asked))
        assert motion is not None
        np.testing.assert_allclose(motion[:3, 3], asked, atol=1e-6 * frame.pixel * 100)
        np.testing.assert_array_equal(motion[:3, :3], np.eye(3))


def test_handles_are_found_where_they_are_drawn() -> None:
    eye = Eye.standing(np.zeros(3), 1.0, -55.0, 35.0)
    frame = Frame(np.zeros(3), np.eye(3), eye.metres_per_pixel(np.zeros(3), SIZE))
    for axis in range(3):
        x, y = eye.project(arm_end(frame, axis), SIZE)[0]
        assert handle_at(frame, eye, x + 2, y - 2, SIZE) == Handle("axis", axis)
        x, y = eye.project(plane_corners(frame, axis).mean(axis=0), SIZE)[0]
        assert handle_at(frame, eye, x, y, SIZE) == Handle("plane", axis)
        hits = [handle_at(frame, eye, *eye.project(point, SIZE)[0], SIZE) for point in ring_points(frame, axis)]
        assert np.mean([hit == Handle("ring", axis) for hit in hits]) > 0.7
    assert handle_at(frame, eye, 5.0, 5.0, SIZE) is None


def test_what_the_mouse_could_not_say_is_not_offered() -> None:
    eye = Eye.standing(np.zeros(3), 1.0, -90.0, 0.0)
    frame = Frame(np.zeros(3), np.eye(3), 1e-3)
    assert [offered(frame, eye, Handle("axis", axis)) for axis in range(3)] == [True, False, True]
    assert [offered(frame, eye, Handle("plane", axis)) for axis in range(3)] == [False, True, False]


def test_steps_are_whole() -> None:
    frame = Frame(np.zeros(3), np.eye(3), 1e-3)
    eye = Eye.standing(np.zeros(3), 1.0, -90.0, 45.0)

    def ray(x: float) -> tuple[np.ndarray, np.ndarray]:
        return eye.ray(*eye.project(np.array([x, 0.0, 0.0]), SIZE)[0], SIZE)

    drag = Drag(frame, Handle("axis", 0), *ray(0.05))
    for asked, given in ((0.0514, 0.0), (0.0526, 0.005), (0.069, 0.02), (0.03, -0.02)):
        motion = drag.to(*ray(asked), move_step=0.005)
        assert motion is not None
        assert motion[0, 3] == pytest.approx(given, abs=1e-12)
