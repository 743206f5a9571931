import cv2
import numpy as np
import pytest

from render.mesh.primitives import primitive_mesh
from render.scene.shape import Box, Sphere
from render.truth.laser_curve import laser_curve
from tests.render.scenes import moved, paper_camera, paper_laser, plane_mesh, scene_of, world_of

STRONG = (-0.25, 0.1, 2e-3, -1e-3, 0.02)


def curve_of(meshes, camera=None, axis="rows", laser=None):
    scene = scene_of(camera or paper_camera(), laser or paper_laser(), objects=len(meshes))
    world = world_of(scene, *meshes)
    return scene, laser_curve(
        world, scene.camera, scene.lasers[0], scene.T_world_camera(), scene.T_world_laser(0), axis
    )


@pytest.mark.parametrize("normal", [(0, 0, 1), (0.5, 0, 0.87), (-0.5, 0.4, 0.77), (0.1, -0.8, 0.6)])
def test_a_plane_gives_the_closed_form_line(normal):
    # image of laser-on-plane: the line K^-T (m k - n), m = -laser normal / d, for the plane n . p = k
    n = np.asarray(normal) / np.linalg.norm(normal)
    scene, curve = curve_of([plane_mesh(normal, 0.87 * n[2])])
    plane = scene.laser_plane(0)
    line = np.linalg.inv(scene.camera.matrix).T @ (-plane[:3] / plane[3] * 0.87 * n[2] - n)
    expected = -(line[1] * curve.index + line[2]) / line[0]
    assert len(curve.index) > 1500
    assert np.abs(curve.position - expected).max() < 1e-7
    assert np.abs(curve.point @ n - 0.87 * n[2]).max() < 1e-9
    assert np.abs(curve.point @ plane[:3] + plane[3]).max() < 1e-9
    assert curve.depth_range == pytest.approx(np.linalg.norm(curve.point, axis=1))


@pytest.mark.parametrize("axis", ["rows", "columns"])
def test_the_distorted_line_lies_where_opencv_projects_its_points(axis):
    camera = paper_camera(0.5, STRONG)
    turned = paper_laser()
    if axis == "columns":
        from render.base.pose import Pose

        turned = paper_laser(
            T_rig_laser=Pose.from_matrix(Pose(rotation=(0, 0, np.pi / 2)).matrix @ turned.T_rig_laser.matrix)
        )
    _, curve = curve_of([plane_mesh((0.3, 0.2, 0.9), 0.8)], camera, axis, turned)
    pixels = cv2.projectPoints(curve.point, np.zeros(3), np.zeros(3), camera.matrix, camera.coefficients)[0][:, 0]
    along, across = (0, 1) if axis == "rows" else (1, 0)
    assert len(curve.index) > 800
    assert np.abs(pixels[:, along] - curve.position).max() < 1e-7
    assert np.abs(pixels[:, across] - curve.index).max() < 1e-7


def test_a_tessellated_sphere_converges_with_the_square_of_the_facet_size():
    errors = []
    for segments in (64, 128, 256):
        mesh = moved(primitive_mesh(Sphere(radius=0.08, segments=segments)), (0.0, 0.0, 0.95), (0.4, 0.3, 0.2))
        _, curve = curve_of([mesh])
        errors.append(np.abs(np.linalg.norm(curve.point - (0.0, 0.0, 0.95), axis=1) - 0.08).max())
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.25)
    assert errors[1] / errors[2] == pytest.approx(4.0, rel=0.25)


def test_every_row_of_a_convex_body_is_crossed_once():
    _, curve = curve_of([moved(primitive_mesh(Sphere(radius=0.08, segments=300)), (0.0, 0.0, 0.95))])
    assert np.unique(curve.index).size == curve.index.size
    assert np.diff(curve.index).max() == 1


def test_parts_in_the_shadow_of_laser_or_camera_are_left_out():
    wall = plane_mesh((0, 0, 1), 0.9)
    _, free = curve_of([wall])
    # a bar across the middle rows, between wall and rig
    bar = moved(primitive_mesh(Box(size_x=0.4, size_y=0.05, size_z=0.01)), (0.0, 0.0, 0.7))
    _, curve = curve_of([wall, bar])
    on_bar = curve.object_id == 1
    assert set(curve.object_id) == {0, 1}
    assert curve.point[on_bar, 2] == pytest.approx(0.695)
    # whatever of the wall is left lies off the bar's shadows, as cast from the camera and from the laser (same height)
    shadow = 0.025 / 0.695
    assert np.abs(curve.point[~on_bar, 1] / curve.point[~on_bar, 2]).min() > shadow
    hidden = np.abs(free.point[:, 1] / free.point[:, 2]) > 0.025 / 0.7 + 0.02
    assert set(free.index[hidden]) <= set(curve.index[~on_bar])


def test_faces_turned_away_from_the_laser_carry_no_line():
    box = moved(primitive_mesh(Box(size_x=0.1, size_y=0.1, size_z=0.1)), (-0.02, 0.0, 0.95))
    _, curve = curve_of([box])
    assert curve.point[:, 2].max() < 0.95 - 0.05 + 0.1
    assert (curve.camera_angle < np.pi / 2).all() and (curve.laser_angle < np.pi / 2).all()


def test_the_fan_ends_the_line():
    import math

    laser = paper_laser(fan_angle=math.radians(10))
    _, curve = curve_of([plane_mesh((0, 0, 1), 0.9)], laser=laser)
    half_length = np.linalg.norm([0.2 - curve.point[0, 0], 0.9]) * math.tan(math.radians(5))
    assert np.abs(curve.point[:, 1]).max() == pytest.approx(half_length, abs=0.9 / 3478)


def test_irradiance_is_that_of_the_beam_formula():
    _, curve = curve_of([plane_mesh((0, 0, 1), 0.9)])
    # P / (2 z tan(fan/2) sqrt(2 pi) sigma) times the cosine on the wall, at the centre of the fan
    middle = np.argmin(np.abs(curve.point[:, 1]))
    z = np.linalg.norm(curve.point[middle] - (0.2, 0.0, 0.0))
    sigma = z * np.tan(1.15e-3 / 2) / 2
    expected = 0.02 / (2 * z * np.tan(np.pi / 8) * np.sqrt(2 * np.pi) * sigma) * np.cos(np.radians(13))
    assert curve.irradiance[middle] == pytest.approx(expected, rel=1e-4)


def test_a_scene_out_of_the_sheet_has_no_line():
    _, curve = curve_of([moved(primitive_mesh(Box(size_x=0.02, size_y=0.02, size_z=0.02)), (0.2, 0.2, 0.95))])
    assert curve.index.size == 0 and curve.segments.shape == (0, 2, 3)
