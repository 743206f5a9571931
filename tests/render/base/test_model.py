"""What every scene model has in common: equality by value and copies without stale caches."""

from __future__ import annotations

from render.base.pose import Pose
from render.camera.camera import Camera


def camera() -> Camera:
    return Camera(width=100, height=80, fx=100, fy=100, cx=49.5, cy=39.5)


def test_models_are_equal_by_their_fields_whatever_they_have_cached() -> None:
    a, b = camera(), camera()
    assert a.matrix[0, 0] == 100 and a.T_rig_camera.matrix[3, 3] == 1
    assert a == b and hash(a) == hash(b)
    assert b.matrix[0, 0] == 100 and b.T_rig_camera.matrix[3, 3] == 1
    assert a == b and hash(a) == hash(b)
    assert a != a.model_copy(update={"fx": 101.0}) and Pose() != a


def test_a_changed_copy_forgets_what_the_original_cached() -> None:
    original = camera()
    assert original.matrix[0, 0] == 100
    assert original.scaled(0.5).matrix[0, 0] == 50
    assert original.matrix[0, 0] == 100
