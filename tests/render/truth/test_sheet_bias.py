"""What the sheet's width does on bent surfaces, predicted from the truth, against rendered frames and closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
import trimesh

from render.base.pose import Pose, invert, transform_points
from render.camera.camera import Camera
from render.laser.laser import LineLaser, Waist
from render.laser_direct.integrator import direct_image
from render.mesh.mesh import Mesh
from render.mesh.primitives import primitive_mesh
from render.scene.shape import Sphere
from render.truth.laser_curve import laser_curve
from render.truth.sheet_bias import with_sheet_bias
from tests.render.scenes import BASELINE, moved, paper_camera, plane_mesh, scene_of, world_of

STEEPEST = math.radians(70.0)
"""Beyond, a rim is nearer than the line is wide."""


def sheet(sigma):
    """A laser whose sheet is nearly parallel, of this sigma, m, at 0.87 m."""
    return LineLaser(sheet=Waist(radius=2.0 * sigma, focus_distance=0.87), T_rig_laser=BASELINE)


def of_trimesh(mesh):
    return Mesh(np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int32))


TORUS = moved(
    of_trimesh(trimesh.creation.torus(0.03, 0.01, major_sections=400, minor_sections=400)), (0, 0, 0.88), (1.2, 0.3, 0)
)
CONE = moved(of_trimesh(trimesh.creation.cone(0.04, 0.08, sections=1000)), (0.0, 0.02, 0.9), (1.2, 0.0, 0.0))
BALL = moved(primitive_mesh(Sphere(radius=0.02, segments=600)), (0.0, 0.0, 0.87))


def curve_and_biases(mesh, laser, camera):
    """The curve, and how far the centre of mass of the rendered line is off it, px, about each crossing."""
    scene = scene_of(camera, laser)
    world = world_of(scene, mesh)
    poses = scene.T_world_camera(), scene.T_world_laser(0)
    curve = with_sheet_bias(laser_curve(world, camera, laser, *poses), world, camera, laser, *poses)
    image = direct_image(world, camera, laser, *poses, target=1e-3).radiance.astype(np.float64)
    reach = int(math.ceil(6.0 * laser.sigma(0.87) * camera.fx / 0.8))
    found = []
    for row, place in zip(curve.index, curve.position, strict=True):
        x = np.arange(max(0, math.floor(place) - reach), min(camera.width, math.ceil(place) + reach + 1))
        light = image[row, x]
        found.append((light * x).sum() / light.sum() - place)
    return curve, np.array(found)


@pytest.mark.parametrize(("mesh", "least"), [(TORUS, 0.06), (CONE, 0.03), (BALL, 0.015)])
def test_the_bias_of_a_wide_sheet_on_a_bent_surface_is_predicted(mesh, least):
    curve, found = curve_and_biases(mesh, sheet(0.0006), paper_camera())
    here = (curve.camera_angle < STEEPEST) & (curve.laser_angle < STEEPEST)
    seen, left = found[here], (found - curve.sheet_bias)[here]
    # there is something to predict, and nine tenths of it, at least, are
    assert np.sqrt(np.mean(seen**2)) > least
    assert np.sqrt(np.mean(left**2)) < 0.1 * np.sqrt(np.mean(seen**2))
    assert np.quantile(np.abs(left), 0.9) < 0.005


def test_bias_of_a_cylinder_is_that_of_the_second_order():
    """Camera along z, parallel light from the side: x on the image, z = -sqrt(r^2 - x^2), in closed form.

    With the laser at theta to the axis, q = (x cos + z sin) / sigma; its first and second derivative at the line's
    middle and the slope of the cosine law give the bias.
    """
    radius, theta, sigma, far = 0.02, math.radians(30.0), 2e-4, 40.0
    # both nearly at infinity, so that only the cylinder bends anything
    camera = Camera(width=401, height=3, fx=4e5, fy=4e5, cx=200.0, cy=1.0)
    pose = Pose(translation=(-far * math.sin(theta), 0.0, far - far * math.cos(theta)), rotation=(0.0, theta, 0.0))
    beam = LineLaser(sheet=Waist(radius=2 * sigma, focus_distance=far, m_squared=1.0), T_rig_laser=pose, fan_angle=0.01)
    steps = np.linspace(-math.pi, math.pi, 200_001)[:-1]
    ring = np.stack([radius * np.sin(steps), np.zeros_like(steps), far - radius * np.cos(steps)], axis=1)
    low, high = (ring + np.array([0.0, y, 0.0]) for y in (-0.01, 0.01))
    n = len(steps)
    i, j = np.arange(n), (np.arange(n) + 1) % n
    triangles = np.concatenate([np.stack([i, j, j + n], axis=1), np.stack([i, j + n, i + n], axis=1)]).astype(np.int32)
    mesh = Mesh(np.concatenate([low, high]), triangles)
    scene = scene_of(camera, beam)
    parts = (camera, beam, scene.T_world_camera(), scene.T_world_laser(0))
    world = world_of(scene, mesh)
    curve = with_sheet_bias(laser_curve(world, *parts), world, *parts)
    x = curve.point[1, 0]
    z = -math.sqrt(radius**2 - x**2)
    m = invert(beam.T_rig_laser.matrix)[0]
    width = float(beam.sigma(transform_points(invert(beam.T_rig_laser.matrix), curve.point)[1, 2]))
    # dz/dx = -x / z, d2z/dx2 = -r^2 / z^3 of the near side; z from the camera is far + z
    q1 = (m[0] + m[2] * (-x / z)) / width
    q2 = m[2] * (-(radius**2) / z**3) / width
    normal = np.array([x, 0.0, z]) / radius
    towards = np.array([-math.sin(theta), 0.0, -math.cos(theta)])
    slope = np.array([1.0, 0.0, -x / z]) / radius @ towards / (normal @ towards)
    expected = (slope / q1**2 - 1.5 * q2 / q1**3) * camera.fx / (far + z)
    assert abs(expected) > 0.01
    assert curve.sheet_bias[1] == pytest.approx(expected, rel=0.01)


def test_a_plane_has_the_bias_of_the_perspective_alone_and_it_goes_with_the_square_of_the_width():
    camera = paper_camera(0.5)
    biases = []
    for sigma in (0.0003, 0.0006):
        curve, found = curve_and_biases(plane_mesh((0.2, 0.1, 1.0), 0.9), sheet(sigma), camera)
        np.testing.assert_allclose(found, curve.sheet_bias, atol=5e-4)
        biases.append(curve.sheet_bias)
    assert np.abs(biases[0]).max() < 2e-3
    assert np.median(biases[1] / biases[0]) == pytest.approx(4.0, rel=0.02)


def test_two_lines_on_a_row_share_what_is_between_them_and_darkness_has_no_bias():
    scene = scene_of(paper_camera(0.25), sheet(0.0003).model_copy(update={"power": 0.0}))
    world = world_of(scene, plane_mesh((0, 0, 1), 0.9))
    parts = (scene.camera, scene.lasers[0], scene.T_world_camera(), scene.T_world_laser(0))
    curve = with_sheet_bias(laser_curve(world, *parts), world, *parts)
    assert len(curve.index) > 100
    np.testing.assert_array_equal(curve.sheet_bias, 0.0)
    aside = (*parts[:3], Pose(translation=(9.0, 0.0, 0.0)).matrix)
    empty = with_sheet_bias(laser_curve(world, *aside), world, *aside)
    assert empty.sheet_bias.shape == (0,)
