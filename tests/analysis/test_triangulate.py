"""Triangulation against closed forms (laser 0.2 m beside the camera, turned by 13 degrees) and finite differences."""

from __future__ import annotations

import math

import numpy as np
import pytest

from analysis.line.result import Flag, Line
from analysis.triangulate import CALIBRATION, PointFlag, triangulate
from render.base.errors import InputError
from render.base.pose import Pose, invert, transform_points
from render.camera.camera import Camera

F, BASELINE, THETA = 3478.26, 0.2, math.radians(13)
CAMERA = Camera(width=2448, height=2048, fx=F, fy=F, cx=1223.5, cy=1023.5)
COEFFICIENTS = (-0.21, 0.13, 1e-3, -2e-3, 0.02, 0.1, 0.05, 0.01, 1e-3, 2e-4, -1e-3, 3e-4, 0.02, -0.01)
DISTORTED = CAMERA.model_copy(update={"skew": 1.5, "distortion": COEFFICIENTS})
PLANE = np.array([math.cos(THETA), 0.0, math.sin(THETA), -BASELINE * math.cos(THETA)])
T_RIG_CAMERA = Pose(translation=(0.1, -0.2, 0.3), rotation=(0.3, -0.2, 0.5)).matrix
T_WORLD_CAMERA = Pose(translation=(-1.0, 2.0, 0.7), rotation=(1.3, 0.4, -0.9)).matrix


def line_at(u: np.ndarray, v: np.ndarray, axis: str = "rows", sigma: float = 0.1) -> Line:
    """A line with one peak on each of the given scan lines, and NO_PEAK on the others."""
    along, index = (u, v) if axis == "rows" else (v, u)
    n = int(np.max(index)) + 1 if len(index) else 1
    position = np.full((n, 1), np.nan)
    position[index.astype(int), 0] = along
    flag = np.where(np.isfinite(position), Flag.OK, Flag.NO_PEAK).astype(np.uint8)
    full = np.full((n, 1), 1.0)
    return Line(axis, "ml", position, full * sigma, full, full, full, full, flag)  # type: ignore[arg-type]


def points_at(u, v, camera=CAMERA, plane=PLANE, axis="rows", covariance=None):
    line = line_at(np.atleast_1d(np.asarray(u, float)), np.atleast_1d(np.asarray(v, float)), axis)
    return triangulate(
        line, camera, plane, T_rig_camera=T_RIG_CAMERA, T_world_camera=T_WORLD_CAMERA, calibration_covariance=covariance
    )


def column_of_depth(z):
    return CAMERA.cx + F * (BASELINE / z - math.tan(THETA))


@pytest.mark.parametrize("axis", ["rows", "columns"])
@pytest.mark.parametrize("camera", [CAMERA, DISTORTED], ids=["pinhole", "distorted"])
def test_a_point_of_the_plane_comes_back_in_every_frame(camera, axis):
    random = np.random.default_rng(1)
    u, v = random.uniform(500, 1600, 200), np.arange(200.0) * 6 + 500
    if axis == "columns":
        u, v = np.arange(200.0) * 6 + 500, random.uniform(500, 1600, 200)
    points = points_at(u, v, camera, axis=axis)
    assert points.valid.all()
    pixel, _ = camera.project(points.camera)
    assert np.max(np.abs(pixel - np.stack([u, v], axis=1))) < 1e-9
    assert np.max(np.abs(points.camera @ PLANE[:3] + PLANE[3])) < 1e-14
    assert np.allclose(transform_points(invert(T_RIG_CAMERA), points.rig), points.camera, atol=1e-14)
    assert np.allclose(transform_points(invert(T_WORLD_CAMERA), points.world), points.camera, atol=1e-14)


def test_depth_follows_baseline_over_tangent():
    z = np.array([0.5, 0.7, 0.8663, 1.5])
    points = points_at(column_of_depth(z), 1000.0 + np.arange(4))
    assert np.allclose(points.depth_z, z, atol=1e-12)


