"""Collects the materials of a world, with their images, shading normals and maps, while it is built."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from render.base.arrays import Float32
from render.base.errors import InputError
from render.material.material import (
    BaseMaterial,
    Blend,
    BumpMap,
    Coated,
    Conductor,
    FromMesh,
    Glass,
    GreyTexture,
    NormalMap,
    Texture,
)
from render.mesh.mesh import Mesh
from render.mesh.mesh_headers import check_together
from render.mesh.texture import MAX_PIXELS
from render.scene.scene import SceneObject
from render.world.surface_interaction import BUMP_MAP, LEAST_COAT, NORMAL_MAP, ROUGHNESS_MAP, SMOOTH_NORMALS

Place = tuple[int, int, int]
"""Start in the images, height, width of an image; height 0 for none."""
NOWHERE = (0, 0, 0)
"""Place of an image that a material does not have."""


class MaterialAtlas:
    """Lists with one entry a material, as `render.world.world.World` describes them. root: the project's folder."""

    def __init__(self, root: Path | None) -> None:
        self.root = root
        self.albedo: list[tuple[float, float, float]] = []
        self.images: list[Float32] = []
        self.shapes: list[Place] = []
        self.masks: list[Place] = []
        self.second: list[int] = []
        self.materials: list[BaseMaterial] = []
        self.places: list[str] = []
        self.detail: list[int] = []
        self.maps: list[tuple[Place, Place]] = []
        self.relief: list[tuple[float, float]] = []
        self.least_alpha: list[float] = []
        self.texels = 0
        self.known: dict[int, tuple[Float32, Place]] = {}
        """Images already added, by their id; kept alive so that no id is used twice. Objects share the same image."""

    def add(self, material: BaseMaterial, mesh: Mesh, where: str) -> int:
        """Add a material, with its mesh's texture or colour if it has one; returns its index.

        InputError: a map without UV, or a bad image.
        """
        uses_texture = isinstance(material.albedo, Texture | FromMesh) and mesh.texture is not None
        self.shapes.append(self.image(mesh.texture, where) if uses_texture and mesh.texture is not None else NOWHERE)
        self.albedo.append((1.0, 1.0, 1.0) if uses_texture else _constant_albedo(material, mesh))
        self.masks.append(NOWHERE)
        self.second.append(-1)
        self.materials.append(material)
        self.places.append(where)
        self._add_detail(material, mesh, where)
        return len(self.materials) - 1

    def add_blend(self, index: int, item: SceneObject, mesh: Mesh) -> None:
        """Add the second material and the mask of a blend. InputError: no UV, or a bad image."""
        assert isinstance(item.material, Blend)
        where = f"object {item.name!r}: material"
        mask = self._load(item.material.mask, mesh, f"{where}.mask")
        over = item.material.over
        texture = None
        if isinstance(over.albedo, Texture):
            texture = self._load(over.albedo, mesh, f"{where}.over.albedo")
        self.second[index] = self.add(over, replace(mesh, texture=texture), f"{where}.over")
        self.masks[index] = self.image(mask, f"{where}.mask")

    def image(self, image: Float32, where: str) -> Place:
        """Append an image (h, w, 3) unless it is there; returns its place. InputError: more than MAX_PIXELS in all."""
        if id(image) in self.known:
            return self.known[id(image)][1]
        place = (self.texels, image.shape[0], image.shape[1])
        self.texels += image.shape[0] * image.shape[1]
        check_together("pixels of textures", self.texels, MAX_PIXELS, where)
        self.images.append(np.asarray(image, dtype=np.float32).ravel())
        self.known[id(image)] = image, place
        return place

    def joined_images(self) -> Float32:
        """(n,) all images, concatenated; a single one is not copied."""
        if len(self.images) == 1:
            return self.images[0]
        return np.concatenate(self.images) if self.images else np.zeros(0, dtype=np.float32)

    def _add_detail(self, material: BaseMaterial, mesh: Mesh, where: str) -> None:
        flags = SMOOTH_NORMALS if mesh.normals is not None else 0
        roughness, relief, least, factors = NOWHERE, NOWHERE, 1.0, (0.0, 0.0)
        if isinstance(material, Conductor | Coated | Glass) and isinstance(material.roughness, GreyTexture):
            image = self._load(material.roughness, mesh, f"{where}.roughness")
            roughness, flags = self.image(image, where), flags | ROUGHNESS_MAP
            least = float(image.mean(axis=2).min())
            least = max(least, LEAST_COAT) if isinstance(material, Coated) else least
        match material.relief:
            case NormalMap() as given:
                values = centred(self._load(given, mesh, f"{where}.relief"))
                relief, flags = self.image(values, where), flags | NORMAL_MAP
                factors = given.strength, -given.strength if given.green_down else given.strength
            case BumpMap() as given:
                relief = self.image(self._load(given, mesh, f"{where}.relief"), where)
                flags, factors = flags | BUMP_MAP, (given.height, 0.0)
        self.detail.append(flags)
        self.maps.append((roughness, relief))
        self.least_alpha.append(least)
        self.relief.append(factors)

    def _load(self, texture: Texture | GreyTexture | NormalMap | BumpMap, mesh: Mesh, where: str) -> Float32:
        from render.mesh.load import object_texture

        if mesh.uv is None:
            raise InputError(
                "an image is given, but the mesh has no usable UV",
                where=where,
                found=texture.path,
                cure="give a number or leave it out, or unwrap the mesh and export it with UV",
            )
        if self.root is None:
            raise ValueError("a material with images needs the folder they are in")
        return object_texture(texture, self.root, f"{where}.path")


def centred(values: Float32) -> Float32:
    """A normal map's values in [0, 1] -> x such that the component is 2 x - 1, and 0 at the middle code: 128 of 255."""
    eight = bool(np.abs(values * 255.0 - np.rint(values * 255.0)).max() < 1e-3)
    most = 255.0 if eight else 65535.0
    middle = (most + 1.0) / 2.0
    return np.asarray(0.5 + 0.5 * (values * most - middle) / (middle - 1.0), dtype=np.float32)


def _constant_albedo(material: BaseMaterial, mesh: Mesh) -> tuple[float, float, float]:
    albedo = material.albedo
    if isinstance(albedo, FromMesh):
        return mesh.colour if mesh.colour is not None else (0.5, 0.5, 0.5)
    if isinstance(albedo, Texture):
        return (1.0, 1.0, 1.0)
    return albedo if isinstance(albedo, tuple) else (albedo, albedo, albedo)
