"""The scene's triangles in world coordinates at one step: what every later stage computes on."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from render.bsdf import ROW
from render.embree import RayScene
from render.errors import InputError
from render.material import BAND_CENTRES_NM, BaseMaterial, Blend, FromMesh, Texture
from render.material_rows import material_row
from render.mesh import Mesh
from render.pose import transform_points
from render.scene import Scene, SceneObject
from render.surface import Surface

Float = NDArray[np.float64]
Float32 = NDArray[np.float32]
Int = NDArray[np.int32]


@dataclass(frozen=True)
class World:
    """All triangles of the visible objects; object_id indexes `scene.visible_objects`."""

    vertices: Float
    """(v, 3) m, world."""
    triangles: Int
    """(t, 3)."""
    object_id: Int
    """(t,)."""
    uv: Float32
    """(t, 3, 2), or (0, 3, 2) when no object has a texture."""
    albedo: Float
    """(s, 3) RGB reflectance of each material; the first o are the objects' own, then the second parts of blends."""
    textures: Float32
    """(n,) all textures, one after the other, RGB linear."""
    texture_shape: Int
    """(s, 3) start, height, width in `textures`; height 0 for none."""
    second: Int
    """(s,) the material that a blend's mask brings in, -1 for none."""
    mask_shape: Int
    """(s, 3) the blend's mask, as in `texture_shape`."""
    materials: tuple[BaseMaterial, ...]
    """(s,) descriptions, blends taken apart."""

    @cached_property
    def rays(self) -> RayScene:
        """The scene for ray queries, built at first use."""
        return RayScene(self.vertices, self.triangles)

    @property
    def surface(self) -> Surface:
        """The arrays, as the kernels take them, for ambient light."""
        return self.surface_at(BAND_CENTRES_NM)

    def surface_at(self, bands_nm: tuple[float, float, float]) -> Surface:
        """The arrays, as the kernels take them, with what the materials do to three wavelengths."""
        rows = np.array([material_row(material, bands_nm) for material in self.materials]).reshape(-1, ROW)
        return Surface(
            self.vertices,
            self.triangles,
            self.object_id,
            self.uv,
            self.albedo,
            self.textures,
            self.texture_shape,
            rows,
            self.second,
            self.mask_shape,
        )


def build_world(scene: Scene, root: Path, step: int = 0) -> World:
    """Load the visible objects' meshes and place them for a step. Raises InputError for a bad mesh or texture."""
    from render.mesh_files import load_mesh

    return place_meshes(scene, [load_mesh(item, root) for item in scene.visible_objects], step, root)


def place_meshes(scene: Scene, meshes: list[Mesh], step: int = 0, root: Path | None = None) -> World:
    """Meshes of `scene.visible_objects`, in that order -> one world. root: where the textures of blends are."""
    pairs = list(zip(scene.visible_objects, meshes, strict=True))
    atlas = _Atlas()
    vertices, triangles, object_ids, uvs = [], [], [], []
    offset = 0
    for i, (item, mesh) in enumerate(pairs):
        vertices.append(transform_points(scene.T_world_object(item, step), mesh.vertices))
        triangles.append(mesh.triangles + np.int32(offset))
        object_ids.append(np.full(len(mesh.triangles), i, dtype=np.int32))
        offset += len(mesh.vertices)
        uvs.append(mesh.uv if mesh.uv is not None else np.zeros((len(mesh.triangles), 3, 2), dtype=np.float32))
        material = item.material.base if isinstance(item.material, Blend) else item.material
        atlas.add(material, mesh)
    for i, (item, mesh) in enumerate(pairs):
        if isinstance(item.material, Blend):
            atlas.add_blend(i, item, mesh, root)
    keep_uv = bool(atlas.images) or any(mesh.uv is not None for _, mesh in pairs)
    return World(
        vertices=np.concatenate(vertices) if vertices else np.zeros((0, 3)),
        triangles=np.concatenate(triangles) if triangles else np.zeros((0, 3), dtype=np.int32),
        object_id=np.concatenate(object_ids) if object_ids else np.zeros(0, dtype=np.int32),
        uv=np.ascontiguousarray(np.concatenate(uvs), dtype=np.float32) if keep_uv else np.zeros((0, 3, 2), np.float32),
        albedo=np.array(atlas.albedo).reshape(-1, 3),
        textures=np.concatenate(atlas.images) if atlas.images else np.zeros(0, dtype=np.float32),
        texture_shape=np.array(atlas.shapes, dtype=np.int32).reshape(-1, 3),
        second=np.array(atlas.second, dtype=np.int32),
        mask_shape=np.array(atlas.masks, dtype=np.int32).reshape(-1, 3),
        materials=tuple(atlas.materials),
    )


class _Atlas:
    """Collects materials and their textures while a world is put together."""

    def __init__(self) -> None:
        self.albedo: list[tuple[float, float, float]] = []
        self.images: list[Float32] = []
        self.shapes: list[tuple[int, int, int]] = []
        self.masks: list[tuple[int, int, int]] = []
        self.second: list[int] = []
        self.materials: list[BaseMaterial] = []
        self.texels = 0

    def add(self, material: BaseMaterial, mesh: Mesh) -> int:
        """A material with the texture or colour that its mesh brings; returns its number."""
        uses_texture = isinstance(material.albedo, Texture | FromMesh) and mesh.texture is not None
        self.shapes.append(self.image(mesh.texture) if uses_texture and mesh.texture is not None else (0, 0, 0))
        self.albedo.append((1.0, 1.0, 1.0) if uses_texture else _constant_albedo(material, mesh))
        self.masks.append((0, 0, 0))
        self.second.append(-1)
        self.materials.append(material)
        return len(self.materials) - 1

    def add_blend(self, index: int, item: SceneObject, mesh: Mesh, root: Path | None) -> None:
        """The second material and the mask of a blend. InputError: no UV, or a bad image."""
        from render.mesh_files import object_texture

        assert isinstance(item.material, Blend)
        where = f"object {item.name!r}"
        if root is None or mesh.uv is None:
            raise InputError(
                "a blend needs a mesh with UV",
                where=f"{where}: material.mask",
                cure="use one of the two materials alone, or unwrap the mesh and export it with UV",
            )
        over = item.material.over
        texture = None
        if isinstance(over.albedo, Texture):
            texture = object_texture(over.albedo, root, f"{where}: material.over.albedo.path")
        self.second[index] = self.add(over, replace(mesh, texture=texture))
        self.masks[index] = self.image(object_texture(item.material.mask, root, f"{where}: material.mask.path"))

    def image(self, image: Float32) -> tuple[int, int, int]:
        """Append (h, w, 3); returns its start, height and width."""
        shape = (self.texels, image.shape[0], image.shape[1])
        self.images.append(image.astype(np.float32).ravel())
        self.texels += image.shape[0] * image.shape[1]
        return shape


def _constant_albedo(material: BaseMaterial, mesh: Mesh) -> tuple[float, float, float]:
    albedo = material.albedo
    if isinstance(albedo, FromMesh):
        return mesh.colour if mesh.colour is not None else (0.5, 0.5, 0.5)
    if isinstance(albedo, Texture):
        return (1.0, 1.0, 1.0)
    return albedo if isinstance(albedo, tuple) else (albedo, albedo, albedo)
