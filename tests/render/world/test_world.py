"""What all objects of a scene hold together is bounded, and images that they share are kept once."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import render.mesh.load
import render.world.material_atlas
from render.base.errors import InputError
from render.base.pose import Pose
from render.camera.camera import Camera
from render.material.material import Blend, BumpMap, Lambertian, Texture
from render.scene.motion import LinearStage, Turntable
from render.scene.scene import Rig, Scene, SceneObject
from render.scene.shape import Box, Plane, Sphere
from render.world.world import build_world


def scene_of(*items: SceneObject) -> Scene:
    return Scene(rig=Rig(camera=Camera(width=4, height=4, fx=4, fy=4, cx=1.5, cy=1.5)), objects=items)


def test_what_a_scene_holds_together_is_bounded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[object] = []
    original = render.mesh.load.primitive_mesh
    monkeypatch.setattr(render.mesh.load, "primitive_mesh", lambda shape: made.append(shape) or original(shape))
    monkeypatch.setattr(render.mesh.load, "MAX_TRIANGLES", 300)
    balls = [SceneObject(name=f"ball {k}", shape=Sphere(segments=16, radius=0.1 + 0.01 * k)) for k in range(3)]
    assert len(build_world(scene_of(*balls[:1]), tmp_path).triangles) == 2 * 16 * 7
    with pytest.raises(
        InputError, match=r"object 'ball 1': the scene has too many triangles; found 448.*at most 300 in"
    ):
        build_world(scene_of(*balls), tmp_path)
    assert len(made) == 1, "the second is told before it is made"
    hidden = [balls[0], *(ball.model_copy(update={"visible": False}) for ball in balls[1:])]
    assert len(build_world(scene_of(*hidden), tmp_path).triangles) == 224


def test_images_are_counted_once_however_many_objects_share_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("a", "b", "c"):
        Image.fromarray(np.full((10, 10, 3), 99, dtype=np.uint8)).save(tmp_path / f"{name}.png")
    monkeypatch.setattr(render.mesh.load, "MAX_PIXELS", 250)
    monkeypatch.setattr(render.world.material_atlas, "MAX_PIXELS", 250)

    def items(*names: str) -> list[SceneObject]:
        looks = [Lambertian(albedo=Texture(path=f"{name}.png")) for name in names]
        return [SceneObject(name=f"{k}", shape=Plane(), material=look) for k, look in enumerate(looks)]

    world = build_world(scene_of(*items("a", "b", "a", "b", "a")), tmp_path)
    assert len(world.textures) == 200 * 3
    assert world.texture_shape.tolist() == [[0, 10, 10], [100, 10, 10]] * 2 + [[0, 10, 10]]
    with pytest.raises(InputError, match=r"object '2': the scene has too many pixels of textures; found 300"):
        build_world(scene_of(*items("a", "b", "c")), tmp_path)
    bumps = Lambertian(albedo=Texture(path="a.png"), relief=BumpMap(path="b.png", height=1e-3))
    masked = Blend(base=bumps, over=Lambertian(), mask=Texture(path="c.png", srgb=False))
    with pytest.raises(InputError, match=r"object 'p': material\.mask: the scene has too many pixels of textures"):
        build_world(scene_of(SceneObject(name="p", shape=Plane(), material=masked)), tmp_path)


def test_the_boxes_of_objects_are_those_of_their_own_vertices(tmp_path: Path) -> None:
    shift = Pose(translation=(1.0, 0.0, 0.0))
    ball = SceneObject(name="ball", shape=Sphere(segments=16, radius=0.1), T_world_object=shift)
    low, high = build_world(
        scene_of(SceneObject(name="plane", shape=Plane(width=0.4, height=0.2)), ball), tmp_path
    ).boxes
    assert low == pytest.approx(np.array([(-0.2, -0.1, 0.0), (0.9, -0.1, -0.1)]), abs=2e-3)
    assert high == pytest.approx(np.array([(0.2, 0.1, 0.0), (1.1, 0.1, 0.1)]), abs=2e-3)


@pytest.mark.parametrize("motion", ["shift", "turn"])
def test_a_world_that_is_moved_is_that_of_the_step(motion):
    """Its triangles, its normals and what rays meet; after a shift on the tree of the first, which stays as it is."""
    item = SceneObject(name="ball", shape=Sphere(radius=0.05), crease_angle=3.0)
    poses = {
        "shift": LinearStage(moves="objects", step=(0.003, -0.001, 0.002), steps=40),
        "turn": Turntable(moves="objects", centre=(0.02, 0.0, 0.01), axis=(0.2, -0.3, 1.0), angle_step=0.11),
    }
    scene = scene_of(item, SceneObject(name="box", shape=Box(size_x=0.1, size_y=0.04, size_z=0.03)))
    scene = scene.model_copy(update={"motion": poses[motion]})
    first, placed = build_world(scene, Path(), 0), build_world(scene, Path(), 29)
    moved = first.moved(scene.motion.displacement(29))
    assert moved.vertices == pytest.approx(placed.vertices, abs=1e-15)
    assert moved.normals == pytest.approx(placed.normals, abs=1e-6) and len(moved.normals)
    assert (moved.rays._tree is first.rays._tree) == (motion == "shift")
    # twice moved is moved by both, and back again is where it was
    half = first.moved(scene.motion.displacement(12))
    again = half.moved(scene.motion.displacement(29) @ np.linalg.inv(scene.motion.displacement(12)))
    random = np.random.default_rng(4)
    towards = random.normal(size=(20_000, 3))
    towards = (towards / np.linalg.norm(towards, axis=1)[:, None]).astype(np.float32)
    eye = placed.vertices.mean(axis=0) + np.array([0.0, 0.0, 0.09])
    for other in (moved, again):
        hits = [world.rays.from_point(eye, towards) for world in (placed, other)]
        same = hits[0] == hits[1]
        assert np.mean(same) > 0.999 and (hits[0] >= 0).sum() > 100
        starts = [(eye - world.rays.centre + 0.05 * towards).astype(np.float32) for world in (placed, other)]
        found = [world.rays.intersect(start, -towards) for world, start in zip((placed, other), starts, strict=True)]
        both = (found[0][0] == found[1][0]) & (found[0][0] >= 0)
        near = 2.0 * moved.rays.surface_offset
        assert both.sum() > 100 and found[1][1][both] == pytest.approx(found[0][1][both], abs=near)
        dark = [
            world.rays.occluded(start, -towards, np.full(len(towards), 0.3, np.float32))
            for world, start in zip((placed, other), starts, strict=True)
        ]
        assert np.mean(dark[0] == dark[1]) > 0.999 and dark[0].any()
    fresh = build_world(scene, Path(), 0)
    assert np.array_equal(first.rays.from_point(eye, towards), fresh.rays.from_point(eye, towards))
