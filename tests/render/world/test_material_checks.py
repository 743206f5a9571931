"""Impossible materials and light are refused, and doubtful ones named, before any ray is traced."""

from __future__ import annotations

import math

import numpy as np
import pytest
import trimesh

from render.base.errors import InputError
from render.base.pose import Pose
from render.material.material import (
    Blend,
    BumpMap,
    Coated,
    Conductor,
    Emitter,
    Glass,
    GreyTexture,
    Lambertian,
    NormalMap,
    Subsurface,
    Texture,
)
from render.mesh.load import load_mesh
from render.render import render_world
from render.scene.lights import Environment, PointLight
from render.scene.scene import SceneObject
from render.scene.shape import Box, Cylinder, MeshFile, Plane, Sphere, WeldTee
from render.world.material_checks import check_materials, departure, scene_warnings
from render.world.world import build_world
from tests.render.scenes import paper_camera, paper_laser, scene_of

AHEAD = Pose(translation=(0.0, 0.0, 0.9))


def scene_with(*items, lasers=None, **parts):
    scene = scene_of(paper_camera(0.05), *(lasers if lasers is not None else (paper_laser(),)), **parts)
    return scene.model_copy(update={"objects": items})


def ball(**changes):
    return SceneObject(**{"name": "ball", "shape": Sphere(segments=32), "T_world_object": AHEAD} | changes)


@pytest.mark.parametrize("material", [Glass(), Subsurface()])
def test_glass_must_be_closed(material, tmp_path):
    with pytest.raises(InputError, match=r"object 'ball': shape: .*closed surface.*4 of 5 edges.*coated"):
        load_mesh(ball(shape=Plane(), material=material), tmp_path)
    for shape in (Box(), Sphere(segments=8), WeldTee(triangles=2000)):
        load_mesh(ball(shape=shape, material=material), tmp_path)


def test_files_that_are_open_or_wound_both_ways_are_told_as_glass(tmp_path):
    whole = trimesh.creation.icosphere(subdivisions=2, radius=0.05)
    trimesh.Trimesh(whole.vertices, whole.faces[1:]).export(tmp_path / "open.stl")
    faces = whole.faces.copy()
    faces[5] = faces[5][::-1]
    trimesh.Trimesh(whole.vertices, faces, process=False).export(tmp_path / "mixed.ply")
    whole.export(tmp_path / "whole.stl")
    trimesh.Trimesh(whole.vertices, whole.faces[:, ::-1], process=False).export(tmp_path / "inward.ply")

    def load(name, material):
        return load_mesh(ball(shape=MeshFile(path=name), material=material), tmp_path)

    with pytest.raises(InputError, match=r"'ball': open.stl: .*3 of 480 edges are of one triangle"):
        load("open.stl", Glass())
    with pytest.raises(InputError, match=r"mixed.ply: .*3 of 480 edges lie between triangles that face opposite"):
        load("mixed.ply", Glass())
    load("open.stl", Coated())
    assert volume(load("whole.stl", Glass())) > 0
    # a body with its normals inwards is meant the other way round
    assert volume(load("inward.ply", Lambertian())) < 0 < volume(load("inward.ply", Subsurface()))


def volume(mesh):
    a, b, c = np.moveaxis(mesh.vertices[mesh.triangles], 1, 0)
    return np.einsum("ij,ij->", a, np.cross(b, c)) / 6


@pytest.mark.parametrize(
    ("material", "field"),
    [
        (Conductor(roughness=GreyTexture(path="a.png")), "material.roughness"),
        (Glass(roughness=GreyTexture(path="a.png")), "material.roughness"),
        (Lambertian(relief=NormalMap(path="a.png")), "material.relief"),
        (Coated(relief=BumpMap(path="a.png")), "material.relief"),
        (Blend(mask=Texture(path="a.png")), "material.mask"),
        (Blend(mask=Texture(path="a.png"), base=Conductor(relief=BumpMap(path="a.png"))), "material.base.relief"),
    ],
)
def test_images_that_are_not_there_or_cannot_be_mapped_are_named(material, field, tmp_path):
    scene = scene_with(ball(material=material))
    with pytest.raises(InputError, match=rf"object 'ball': {field}\.path: a\.png: the texture is not there"):
        build_world(scene, tmp_path)
    trimesh.creation.icosphere(subdivisions=1, radius=0.05).export(tmp_path / "plain.stl")
    scene = scene_with(ball(material=material, shape=MeshFile(path="plain.stl")))
    with pytest.raises(InputError, match=rf"object 'ball': {field}: .*no usable UV.*a\.png"):
        build_world(scene, tmp_path)


@pytest.mark.parametrize(
    ("material", "field"), [(Conductor(metal="gold"), "metal"), (Glass(substance="acrylic"), "substance")]
)
def test_what_is_not_known_at_a_wavelength_is_told_with_object_and_laser(material, field, tmp_path):
    scene = scene_with(ball(material=material), lasers=(paper_laser(wavelength_nm=1550.0),))
    world = build_world(scene, tmp_path)
    expected = rf"object 'ball': material\.{field}: .*1550 nm, the wavelength of scene\.rig\.lasers\[0\]"
    with pytest.raises(InputError, match=expected):
        check_materials(world, scene)
    with pytest.raises(InputError, match=expected):
        render_world(world, scene)


