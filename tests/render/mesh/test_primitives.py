"""Primitives: closed, outward, on their surface, and where their descriptions say."""

from __future__ import annotations

import math

import numpy as np
import pytest
import trimesh

from render.mesh.mesh import Mesh
from render.mesh.primitives import primitive_mesh, triangle_count
from render.scene.shape import Box, Cylinder, Plane, Primitive, Sphere, StepBlock, VGroove
from tests.closed_forms import step_block_tops, v_groove_tops

STEPS = StepBlock(steps=5, tread=0.02, rise=0.01, width=0.1)
GROOVE = VGroove(angle=math.radians(80), depth=0.02, width=0.2, length=0.3, thickness=0.03)
SOLIDS: list[tuple[Primitive, float]] = [
    (Box(size_x=0.1, size_y=0.2, size_z=0.3), 0.006),
    (Sphere(radius=0.05, segments=512), 4 / 3 * math.pi * 0.05**3),
    (Sphere(radius=0.05, segments=9), 4 / 3 * math.pi * 0.05**3),
    (Cylinder(radius=0.05, length=0.2, segments=512), math.pi * 0.05**2 * 0.2),
    (Cylinder(radius=0.05, length=0.2, segments=3), math.pi * 0.05**2 * 0.2),
    (STEPS, 0.02 * 0.01 * 0.1 * 15),
    (StepBlock(steps=1), 0.02 * 0.01 * 0.1),
    (GROOVE, 0.3 * (0.2 * 0.03 - 0.02**2 * math.tan(math.radians(40)))),
]


def as_trimesh(mesh: Mesh) -> trimesh.Trimesh:
    return trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False)


def facet_normals(mesh: Mesh) -> np.ndarray:
    a, b, c = (mesh.vertices[mesh.triangles[:, k]] for k in range(3))
    return np.cross(b - a, c - a)


@pytest.mark.parametrize(("shape", "volume"), SOLIDS)
def test_a_solid_is_closed_and_outward_with_the_volume_of_its_formula(shape: Primitive, volume: float) -> None:
    mesh = primitive_mesh(shape)
    solid = as_trimesh(mesh)
    assert solid.is_watertight and solid.is_winding_consistent
    segments = getattr(shape, "segments", None)
    if segments is None:
        assert solid.volume == pytest.approx(volume, rel=1e-12)
    else:  # inscribed facets fall short by a share that shrinks with their square
        assert volume * (1 - 30 / segments**2) < solid.volume < volume
    assert np.linalg.norm(facet_normals(mesh), axis=1).min() > 1e-9


@pytest.mark.parametrize("shape", [shape for shape, _ in SOLIDS] + [Plane()])
def test_a_mesh_has_the_types_that_kernels_are_compiled_for_and_uv_in_the_unit_square(shape: Primitive) -> None:
    mesh = primitive_mesh(shape)
    assert mesh.vertices.dtype == np.float64 and mesh.triangles.dtype == np.int32
    assert mesh.uv is not None and mesh.uv.dtype == np.float32 and mesh.uv.shape == (len(mesh.triangles), 3, 2)
    assert all(array.flags.c_contiguous for array in (mesh.vertices, mesh.triangles, mesh.uv))
    assert mesh.uv.min() >= 0.0 and mesh.uv.max() <= 1.0
    edge = mesh.uv[:, 1:] - mesh.uv[:, :1]
    area = edge[:, 0, 0] * edge[:, 1, 1] - edge[:, 0, 1] * edge[:, 1, 0]
    assert np.abs(area).min() > 0.0, "a triangle without area in the texture shows a single streak"


def test_a_plane_faces_up_with_u_along_x_and_v_along_y() -> None:
    mesh = primitive_mesh(Plane(width=0.4, height=0.2))
    np.testing.assert_allclose(facet_normals(mesh), [[0, 0, 0.08], [0, 0, 0.08]], atol=1e-15)
    corners = mesh.vertices[mesh.triangles]
    np.testing.assert_allclose(mesh.uv, corners[..., :2] / (0.4, 0.2) + 0.5, atol=1e-7)


