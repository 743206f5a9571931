import numpy as np
import pytest

from render.base.pose import Pose, rotation_matrix, transform_points


def test_a_pose_maps_coordinates_of_b_to_a():
    T_ab = Pose(translation=(1.0, 2.0, 3.0), rotation=(0.0, 0.0, np.pi / 2))
    assert transform_points(T_ab.matrix, np.array([[1.0, 0.0, 0.0]])) == pytest.approx(np.array([[1.0, 3.0, 3.0]]))


def test_poses_chain_and_invert():
    a = Pose(translation=(0.1, -0.2, 0.3), rotation=(0.3, -0.8, 1.9))
    b = Pose(translation=(-1.0, 0.5, 0.2), rotation=(-2.0, 0.4, 0.1))
    assert (a @ b).matrix == pytest.approx(a.matrix @ b.matrix, abs=1e-12)
    assert (a @ a.inverse()).matrix == pytest.approx(np.eye(4), abs=1e-12)


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-6, 1.0, np.pi - 1e-6])
def test_matrix_and_rotation_vector_are_inverse(angle):
    vector = np.array([0.36, -0.48, 0.8]) * angle
    assert Pose.from_matrix(Pose(rotation=tuple(vector)).matrix).rotation == pytest.approx(tuple(vector), abs=1e-9)


def test_a_slightly_sheared_matrix_becomes_the_nearest_rotation_with_determinant_one():
    matrix = np.eye(4)
    matrix[:3, :3] = rotation_matrix(np.array([0.2, 0.3, -0.4])) + 1e-4 * np.arange(9).reshape(3, 3)
    r = Pose.from_matrix(matrix).matrix[:3, :3]
    assert r @ r.T == pytest.approx(np.eye(3), abs=1e-12)
    assert np.linalg.det(r) == pytest.approx(1.0)


def test_looking_at_puts_the_target_on_the_axis_and_down_in_the_image():
    T_world_camera = Pose.looking_at((1.0, 2.0, 3.0), (0.0, 0.0, 0.0)).matrix
    target = np.linalg.inv(T_world_camera) @ np.array([0.0, 0.0, 0.0, 1.0])
    assert target[:3] == pytest.approx([0.0, 0.0, np.sqrt(14.0)], abs=1e-12)
    below = np.linalg.inv(T_world_camera) @ np.array([0.0, 0.0, -0.1, 1.0])
    assert below[1] > 0.0 and below[0] == pytest.approx(0.0, abs=1e-12)
