"""Sections against closed forms: a box gives a rectangle, a sphere a circle, and places keep their handedness."""

from __future__ import annotations

import math

import numpy as np
import pytest

from analysis.section import Plane, cut, near
from render.base.errors import InputError
from render.mesh.primitives import primitive_mesh
from render.scene.shape import Box, Sphere


def test_a_slanted_cut_of_a_box_is_a_closed_rectangle_of_known_sides() -> None:
    made = primitive_mesh(Box(size_x=0.08, size_y=0.05, size_z=0.03))
    turn = 0.3
    # a plane that holds the y axis cuts the upper and the lower face alone
    plane = Plane((0.0, 0.0, 0.0), (math.cos(turn), 0.0, math.sin(turn)))
    lines = cut(made.vertices, made.triangles, plane)
    assert len(lines) == 1 and np.allclose(lines[0][0], lines[0][-1])
    across, up = np.ptp(lines[0], axis=0)
    assert across == pytest.approx(0.05, abs=1e-12) and up == pytest.approx(0.03 / math.cos(turn), abs=1e-12)
    x, y = lines[0][:-1].T
    area = 0.5 * abs(float(x @ np.roll(y, 1) - y @ np.roll(x, 1)))
    assert area == pytest.approx(across * up, rel=1e-9)


def test_a_cut_of_a_sphere_is_a_circle() -> None:
    made = primitive_mesh(Sphere(radius=0.02, segments=256))
    plane = Plane((0.0, 0.0, 0.005), (0.0, 0.0, 1.0))
    (ring,) = cut(made.vertices, made.triangles, plane)
    radius = np.linalg.norm(ring, axis=1)
    # chords lie within the sphere by at most r (1 - cos(pi / n)), along both directions of the mesh
    exact = math.sqrt(0.02**2 - 0.005**2)
    assert radius.max() <= exact + 1e-12 and radius.min() > exact - 2.0 * 0.02 * (1.0 - math.cos(math.pi / 128))


def test_a_cut_along_a_strip_of_many_facets_is_one_line_with_a_place_for_each_edge_that_it_crosses() -> None:
    """Of 20,000 pieces, none lost and none twice."""
    n = 10_000
    x, side = np.repeat(np.linspace(0.0, 1.0, n + 1), 2), np.tile([-1e-3, 1e-3], n + 1)
    vertices = np.column_stack([x, side, 1e-3 * np.sin(20.0 * x)])
    corner = 2 * np.arange(n)[:, None]
    triangles = np.concatenate([corner + np.array(three) for three in ((0, 2, 1), (1, 2, 3))])
    (line,) = cut(vertices, triangles, Plane((0.0, 1e-4, 0.0), (0.0, 1.0, 0.0)))
    assert len(line) == 2 * n + 1
    along = np.abs(line[:, 0])
    assert np.ptp(along) == pytest.approx(1.0) and np.all(np.diff(along) > 0.0) | np.all(np.diff(along) < 0.0)


def test_two_bodies_are_two_lines_and_beside_them_is_nothing() -> None:
    one = primitive_mesh(Box(size_x=0.01, size_y=0.01, size_z=0.01))
    vertices = np.concatenate([one.vertices, one.vertices + np.array([0.05, 0.0, 0.0])])
    triangles = np.concatenate([one.triangles, one.triangles + len(one.vertices)])
    assert len(cut(vertices, triangles, Plane((0.0, 0.001, 0.0), (0.0, 1.0, 0.0)))) == 2
    assert cut(vertices, triangles, Plane((0.0, 0.02, 0.0), (0.0, 1.0, 0.0))) == []


@pytest.mark.parametrize("normal", [(1.0, 0.0, 0.0), (0.0, -3.0, 0.0), (0.0, 0.0, 2.0), (0.3, -0.5, 0.9)])
def test_axes_are_orthonormal_and_places_come_back(normal: tuple[float, float, float]) -> None:
    plane = Plane((0.1, -0.2, 0.3), normal)
    axes = plane.axes
    assert np.allclose(axes @ axes.T, np.eye(3), atol=1e-14) and np.linalg.det(axes) == pytest.approx(1.0)
    points = np.random.default_rng(1).normal(size=(50, 3))
    assert np.allclose(plane.world(plane.local(points)), points, atol=1e-14)
    assert plane.local(np.array([plane.point]))[0, 2] == pytest.approx(0.0, abs=1e-15)
    here, local = near(points, plane, 0.4)
    assert np.all(np.abs(local[:, 2]) <= 0.2) and len(here) == np.count_nonzero(
        np.abs(plane.local(points)[:, 2]) <= 0.2
    )


@pytest.mark.parametrize("point", [(0.1, -0.2, 0.3), (0.1, 5.0, -0.019)])
def test_a_section_counts_from_the_zero_of_the_world(point: tuple[float, float, float]) -> None:
    """Heights of a part that stands on the table were 19 um off, by where the section had been taken through."""
    places = np.random.default_rng(2).normal(size=(20, 3))
    x, y, z = places.T
    for normal, expected in (((1, 0, 0), (y, z)), ((0, 1, 0), (-x, z)), ((0, 0, 1), (x, y))):
        local = Plane(point, normal).local(places)
        assert np.allclose(local[:, :2].T, expected, rtol=0.0, atol=1e-14)


def test_a_plane_without_direction_is_refused() -> None:
    with pytest.raises(InputError, match="direction"):
        _ = Plane((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)).axes


def test_the_sheet_is_the_shadow_of_a_box_on_the_plane() -> None:
    low, high = np.array([-0.01, 0.02, 0.0]), np.array([0.03, 0.05, 0.04])
    plane = Plane((0.5, 0.0, 0.0), (1.0, 0.0, 0.0))
    assert np.allclose(
        plane.sheet(low, high), [(0.5, y, z) for y, z in ((0.02, 0), (0.05, 0), (0.05, 0.04), (0.02, 0.04))]
    )
    # a plane aslant meets a rectangle that holds every corner
    turned = Plane((0.0, 0.0, 0.0), (1.0, 1.0, 1.0))
    across, up = turned.local(turned.sheet(low, high))[:, :2].T
    corners = np.array([(x, y, z) for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
    shadow = turned.local(corners)
    assert (across.min(), across.max()) == pytest.approx((shadow[:, 0].min(), shadow[:, 0].max()))
    assert (up.min(), up.max()) == pytest.approx((shadow[:, 1].min(), shadow[:, 1].max()))