def test_a_box_is_centred() -> None:
    mesh = primitive_mesh(Box(size_x=0.1, size_y=0.2, size_z=0.3))
    np.testing.assert_array_equal(mesh.vertices.max(axis=0), (0.05, 0.1, 0.15))
    np.testing.assert_array_equal(mesh.vertices.min(axis=0), (-0.05, -0.1, -0.15))


@pytest.mark.parametrize("segments", [8, 63, 256])
def test_vertices_of_a_sphere_and_a_cylinder_lie_on_the_surface_to_rounding(segments: int) -> None:
    sphere = primitive_mesh(Sphere(radius=0.05, segments=segments))
    assert np.abs(np.linalg.norm(sphere.vertices, axis=1) - 0.05).max() < 2e-17
    rim = primitive_mesh(Cylinder(radius=0.05, length=0.2, segments=segments)).vertices[:-2]
    assert np.abs(np.hypot(rim[:, 0], rim[:, 1]) - 0.05).max() < 2e-17
    np.testing.assert_array_equal(np.abs(rim[:, 2]), 0.1)


def test_facets_of_a_sphere_face_away_from_its_centre() -> None:
    mesh = primitive_mesh(Sphere(segments=64))
    centres = mesh.vertices[mesh.triangles].mean(axis=1)
    assert (np.einsum("ij,ij->i", facet_normals(mesh), centres) > 0).all()


def test_the_texture_wraps_a_sphere_without_a_seam() -> None:
    mesh = primitive_mesh(Sphere(segments=64))
    corners = mesh.vertices[mesh.triangles]
    assert mesh.uv is not None
    off_pole = np.hypot(corners[..., 0], corners[..., 1]) > 1e-6
    longitude = np.arctan2(corners[..., 1], corners[..., 0]) / (2 * np.pi)
    turns = mesh.uv[..., 0] - longitude
    assert np.abs(turns - np.round(turns))[off_pole].max() < 1e-6
    np.testing.assert_allclose(mesh.uv[..., 1], np.arcsin(corners[..., 2] / 0.05) / np.pi + 0.5, atol=1e-6)
    assert np.ptp(mesh.uv[..., 0], axis=1).max() < 1.01 / 64


@pytest.mark.parametrize(("shape", "tops"), [(STEPS, step_block_tops), (GROOVE, v_groove_tops)])
def test_the_upper_facets_of_a_prism_are_those_of_its_closed_form(shape: Primitive, tops) -> None:  # type: ignore[no-untyped-def]
    mesh = primitive_mesh(shape)
    centres, normals = mesh.vertices[mesh.triangles].mean(axis=1), facet_normals(mesh)
    areas = np.linalg.norm(normals, axis=1) / 2
    for rectangle in tops(shape, np.eye(4)):
        plane = rectangle.plane
        on = (
            (np.abs(centres @ plane[:3] - plane[3]) < 1e-15)
            & rectangle.holds(centres)
            & (normals @ plane[:3] > 0.999999 * 2 * areas)
        )
        assert on.sum() == 2
        assert areas[on].sum() == pytest.approx(np.linalg.norm(np.cross(rectangle.a, rectangle.b)), rel=1e-12)


def test_a_step_block_stands_on_z_0_and_climbs_along_x() -> None:
    mesh = primitive_mesh(STEPS)
    np.testing.assert_allclose(mesh.vertices.min(axis=0), (-0.05, -0.05, 0.0), atol=1e-16)
    np.testing.assert_allclose(mesh.vertices.max(axis=0), (0.05, 0.05, 0.05), atol=1e-16)
    assert mesh.vertices[mesh.vertices[:, 0] < -0.04][:, 2].max() == pytest.approx(0.01)


def test_the_number_of_a_primitives_triangles_is_known_before_it_is_made() -> None:
    balls = Sphere(segments=8), Sphere(segments=33)
    for shape in (Plane(), Box(), *balls, Cylinder(segments=7), StepBlock(steps=3), StepBlock(steps=1), VGroove()):
        assert triangle_count(shape) == len(primitive_mesh(shape).triangles), shape
