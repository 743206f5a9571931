"""A laser placed by its angle, its baseline or its point lights that point from there."""

from __future__ import annotations

import math

import numpy as np
import pytest

from render.base.pose import Pose
from studio.editing.placing import aimed, at_angle, at_baseline, turned_to

CAMERA, POINT = np.array([0.01, -0.02, 0.0]), np.array([0.05, 0.02, 0.6])
LASER = Pose.looking_at((0.2, 0.03, 0.02), (0.05, 0.02, 0.6), (0.1, 1.0, 0.0))


def in_laser(pose: Pose, point: np.ndarray = POINT) -> np.ndarray:
    return np.linalg.inv(pose.matrix) @ np.append(point, 1.0)


@pytest.mark.parametrize("point", [POINT, np.array([0.2, 0.03, -1.0]), np.array([-0.4, 0.3, 0.1])])
def test_an_aimed_laser_stays_where_it_is_and_its_axis_meets_the_point(point: np.ndarray) -> None:
    pose = aimed(LASER, point)
    x, y, z, _ = in_laser(pose, point)
    assert pose.translation == LASER.translation
    assert abs(x) < 1e-8 and abs(y) < 1e-8 and z > 0.0


@pytest.mark.parametrize("degrees", [10.0, 30.0, 75.0])
def test_the_angle_at_the_point_is_the_one_asked_for(degrees: float) -> None:
    pose = at_angle(LASER, CAMERA, POINT, math.radians(degrees))
    a, b = CAMERA - POINT, np.array(pose.translation) - POINT
    assert math.degrees(math.acos(a @ b / np.linalg.norm(a) / np.linalg.norm(b))) == pytest.approx(degrees, abs=1e-5)
    # as seen by the laser nothing has moved
    assert in_laser(pose) == pytest.approx(in_laser(LASER), abs=1e-8)


def test_a_laser_at_the_camera_moves_across_its_sheet() -> None:
    ahead = np.array([0.0, 0.0, 0.5])
    pose = at_angle(Pose(), np.zeros(3), ahead, math.radians(30.0))
    assert abs(pose.translation[1]) < 1e-9 and abs(pose.translation[0]) == pytest.approx(0.25, abs=1e-8)


@pytest.mark.parametrize("baseline", [0.05, 0.4])
def test_the_baseline_is_the_one_asked_for_and_the_point_stays_lit(baseline: float) -> None:
    pose = at_baseline(LASER, CAMERA, POINT, baseline)
    assert np.linalg.norm(np.array(pose.translation) - CAMERA) == pytest.approx(baseline, abs=1e-8)
    x, y, z, _ = in_laser(pose)
    assert abs(x) < 1e-8 and abs(y) < 1e-8 and z > 0.0


def test_a_laser_turned_to_a_point_meets_it_as_it_met_another() -> None:
    after = POINT + np.array([0.0, 0.0, -0.3])
    pose = turned_to(LASER, POINT, after)
    assert pose.translation == LASER.translation
    before, now = in_laser(LASER)[:3], in_laser(pose, after)[:3]
    assert now / np.linalg.norm(now) == pytest.approx(before / np.linalg.norm(before), abs=1e-8)


def test_a_rig_that_was_built_straight_stays_so() -> None:
    """Also where what is lit lies a little beside its plane, as on a part that is not: no turn but about the fan."""
    straight, lit = Pose(translation=(0.1, 0.0, 0.0), rotation=(0.0, -0.3, 0.0)), np.array([0.0, 0.002, 0.32])
    made = (
        at_angle(straight, np.zeros(3), lit, math.radians(25.0)),
        at_baseline(straight, np.zeros(3), lit, 0.2),
        turned_to(straight, lit, np.array([0.0, 0.001, 0.2])),
    )
    for pose in made:
        assert pose.translation[1] == pytest.approx(0.0, abs=1e-12)
        assert pose.rotation[0] == pytest.approx(0.0, abs=1e-12) and pose.rotation[2] == pytest.approx(0.0, abs=1e-12)
