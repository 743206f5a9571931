"""The tee joint: three closed parts, a cross-section as designed, ripples and ground bands as asked."""

from __future__ import annotations

import math

import numpy as np
import pytest
import trimesh

from render.mesh.mesh import Mesh
from render.mesh.weld_tee import bead_outline, bead_surface, section, weld_tee_mesh
from render.scene.shape import WeldTee

SHAPES = [
    WeldTee(triangles=4000),
    WeldTee(triangles=4000, bevel_angle=0.0),
    WeldTee(triangles=4000, convexity=0.0, ripple_height=0.0),
    WeldTee(triangles=4000, convexity=0.006, ripple_height=0.006),  # the most that is allowed
    WeldTee(triangles=4000, bevel_angle=math.radians(75), thickness=0.05),
    WeldTee(triangles=4000, bevel_angle=1e-4),
    WeldTee(triangles=1000, length=1e-4, ripple_pitch=0.1),
    WeldTee(triangles=1000, leg=0.0119, upright_height=0.012, base_width=0.024),
]


def as_parts(mesh: Mesh) -> list[trimesh.Trimesh]:
    solid = trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False)
    return list(solid.split(only_watertight=False))


def cut(mesh: Mesh, y: float) -> np.ndarray:
    """(n, 2, 2) segments (x, z) of the mesh at height y."""
    lines = trimesh.intersections.mesh_plane(
        trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False), (0.0, 1.0, 0.0), (0.0, y, 0.0)
    )
    return np.asarray(lines)[:, :, (0, 2)]


@pytest.mark.parametrize("asked", [100, 1000, 30_000, 100_000])
def test_the_bead_has_about_the_triangles_asked_for(asked: int) -> None:
    mesh = weld_tee_mesh(WeldTee(triangles=asked))
    bead = as_parts(mesh)[2] if asked <= 1000 else None
    count = len(mesh.triangles) - 40 if bead is None else len(bead.faces)
    assert abs(count - asked) <= 0.1 * asked


@pytest.mark.parametrize("shape", SHAPES)
def test_every_part_is_closed_and_outward_without_flat_triangles(shape: WeldTee) -> None:
    parts = as_parts(weld_tee_mesh(shape))
    assert len(parts) == 3
    for part in parts:
        assert part.is_watertight and part.is_winding_consistent and part.volume > 0
        assert part.area_faces.min() > 0


@pytest.mark.parametrize("shape", SHAPES)
def test_the_bead_does_not_cross_itself(shape: WeldTee) -> None:
    # Each outline turns once around the joint's corner, always the same way.
    outline = bead_outline(shape, section(shape), 60, np.linspace(0, shape.ripple_pitch, 23))[:, :, (0, 2)]
    following = np.roll(outline, -1, axis=1)
    turn = np.arctan2(
        outline[..., 0] * following[..., 1] - outline[..., 1] * following[..., 0], (outline * following).sum(axis=-1)
    )
    assert turn.min() > 0
    np.testing.assert_allclose(turn.sum(axis=1), 2 * np.pi)


def test_the_volume_of_the_bead_is_that_of_its_cross_section() -> None:
    shape = WeldTee(ripple_height=0.0)
    design = section(shape)
    chord = shape.leg * math.sqrt(2)
    radius = (chord**2 / 4 + shape.convexity**2) / (2 * shape.convexity)
    half = math.asin(chord / 2 / radius)
    visible = shape.leg**2 / 2 + radius**2 * (half - math.sin(half) * math.cos(half))
    groove = design.bevel_depth * design.bevel_height / 2
    e = 2 * design.embedding
    volume = as_parts(weld_tee_mesh(shape))[2].volume / (shape.length - 2 * e)
    # The embedding adds a strip e wide along both contacts.
    hidden = 2 * shape.leg + math.hypot(design.bevel_depth, design.bevel_height) + design.bevel_depth
    assert visible + groove < volume < visible + groove + 1.5 * e * hidden


