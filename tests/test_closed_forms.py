"""The closed forms judge the renderer, so they are held against the surfaces themselves."""

from __future__ import annotations

import math

import numpy as np
import pytest

from render.base.pose import rotation_matrix
from render.scene.shape import StepBlock, VGroove
from tests.closed_forms import (
    Array,
    cylinder_conic,
    sphere_conic,
    step_block_tops,
    triangulate,
    u_on_conic,
    u_on_plane,
    u_on_rectangles,
    v_groove_tops,
)

K = np.array([[3478.26, 0.7, 1223.5], [0.0, 3480.1, 1023.5], [0.0, 0.0, 1.0]])
ANGLE = math.radians(13)
LASER = np.array([math.cos(ANGLE), 0.02, math.sin(ANGLE), -0.2 * math.cos(ANGLE)])
LASER /= np.linalg.norm(LASER[:3])
ROWS = np.arange(0.0, 2048.0, 3.0)


def pose(x: float, y: float, z: float) -> Array:
    T = np.eye(4)
    # z of the object towards the camera
    T[:3, :3] = np.diag([1.0, -1.0, -1.0]) @ rotation_matrix(np.array([0.1, -0.2, 0.3]))
    T[:3, 3] = x, y, z
    return T


def on_sheet(points: Array) -> Array:
    return np.abs(points @ LASER[:3] + LASER[3])


def test_a_triangulated_point_lies_on_the_sheet_and_projects_back_to_its_pixel() -> None:
    u = np.linspace(900, 2400, 50)[:, None]  # depths of 0.4 to 1.5 m; at u = 420 rays run along the sheet
    points = triangulate(K, LASER, u, ROWS[None, :])
    assert on_sheet(points).max() < 1e-14
    image = points @ K.T
    np.testing.assert_allclose(image[..., 0] / image[..., 2], np.broadcast_to(u, image.shape[:2]), atol=1e-9)
    np.testing.assert_allclose(image[..., 1] / image[..., 2], np.broadcast_to(ROWS, image.shape[:2]), atol=1e-9)


@pytest.mark.parametrize("tilt", [-60, -20, 0, 30, 60])
def test_the_line_on_a_plane_triangulates_to_the_plane(tilt: float) -> None:
    n = np.array([math.sin(math.radians(tilt)), 0.1, -math.cos(math.radians(tilt))])
    plane = np.append(n, n @ (0.0, 0.0, 0.8663)) / np.linalg.norm(n)
    points = triangulate(K, LASER, u_on_plane(K, LASER, plane, ROWS), ROWS)
    assert np.abs(points @ plane[:3] - plane[3]).max() < 1e-12


def test_the_line_on_a_sphere_triangulates_to_the_sphere_in_the_rows_that_it_spans() -> None:
    centre, radius = np.array([0.01, -0.02, 0.88]), 0.05
    u = u_on_conic(K, sphere_conic(LASER, centre, radius), ROWS)
    hit = np.isfinite(u).all(axis=1)
    assert 100 < hit.sum() < len(ROWS)
    points = triangulate(K, LASER, u[hit], ROWS[hit, None])
    assert np.abs(np.linalg.norm(points - centre, axis=-1) - radius).max() < 1e-12


def test_a_row_meets_a_sphere_just_where_its_viewing_plane_does() -> None:
    # The row's plane, the sheet and the sphere: two points on the line of both planes, found without any conic.
    centre, radius = np.array([0.01, -0.02, 0.88]), 0.05
    u = u_on_conic(K, sphere_conic(LASER, centre, radius), ROWS)
    for v, found in zip(ROWS, u, strict=True):
        row = np.array([0.0, K[1, 1], K[1, 2] - v])
        direction = np.cross(row, LASER[:3])
        direction /= np.linalg.norm(direction)
        start = np.linalg.lstsq(np.stack([row, LASER[:3]]), np.array([0.0, -LASER[3]]), rcond=None)[0]
        offset = start - centre
        b, c = direction @ offset, offset @ offset - radius**2
        if b * b - c < 0:
            assert np.isnan(found).all()
            continue
        points = start + np.array([[-b - math.sqrt(b * b - c)], [-b + math.sqrt(b * b - c)]]) * direction
        image = points @ K.T
        np.testing.assert_allclose(found, np.sort(image[:, 0] / image[:, 2]), atol=1e-7)


@pytest.mark.parametrize("axis", [(0.0, 1.0, 0.0), (0.3, 0.8, -0.2), (1.0, 0.1, 0.2)])
def test_the_line_on_a_cylinder_triangulates_to_the_cylinder(axis: tuple[float, float, float]) -> None:
    a = np.array(axis) / np.linalg.norm(axis)
    point, radius = np.array([0.0, 0.01, 0.87]), 0.04
    u = u_on_conic(K, cylinder_conic(LASER, point, a, radius), ROWS)
    hit = np.isfinite(u).all(axis=1)
    assert hit.sum() > 50
    offset = triangulate(K, LASER, u[hit], ROWS[hit, None]) - point
    distance = np.linalg.norm(offset - (offset @ a)[..., None] * a, axis=-1)
    assert np.abs(distance - radius).max() < 1e-12


def test_the_line_on_a_step_block_lies_on_its_treads_and_risers() -> None:
    shape = StepBlock(steps=4, tread=0.03, rise=0.01, width=0.4)
    T = pose(0.0, 0.0, 0.9)
    tops = step_block_tops(shape, T)
    assert len(tops) == 8
    u = u_on_rectangles(K, LASER, tops, ROWS)
    assert np.isfinite(u).any(axis=1).sum() > 100
    for k, top in enumerate(tops):
        hit = np.isfinite(u[:, k])
        local = (triangulate(K, LASER, u[hit, k], ROWS[hit]) - T[:3, 3]) @ T[:3, :3]
        step = k // 2
        if k % 2:
            assert np.abs(local[:, 2] - (step + 1) * 0.01).max(initial=0.0) < 1e-12
        else:
            assert np.abs(local[:, 0] - (step - 2) * 0.03).max(initial=0.0) < 1e-12
        outward = T[:3, :3].T @ top.plane[:3]
        np.testing.assert_allclose(outward, (0, 0, 1) if k % 2 else (-1, 0, 0), atol=1e-15)


def test_the_line_on_a_v_groove_lies_on_its_flanks() -> None:
    shape = VGroove(angle=math.radians(80), depth=0.03, width=0.2, length=0.4, thickness=0.05)
    T = pose(-0.01, 0.0, 0.88)
    u = u_on_rectangles(K, LASER, v_groove_tops(shape, T), ROWS)
    assert (np.isfinite(u).sum(axis=0)[1:3] > 20).all()
    for k in range(4):
        hit = np.isfinite(u[:, k])
        local = (triangulate(K, LASER, u[hit, k], ROWS[hit]) - T[:3, 3]) @ T[:3, :3]
        depth = np.minimum(0.0, np.abs(local[:, 0]) / math.tan(math.radians(40)) - 0.03)
        assert np.abs(local[:, 2] - depth).max(initial=0.0) < 1e-12
