"""Bodies look in the 3D view as their materials say."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from render.material.material import Blend, Conductor, Emitter, Glass, Lambertian, Material, Texture
from render.scene.scene import SceneObject
from render.scene.shape import Box
from studio.preview.preview import Preview
from studio.qt.viewport.mesh_actor import GLASS_OPACITY, encoded, mesh_actor


def look(material: Material, root: Path) -> Any:
    preview, item = Preview(), SceneObject(name="box", shape=Box(), material=material)
    preview.load(item, root)
    (body,) = preview._bodies.values()
    return mesh_actor(body.surface)


def test_glass_is_seen_through_and_metal_has_its_colour(tmp_path: Path) -> None:
    assert look(Glass(tint=(0.5, 0.9, 0.5)), tmp_path).GetProperty().GetOpacity() == GLASS_OPACITY
    assert look(Lambertian(), tmp_path).GetProperty().GetOpacity() == 1.0
    red, green, blue = look(Conductor(metal="gold"), tmp_path).GetProperty().GetColor()
    assert red > green > blue > 0.3
    silver = look(Conductor(metal="silver", tint=0.5), tmp_path).GetProperty().GetColor()
    assert max(silver) - min(silver) < 0.05 and silver[0] == pytest.approx(float(encoded(0.5)), abs=0.03)
    shining = look(Emitter(radiance=(8.0, 2.0, 0.0)), tmp_path).GetProperty()
    assert shining.GetColor() == pytest.approx((1.0, float(encoded(0.25)), 0.0)) and shining.GetDiffuse() == 0.0


def test_a_blend_of_images_shows_that_of_its_base(tmp_path: Path) -> None:
    cv2.imwrite(str(tmp_path / "rust.png"), np.full((3, 5, 3), (0, 0, 200), np.uint8))
    cv2.imwrite(str(tmp_path / "mask.png"), np.full((7, 2, 3), 128, np.uint8))
    material = Blend(base=Lambertian(albedo=Texture(path="rust.png")), mask=Texture(path="mask.png", srgb=False))
    image = look(material, tmp_path).GetTexture().GetInput()
    assert image.GetDimensions()[:2] == (5, 3)