def test_a_cross_section_is_the_design_geometry() -> None:
    shape = WeldTee(triangles=20_000, ripple_height=0.0)
    segments = cut(weld_tee_mesh(shape), 0.0123)
    points = segments.reshape(-1, 2)
    x, z = points.T
    design = section(shape)
    on_base = (np.abs(z) < 1e-12) & (np.abs(x) <= 0.15)
    assert x[on_base].max() == pytest.approx(0.15) and x[on_base].min() == pytest.approx(-0.15)
    on_face = (np.abs(x) < 1e-12) & (z > shape.leg - 1e-12)
    assert z[on_face].min() == pytest.approx(shape.leg) and z[on_face].max() == pytest.approx(0.15)
    # The bevel rises by the bevel angle from the foot to the face.
    bevel = segments[np.abs(segments[:, :, 1]).min(axis=1) < 1e-12]
    bevel = bevel[np.ptp(bevel[:, :, 1], axis=1) > 1e-4]
    rise = np.concatenate([bevel[:, 1] - bevel[:, 0]])
    assert any(abs(math.atan2(abs(dz), abs(dx)) - shape.bevel_angle) < 1e-9 for dx, dz in rise)
    assert design.bevel_height == pytest.approx(design.bevel_depth * math.tan(shape.bevel_angle))
    # Outside both plates lies the bead, an arc through the toes with the convexity asked for.
    out = points[(x > 1e-9) & (z > 1e-9) & (x < 0.02) & (z < 0.02)]
    chord = shape.leg * math.sqrt(2)
    radius = (chord**2 / 4 + shape.convexity**2) / (2 * shape.convexity)
    centre = shape.leg / 2 + (shape.convexity - radius) / math.sqrt(2)
    inside = radius - np.linalg.norm(out - centre, axis=1)
    facet = design.bead_length / 12
    assert len(out) > 20
    assert (np.abs(inside) < 1e-12).sum() >= len(out) // 2 - 1, "corners lie on the arc"
    assert inside.min() > -1e-12 and inside.max() < 1.01 * facet**2 / (8 * radius), "diagonals within a facet's sagitta"
    assert (out.sum(axis=1) / math.sqrt(2)).max() == pytest.approx(chord / 2 + shape.convexity, rel=1e-3)


def test_the_ripples_have_the_height_and_pitch_asked_for_and_fade_at_the_toes() -> None:
    shape = WeldTee()
    y = np.linspace(0, 3 * shape.ripple_pitch, 3001)
    middle = np.linalg.norm(bead_surface(shape, np.full_like(y, 0.5), y)[:, (0, 2)], axis=1)
    assert np.ptp(middle) == pytest.approx(shape.ripple_height, rel=1e-6)
    assert middle.mean() == pytest.approx(shape.leg / math.sqrt(2) + shape.convexity, abs=shape.ripple_height / 2)
    np.testing.assert_allclose(middle[:1001], middle[1000:2001], atol=1e-12)
    for toe, expected in ((0.0, (shape.leg, 0.0)), (1.0, (0.0, shape.leg))):
        points = bead_surface(shape, np.full_like(y, toe), y)[:, (0, 2)]
        np.testing.assert_allclose(points, np.broadcast_to(expected, points.shape), atol=1e-15)


def test_the_mesh_samples_the_ripples_finely_enough_to_show_their_height() -> None:
    shape = WeldTee()
    points = weld_tee_mesh(shape).vertices
    radius = np.hypot(points[:, 0], points[:, 2])
    middle = (np.abs(np.arctan2(points[:, 2], points[:, 0]) - math.pi / 4) < math.radians(2)) & (radius > 0.005)
    assert middle.sum() > 10 * shape.length / shape.ripple_pitch
    assert np.ptp(radius[middle]) == pytest.approx(shape.ripple_height, rel=0.05)


def test_crests_bow_along_the_seam_as_crescents() -> None:
    shape = WeldTee()
    y = np.linspace(0, shape.ripple_pitch, 1000, endpoint=False)

    def crest(across: float) -> float:
        return float(y[np.linalg.norm(bead_surface(shape, np.full_like(y, across), y)[:, (0, 2)], axis=1).argmax()])

    lag = [(crest(a) - crest(0.5)) % shape.ripple_pitch for a in (0.25, 0.75)]
    assert lag[0] == pytest.approx(lag[1], abs=2e-6)
    assert lag[0] == pytest.approx(1.2 * 0.25 * shape.ripple_pitch, rel=0.02)