@pytest.mark.parametrize(
    ("z", "column", "dz_du", "um_per_tenth", "in_plane", "angle"),
    [
        (0.5, 588, 0.359, 36, 0.369, 22.6),
        (0.6, 356, 0.518, 52, 0.531, 18.9),
        (0.7, 191, 0.704, 70, 0.723, 16.1),
        (0.8, 67, 0.920, 92, 0.944, 14.1),
        (0.8663, 0, 1.079, 107.9, 1.107, 13.0),
        (0.87, -3, 1.088, 108.8, 1.117, 12.9),
        (1.0, -107, 1.438, 144, 1.475, 11.2),
        (1.5, -339, 3.23, 323, 3.32, 7.4),
    ],
)
def test_depth_sensitivity_is_that_of_the_closed_form(z, column, dz_du, um_per_tenth, in_plane, angle):
    u = column_of_depth(z)
    central = CAMERA.model_copy(update={"cy": 0.0})
    points = points_at(u, 0.0, central)

    def agrees(value: float, printed: float, digits: int) -> bool:
        return abs(value - printed) <= 0.5001 * 10.0**-digits

    digits = 2 if z > 1 else 3
    assert agrees(u - CAMERA.cx, column, 0)
    assert agrees(abs(points.gradient[0, 2]) * 1e3, dz_du, digits)
    assert agrees(
        points.sigma_depth[0] * 1e6, um_per_tenth, 1 if um_per_tenth != int(um_per_tenth) else 0
    )  # sigma 0.1 px
    assert agrees(points.sigma[0] / 0.1 * 1e3, in_plane, digits)
    ray = points.camera[0] / np.linalg.norm(points.camera[0])
    assert agrees(math.degrees(math.asin(ray @ PLANE[:3])), angle, 1)
    assert points.gradient[0, 2] == pytest.approx(-(z**2) / (BASELINE * F), rel=1e-12)


def depth_change(plane=PLANE, camera=CAMERA, u=CAMERA.cx, reference_plane=PLANE) -> float:
    """mm by which the depth of a pixel on row cy moves when plane or camera change."""
    moved = points_at(u, 1023.0, camera.model_copy(update={"cy": 1023.0}), plane)
    still = points_at(u, 1023.0, CAMERA.model_copy(update={"cy": 1023.0}), reference_plane)
    return abs(float(moved.depth_z[0] - still.depth_z[0])) * 1e3


def plane_through_laser(theta: float) -> np.ndarray:
    return np.array([math.cos(theta), 0.0, math.sin(theta), -BASELINE * math.cos(theta)])


def test_a_milliradian_of_plane_about_the_laser_is_4_mm():
    one_mrad = depth_change(plane_through_laser(THETA + 5e-4)) + depth_change(plane_through_laser(THETA - 5e-4))
    assert one_mrad == pytest.approx(3.95, abs=0.005)


def test_a_tenth_of_a_millimetre_in_d_is_half_a_millimetre():
    assert depth_change(PLANE + np.array([0, 0, 0, 1e-4])) == pytest.approx(0.445, abs=0.0005)


def test_a_pixel_of_principal_point_is_a_millimetre():
    assert depth_change(camera=CAMERA.model_copy(update={"cx": CAMERA.cx + 1})) == pytest.approx(1.08, abs=0.005)


def test_a_pixel_of_focal_length_500_px_off_axis_is_a_sixth_of_a_millimetre():
    # at the same depth of 0.8663 m, with the laser turned so that it is seen there
    plane = plane_through_laser(math.atan(BASELINE / 0.8663 - 500 / F))
    moved = depth_change(plane, CAMERA.model_copy(update={"fx": F + 1}), CAMERA.cx + 500, plane)
    assert moved == pytest.approx(0.155, abs=0.0005)


@pytest.mark.parametrize("axis", ["rows", "columns"])
def test_gradient_is_the_derivative_of_the_point(axis):
    step = 1e-3
    u, v = np.array([700.0, 1500.0]), np.array([400.0, 1700.0])
    shift = (step, 0) if axis == "rows" else (0, step)
    here = points_at(u, v, DISTORTED, axis=axis)
    ahead = points_at(u + shift[0], v + shift[1], DISTORTED, axis=axis)
    behind = points_at(u - shift[0], v - shift[1], DISTORTED, axis=axis)
    assert np.allclose(here.gradient, (ahead.camera - behind.camera) / (2 * step), rtol=1e-6, atol=1e-10)