def warnings_of(scene, root) -> tuple[str, ...]:
    return scene_warnings(build_world(scene, root), scene)


def test_a_scene_that_no_light_reaches_is_named(tmp_path):
    assert any("no light reaches the scene" in text for text in warnings_of(scene_with(ball(), lasers=()), tmp_path))
    away = paper_laser(T_rig_laser=Pose(translation=(0.2, 0.0, 0.0), rotation=(0.0, math.pi, 0.0)), name="left")
    missed = warnings_of(scene_with(ball(), lasers=(away,)), tmp_path)
    assert len(missed) == 2 and "lasers[0] (left): its light meets no object" in missed[0]
    for parts in ({"lights": (PointLight(name="lamp"),)}, {"environment": Environment(radiance=(1.0, 1.0, 1.0))}):
        assert len(warnings_of(scene_with(ball(), lasers=(away,), **parts), tmp_path)) == 1
    assert warnings_of(scene_with(ball(material=Emitter()), lasers=()), tmp_path) == ()
    assert warnings_of(scene_with(ball()), tmp_path) == ()


def test_shading_that_departs_from_the_facets_is_told_with_its_depth(tmp_path):
    def off(segments, crease_angle=1.0):
        scene = scene_with(ball(shape=Sphere(segments=segments), crease_angle=crease_angle))
        return departure(build_world(scene, tmp_path), scene, 0), warnings_of(scene, tmp_path)

    # the sagitta of a great circle's chord along a facet's longest side, its diagonal
    coarse, told = off(16)
    diagonal = 0.05 * math.sqrt(2) * 2 * math.sin(math.pi / 16)
    assert coarse.depth == pytest.approx(diagonal**2 / (8 * 0.05), rel=0.1)
    assert len(told) == 1 and "object 'ball': smooth shading" in told[0] and "px of the line" in told[0]
    assert "a smaller 'Smooth shading up to' (crease_angle)" in told[0], "as the window and as the file name it"
    fine, quiet = off(512)
    assert quiet == () and fine.depth == pytest.approx(coarse.depth / 1024, rel=0.1)
    assert fine.angle == pytest.approx(coarse.angle / 32, rel=0.1)
    assert off(16, crease_angle=0.0) == (None, ())


def across(**changes):
    """Its z axis in the image."""
    return ball(**{"T_world_object": Pose(translation=(0.0, 0.0, 0.9), rotation=(math.pi / 2, 0.0, 0.0))} | changes)


def test_the_depth_of_shading_is_that_of_a_cylinder_however_long_its_facets_are(tmp_path):
    """A facet's length along the axis was taken for one along the bend: 0.6 mm was told of a part that is 1 um off."""
    scene = scene_with(across(shape=Cylinder(radius=0.02, length=0.1, segments=96), crease_angle=0.5))
    off = departure(build_world(scene, tmp_path), scene, 0)
    assert off.depth == pytest.approx(0.02 * (1.0 - math.cos(math.pi / 96)), rel=0.02)
    assert off.angle == pytest.approx(math.pi / 96, rel=1e-3)


def test_a_flat_face_that_is_shaded_as_bent_at_its_rim_is_told(tmp_path):
    """One corner of a square of 0.1 m turned by 2 degrees: an edge that begins so bulges by an eighth of its slope."""
    mesh = trimesh.Trimesh([[0, 0, 0], [0.1, 0, 0], [0.1, 0.1, 0], [0, 0.1, 0]], [[0, 1, 2], [0, 2, 3]], process=False)
    slope = math.tan(math.radians(2.0))
    mesh.vertex_normals = [[0, -slope, 1], [0, 0, 1], [0, 0, 1], [0, 0, 1]]
    mesh.export(tmp_path / "plate.ply", vertex_normal=True)
    turned = Pose(translation=(0.0, 0.0, 0.9), rotation=(math.pi, 0.0, 0.0))
    scene = scene_with(ball(shape=MeshFile(path="plate.ply"), crease_angle=0.5, T_world_object=turned))
    off = departure(build_world(scene, tmp_path), scene, 0)
    assert off is not None and off.depth == pytest.approx(0.1 * slope / 8.0, rel=0.01)


def test_a_frame_carries_its_warnings(tmp_path):
    scene = scene_with(ball(shape=Sphere(segments=12), crease_angle=1.0))
    frame = render_world(build_world(scene, tmp_path), scene)
    assert len(frame.warnings) == 1 and "smooth shading" in frame.warnings[0]


def test_worlds_know_whose_each_material_is(tmp_path):
    scene = scene_with(ball(), ball(name="cube", shape=Box(), material=Glass()))
    world = build_world(scene, tmp_path)
    assert world.places == ("object 'ball': material", "object 'cube': material")