@pytest.mark.parametrize("shape", SHAPES)
def test_the_bead_is_embedded_so_that_no_light_passes(shape: WeldTee) -> None:
    # Seen from anywhere in front, the outline's hidden points are inside a plate.
    design = section(shape)
    outline = bead_outline(shape, design, 8, np.zeros(1))[0, 9:, (0, 2)].T
    x, z = outline.T
    in_base = (z < 0) & (z > -shape.thickness)
    above_bevel = z > design.bevel_height / max(design.bevel_depth, 1e-12) * (x + design.bevel_depth)
    in_upright = (x < 0) & (x > -shape.thickness) & above_bevel & (z < shape.upright_height)
    assert (in_base | in_upright).all()


def test_faces_of_different_parts_never_coincide() -> None:
    mesh = weld_tee_mesh(WeldTee(triangles=1000))
    corners = mesh.vertices[mesh.triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    part = np.repeat([0, 1, 2], [16, 24, len(mesh.triangles) - 40])
    for axis in range(3):
        flat = np.abs(np.abs(normal[:, axis]) - 1) < 1e-12
        level = np.round(corners[flat, 0, axis], 12)
        for value in np.unique(level):
            boxes = [(corners[flat][(level == value) & (part[flat] == k)].reshape(-1, 3)) for k in range(3)]
            for a in range(3):
                for b in range(a):
                    if len(boxes[a]) and len(boxes[b]):
                        low = np.maximum(boxes[a].min(axis=0), boxes[b].min(axis=0))
                        high = np.minimum(boxes[a].max(axis=0), boxes[b].max(axis=0))
                        across = np.delete(high - low, axis)
                        assert (across <= 1e-12).any()


def test_v_develops_the_front_from_the_base_edge_to_the_top_of_the_upright() -> None:
    shape = WeldTee(triangles=4000, ripple_height=0.0)
    design = section(shape)
    mesh = weld_tee_mesh(shape)
    corners = mesh.vertices[mesh.triangles]
    assert mesh.uv is not None
    length = design.developed
    front_base = (np.abs(corners[..., 2]) < 1e-12).all(axis=1) & (corners[..., 0].min(axis=1) > shape.leg - 1e-9)
    np.testing.assert_allclose(mesh.uv[front_base, :, 1], (0.15 - corners[front_base, :, 0]) / length, atol=1e-6)
    front_face = (np.abs(corners[..., 0]) < 1e-12).all(axis=1) & (corners[..., 2].min(axis=1) > shape.leg - 1e-9)
    np.testing.assert_allclose(mesh.uv[front_face, :, 1], 1 - (0.15 - corners[front_face, :, 2]) / length, atol=1e-6)
    assert front_base.sum() == 2 and front_face.sum() == 2
    toes = [mesh.uv[front_base, :, 1].max(), mesh.uv[front_face, :, 1].min()]
    np.testing.assert_allclose(toes, design.toes, atol=1e-6)
    # On the bead v grows with the arc: v * length is metric.
    bead = np.arange(len(corners)) >= 40
    edge = corners[bead][:, 2] - corners[bead][:, 1]
    dv = mesh.uv[bead][:, 2, 1] - mesh.uv[bead][:, 1, 1]
    outer = (corners[bead][..., (0, 2)].min(axis=(1, 2)) > 1e-4) & (np.abs(edge[:, 1]) < 1e-9)
    np.testing.assert_allclose(dv[outer] * length, np.linalg.norm(edge[outer], axis=1), rtol=2e-3)
    u = mesh.uv[..., 0][bead]
    np.testing.assert_allclose(u, corners[bead][..., 1] / shape.length + 0.5, atol=1e-6)


def test_nothing_but_the_front_shows_the_ground_band_or_the_bead() -> None:
    shape = WeldTee(triangles=1000)
    mesh = weld_tee_mesh(shape)
    corners = mesh.vertices[mesh.triangles]
    assert mesh.uv is not None
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    plates = np.arange(len(corners)) < 40
    front = (
        (normal[:, 2] > 0) & (corners[..., 0].min(axis=1) >= shape.leg - 1e-12) & (corners[..., 2].max(axis=1) < 1e-9)
    ) | ((normal[:, 0] > 0) & (corners[..., 2].min(axis=1) >= shape.leg - 1e-12))
    assert mesh.uv[plates & ~front][..., 1].max() <= section(shape).rust + 1e-7
    assert (mesh.uv[plates & front][..., 1].max(axis=0) > section(shape).rust).all()
