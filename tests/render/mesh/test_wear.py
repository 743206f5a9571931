"""Dents and scratches: their volume in closed form, closed surfaces stay closed, and what is fine elsewhere stays."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from render.base.errors import InputError
from render.mesh.load import load_mesh
from render.mesh.mesh import Mesh
from render.mesh.watertight import closed_outward, signed_volume
from render.mesh.wear import displacement, drawn_marks
from render.scene.scene import SceneObject
from render.scene.shape import Box, Cylinder, Parametric, Plane, Sphere, StepBlock, VGroove, WeldTee
from render.scene.wear import Wear

SHAPES = (Box(), Cylinder(segments=64), Sphere(), StepBlock(), VGroove(), WeldTee(triangles=2000))


def made(shape: Parametric, wear: Wear, scale: float = 1.0) -> Mesh:
    return load_mesh(SceneObject(name="part", shape=shape, wear=wear, scale=scale), Path())


def volume_below(mesh: Mesh) -> float:
    """Between z = 0 and a surface that was flat, m^3."""
    a, b, c = (mesh.vertices[mesh.triangles[:, k]] for k in range(3))
    return float(np.sum(np.cross(b - a, c - a)[:, 2] / 2 * (a + b + c)[:, 2] / 3))


def test_a_dent_holds_the_volume_of_its_bowl() -> None:
    wear = Wear(dents=1, dent_radius=0.01, dent_depth=0.002, seed=3)
    bowl = math.pi * wear.dent_radius**2 * wear.dent_depth / 3  # integral of (1 - r^2)^2 over the disc
    assert volume_below(made(Plane(), wear)) == pytest.approx(-bowl, rel=0.03)
    assert made(Plane(), wear).vertices[:, 2].min() == pytest.approx(-wear.dent_depth, rel=0.03)


def test_a_scratch_holds_the_volume_of_its_groove_and_of_its_two_ends() -> None:
    wear = Wear(scratches=1, scratch_length=0.05, scratch_width=0.004, scratch_depth=0.001, seed=3)
    width, depth = wear.scratch_width, wear.scratch_depth
    groove = wear.scratch_length * width * depth / 2 + math.pi * (width / 2) ** 2 * depth / 3
    assert volume_below(made(Plane(), wear)) == pytest.approx(-groove, rel=0.05)


def test_below_zero_marks_stand_out() -> None:
    wear = Wear(dents=2, dent_radius=0.01, dent_depth=-0.002, seed=3)
    assert made(Plane(), wear).vertices[:, 2].max() == pytest.approx(0.002, rel=0.03)


@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: shape.kind)
def test_a_closed_part_stays_closed_and_loses_what_was_pressed_in(shape: Parametric) -> None:
    wear = Wear(dents=5, dent_radius=0.004, dent_depth=0.0004, scratches=2, scratch_width=0.002, seed=1)
    new, old = made(shape, Wear()), made(shape, wear)
    assert closed_outward(old, "part") is old
    lost = signed_volume(new.vertices, new.triangles) - signed_volume(old.vertices, old.triangles)
    bowls = 5 * math.pi * wear.dent_radius**2 * wear.dent_depth / 3
    grooves = 2 * wear.scratch_length * wear.scratch_width * wear.scratch_depth / 2
    assert 0.3 * bowls < lost < 1.1 * (bowls + grooves)  # what lies over an edge presses in less


def test_far_from_every_mark_the_triangles_are_those_of_the_mesh() -> None:
    wear = Wear(dents=1, dent_radius=0.002, dent_depth=0.001, seed=5)
    new, old = made(WeldTee(), Wear()), made(WeldTee(), wear)
    kept = {tuple(row) for row in np.round(new.vertices[new.triangles].reshape(-1, 9), 9)}
    there = {tuple(row) for row in np.round(old.vertices[old.triangles].reshape(-1, 9), 9)}
    assert len(kept & there) > 0.99 * len(kept)


def test_textures_stay_where_they_were() -> None:
    wear = Wear(dents=3, dent_radius=0.02, dent_depth=1e-9, seed=2)
    mesh = made(Plane(width=0.2, height=0.1), wear)
    assert mesh.uv is not None
    expected = mesh.vertices[mesh.triangles][..., :2] / (0.2, 0.1) + 0.5
    assert np.abs(mesh.uv - expected).max() < 1e-6


def test_marks_are_spread_by_area() -> None:
    """Two hundred marks on a box: faces get their shares of the area within four standard deviations."""
    box = Box(size_x=0.1, size_y=0.2, size_z=0.3)
    mesh = made(box, Wear())
    marks = drawn_marks(mesh.vertices[mesh.triangles], Wear(dents=200, seed=4))
    half = np.array([box.size_x, box.size_y, box.size_z]) / 2
    face = np.abs(np.abs(marks.start) / half - 1.0).argmin(axis=1)
    areas = np.array([0.2 * 0.3, 0.1 * 0.3, 0.1 * 0.2])
    shares = areas / areas.sum()
    found = np.bincount(face, minlength=3) / 200
    assert np.all(np.abs(found - shares) < 4 * np.sqrt(shares * (1 - shares) / 200))


def test_scale_multiplies_the_part_and_not_its_marks() -> None:
    wear = Wear(dents=1, dent_radius=0.01, dent_depth=0.002, seed=3)
    assert made(Plane(), wear, scale=2.0).vertices[:, 2].min() == pytest.approx(-0.002, rel=0.03)


def test_marks_without_a_mark_move_nothing() -> None:
    mesh = made(Sphere(segments=16), Wear())
    marks = drawn_marks(mesh.vertices[mesh.triangles], Wear())
    assert not displacement(mesh.vertices, marks).any()


def test_marks_too_fine_for_the_memory_are_refused_by_name() -> None:
    wear = Wear(scratches=200, scratch_length=1.0, scratch_width=1e-6)
    with pytest.raises(InputError, match=r"'part': wear: .* too fine .* wider or fewer"):
        made(Plane(), wear)
