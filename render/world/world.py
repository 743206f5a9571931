"""The scene's triangles in world coordinates at one step: what every later stage computes on."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from render.base.pose import transform_points
from render.material.material import BaseMaterial, Blend
from render.material.spectrum import BAND_CENTRES_NM
from render.mesh.mesh import Mesh
from render.scene.scene import Scene
from render.world.embree import RayScene
from render.world.interior_list import COLUMNS, RANK, RANKED
from render.world.material_atlas import MaterialAtlas
from render.world.overlaps import Nesting, nesting_of
from render.world.triangles import Surface

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
    places: tuple[str, ...]
    """(s,) whose each is, for messages."""
    normals: Float32
    """(t, 3, 3) unit normals of the corners for shading, 0 where facets are shaded; (0, 3, 3) when all are."""
    detail: Int
    """(s,) what there is beside constants: the flags of `render.world.surface_interaction`."""
    maps: Int
    """(s, 6) start, height, width of the roughness and of the relief in `textures`."""
    relief: Float
    """(s, 2) factors of the relief: its slopes along u and v, or its height in m."""
    least_alpha: Float
    """(s,) least value of a roughness that is an image."""

    @cached_property
    def rays(self) -> RayScene:
        """The scene for ray queries, built at first use."""
        return RayScene(self.vertices, self.triangles)

    @cached_property
    def nesting(self) -> Nesting:
        """Which transparent bodies overlap, found at first use."""
        return nesting_of(self)

    @property
    def surface(self) -> Surface:
        """The arrays, as the kernels take them, for ambient light."""
        return self.surface_at(BAND_CENTRES_NM)

    def surface_at(self, bands_nm: tuple[float, float, float]) -> Surface:
        """The arrays, as the kernels take them, with what the materials do to three wavelengths.

        InputError: a material is not known at one of them.
        """
        rows = np.zeros((len(self.materials), COLUMNS))
        for i, (material, least) in enumerate(zip(self.materials, self.least_alpha, strict=True)):
            rows[i, :RANK] = material.pack(bands_nm, float(least), self.places[i])
        for rank, item in enumerate(self.nesting.ranked):
            rows[item, RANK], rows[rank, RANKED] = rank + 1, item
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
            self.normals,
            self.detail,
            self.maps,
            self.relief,
        )


def build_world(scene: Scene, root: Path, step: int = 0) -> World:
    """Load the visible objects' meshes and place them for a step.

    Raises InputError for a bad mesh or texture, or where they hold more together than a scene may.
    """
    from render.mesh.load import load_meshes

    return place_meshes(scene, load_meshes(scene.visible_objects, root), step, root)


def place_meshes(scene: Scene, meshes: list[Mesh], step: int = 0, root: Path | None = None) -> World:
    """Meshes of `scene.visible_objects`, in that order -> one world. root: where images are."""
    pairs = list(zip(scene.visible_objects, meshes, strict=True))
    atlas = MaterialAtlas(root)
    vertices, triangles, object_ids, uvs, normals = [], [], [], [], []
    smooth = any(mesh.normals is not None for _, mesh in pairs)
    offset = 0
    for i, (item, mesh) in enumerate(pairs):
        vertices.append(transform_points(scene.T_world_object(item, step), mesh.vertices))
        triangles.append(mesh.triangles + np.int32(offset))
        object_ids.append(np.full(len(mesh.triangles), i, dtype=np.int32))
        offset += len(mesh.vertices)
        uvs.append(mesh.uv if mesh.uv is not None else np.zeros((len(mesh.triangles), 3, 2), dtype=np.float32))
        if smooth:
            corner = mesh.normals if mesh.normals is not None else np.zeros((len(mesh.triangles), 3, 3), np.float32)
            normals.append(corner @ scene.T_world_object(item, step)[:3, :3].T.astype(np.float32))
        material = item.material.base if isinstance(item.material, Blend) else item.material
        part = ".base" if isinstance(item.material, Blend) else ""
        atlas.add(material, mesh, f"object {item.name!r}: material{part}")
    for i, (item, mesh) in enumerate(pairs):
        if isinstance(item.material, Blend):
            atlas.add_blend(i, item, mesh)
    keep_uv = bool(atlas.images) or any(mesh.uv is not None for _, mesh in pairs)
    return World(
        vertices=np.concatenate(vertices) if vertices else np.zeros((0, 3)),
        triangles=np.concatenate(triangles) if triangles else np.zeros((0, 3), dtype=np.int32),
        object_id=np.concatenate(object_ids) if object_ids else np.zeros(0, dtype=np.int32),
        uv=np.ascontiguousarray(np.concatenate(uvs), dtype=np.float32) if keep_uv else np.zeros((0, 3, 2), np.float32),
        albedo=np.array(atlas.albedo).reshape(-1, 3),
        textures=atlas.joined_images(),
        texture_shape=np.array(atlas.shapes, dtype=np.int32).reshape(-1, 3),
        second=np.array(atlas.second, dtype=np.int32),
        mask_shape=np.array(atlas.masks, dtype=np.int32).reshape(-1, 3),
        materials=tuple(atlas.materials),
        places=tuple(atlas.places),
        normals=np.concatenate(normals) if smooth else np.zeros((0, 3, 3), dtype=np.float32),
        detail=np.array(atlas.detail, dtype=np.int32),
        maps=np.array(atlas.maps, dtype=np.int32).reshape(-1, 6),
        relief=np.array(atlas.relief, dtype=np.float64).reshape(-1, 2),
        least_alpha=np.array(atlas.least_alpha, dtype=np.float64),
    )
