"""The scene's triangles and materials in world coordinates at one step, on which every later stage computes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from render.base.arrays import Float, Float32, Int
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


@dataclass(frozen=True)
class World:
    """All triangles of the visible objects; object_id indexes `scene.visible_objects`."""

    vertices: Float
    """(v, 3) vertices, world, m."""
    triangles: Int
    """(t, 3) vertex indices."""
    object_id: Int
    """(t,) object of each triangle, which is also the index of its material."""
    uv: Float32
    """(t, 3, 2) UV of each triangle's corners; (0, 3, 2) if no object has a texture."""
    albedo: Float
    """(s, 3) RGB reflectance of each material: of every object in its order, then the second materials of blends."""
    textures: Float32
    """(n,) all images, concatenated, linear RGB."""
    texture_shape: Int
    """(s, 3) start, height, width of the albedo's image in `textures`; height 0 for none."""
    second: Int
    """(s,) index of the material that a blend's mask selects where it is white; -1: no blend."""
    mask_shape: Int
    """(s, 3) start, height, width of the blend's mask in `textures`; height 0 for none."""
    materials: tuple[BaseMaterial, ...]
    """(s,) descriptions of the materials, with each blend as two."""
    places: tuple[str, ...]
    """(s,) object and field of each material, for messages."""
    normals: Float32
    """(t, 3, 3) unit shading normals of the corners, 0 for flat shading; (0, 3, 3) if all triangles are flat."""
    detail: Int
    """(s,) flags of `render.world.surface_interaction`: shading normals and maps that the material has."""
    maps: Int
    """(s, 6) start, height, width of the roughness map and of the relief in `textures`."""
    relief: Float
    """(s, 2) factors of the relief: on its slopes along u and v, or its height in m."""
    least_alpha: Float
    """(s,) smallest value of a roughness map; 1 without one."""

    @cached_property
    def rays(self) -> RayScene:
        """The acceleration structure for ray queries, built at first use."""
        return RayScene(self.vertices, self.triangles)

    def moved(self, motion: Float) -> World:
        """The world after a rigid motion (4, 4) of all its objects: nothing is read again, and after a mere shift no
        acceleration structure built."""
        kept: dict[str, Any] = {"nesting": self.nesting}
        vertices, normals = transform_points(motion, self.vertices), self.normals
        if np.array_equal(motion[:3, :3], np.eye(3)):
            kept["rays"] = self.rays.shifted(motion[:3, 3])
        else:
            normals = normals @ motion[:3, :3].T.astype(np.float32)
        other = replace(self, vertices=vertices, normals=normals)
        vars(other).update(kept)
        return other

    @cached_property
    def boxes(self) -> tuple[Float, Float]:
        """Least and largest coordinates (o, 3) of each object up to the last that has triangles, found at first use;
        infinite, the least above the largest, where it has none."""
        count = int(self.object_id.max(initial=-1)) + 1
        low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
        for item in range(count):
            used = self.triangles[self.object_id == item]
            if len(used):
                # an object's vertices are contiguous
                points = self.vertices[used.min() : used.max() + 1]
                low[item], high[item] = points.min(axis=0), points.max(axis=0)
        return low, high

    @cached_property
    def nesting(self) -> Nesting:
        """Which transparent bodies overlap, found at first use."""
        return nesting_of(self)

    @property
    def surface(self) -> Surface:
        """The arrays as the kernels read them, with materials at the wavelengths of ambient light."""
        return self.surface_at(BAND_CENTRES_NM)

    def surface_at(self, bands_nm: tuple[float, float, float]) -> Surface:
        """The arrays as the kernels read them, with materials at three wavelengths, nm.

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
    """Meshes of `scene.visible_objects`, in that order -> one world. root: the folder of the materials' images."""
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
