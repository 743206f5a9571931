"""What all objects of a scene hold together is bounded, and images that they share are kept once."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import render.mesh.load
import render.world.material_atlas
from render.base.errors import InputError
from render.camera.camera import Camera
from render.material.material import Blend, BumpMap, Lambertian, Texture
from render.scene.scene import Rig, Scene, SceneObject
from render.scene.shape import Plane, Sphere
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