def test_systematic_covariance_is_that_of_perturbed_calibrations():
    names = {"fx": 0.3, "fy": 0.3, "cx": 0.2, "cy": 0.2, "a": 1e-4, "b": 1e-4, "c": 1e-4, "d": 1e-4}
    assert tuple(names) == CALIBRATION
    u, v = np.array([700.0]), np.array([400.0])
    wanted = np.zeros((3, 3))
    for i, (name, sigma) in enumerate(names.items()):
        ends = []
        for sign in (0.01, -0.01):
            camera, plane = DISTORTED, PLANE.copy()
            if i < 4:
                camera = DISTORTED.model_copy(update={name: getattr(DISTORTED, name) + sign * sigma})
            else:
                plane[i - 4] += sign * sigma
            ends.append(points_at(u, v, camera, plane).camera[0])
        derivative = (ends[0] - ends[1]) / 0.02
        wanted += np.outer(derivative, derivative)
    covariance = np.diag([sigma**2 for sigma in names.values()])
    found = points_at(u, v, DISTORTED, covariance=covariance).covariance_systematic
    assert found is not None
    assert np.allclose(found[0], wanted, rtol=1e-5, atol=1e-14)


def test_the_distortion_may_be_a_part_of_the_calibration():
    u, v = np.array([700.0]), np.array([400.0])
    sigmas = [0.3, 0.3, 0.2, 0.2, 1e-4, 1e-4, 1e-4, 1e-4, *np.full(len(DISTORTED.distortion), 1e-3)]
    plain = points_at(u, v, DISTORTED, covariance=np.diag(np.square(sigmas[:8]))).covariance_systematic
    whole = points_at(u, v, DISTORTED, covariance=np.diag(np.square(sigmas))).covariance_systematic
    assert plain is not None and whole is not None
    wanted = np.zeros((3, 3))
    for i in range(len(DISTORTED.distortion)):
        ends = []
        for step in (1e-5, -1e-5):
            moved = [k + step * (i == j) for j, k in enumerate(DISTORTED.distortion)]
            ends.append(points_at(u, v, DISTORTED.model_copy(update={"distortion": tuple(moved)})).camera[0])
        derivative = (ends[0] - ends[1]) / 2e-5 * 1e-3
        wanted += np.outer(derivative, derivative)
    assert np.allclose(whole[0] - plain[0], wanted, rtol=1e-5, atol=1e-14)


def test_random_covariance_is_that_of_noisy_lines():
    random = np.random.default_rng(4)
    here = points_at(900.0, 700.0, DISTORTED)
    noisy = np.concatenate([points_at(900.0 + e, 700.0, DISTORTED).camera for e in 0.1 * random.standard_normal(2000)])
    # the variance of a sample of 2000 has a relative standard deviation of sqrt(2 / 2000) = 3 %
    assert np.allclose(np.cov(noisy.T), here.covariance[0], rtol=0.13, atol=1e-12)
    assert np.sqrt(np.trace(here.covariance[0])) == pytest.approx(here.sigma[0])


def test_rays_along_the_plane_are_flagged_and_not_divided():
    vanishing = CAMERA.cx - F * math.tan(THETA)  # n . q = 0
    with np.errstate(all="raise"):
        points = points_at(
            vanishing + np.array([-50.0, -0.5, 0.0, 0.5, 50.0]), np.full(5, CAMERA.cy) + np.arange(5) - 0.5
        )
    assert points.flag.tolist() == [PointFlag.BEHIND, *[PointFlag.NEAR_PARALLEL] * 3, PointFlag.OK]
    assert np.isnan(points.camera[:4]).all()
    assert np.isnan(points.sigma[:4]).all()
    assert points.depth_z[4] > 10


def test_pixels_without_a_ray_are_flagged():
    barrel = CAMERA.model_copy(update={"distortion": (-0.4, 0.0, 0.0, 0.0), "fx": 800.0, "fy": 800.0})
    points = points_at(np.array([1223.0, 2440.0]), np.array([1023.0, 2040.0]), barrel)
    assert points.flag.tolist() == [PointFlag.OK, PointFlag.NO_RAY]
    assert np.isnan(points.world[1]).all()


def test_a_plane_through_the_camera_is_refused_in_words():
    with pytest.raises(InputError, match="camera's centre"):
        points_at(1000.0, 5.0, plane=np.array([1.0, 0.0, 0.0, 0.0]))
    with pytest.raises(InputError, match="not a plane"):
        points_at(1000.0, 5.0, plane=np.array([np.nan, 0.0, 0.0, 0.0]))


def test_the_scale_and_sign_of_the_plane_do_not_matter():
    assert np.allclose(points_at(900.0, 5.0, plane=-3.0 * PLANE).camera, points_at(900.0, 5.0).camera, atol=1e-14)


def test_a_line_without_peaks_gives_no_points():
    points = points_at(np.zeros(0), np.zeros(0))
    assert len(points.flag) == 0
    assert points.world.shape == (0, 3)
