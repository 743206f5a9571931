"""The scene's triangles in world coordinates at one step: what every later stage computes on."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from render.embree import RayScene
from render.material import FromMesh, Texture
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
    """(o, 3) RGB reflectance of each object (a textured one: 1)."""
    textures: Float32
    """(n,) all textures, one after the other, RGB linear."""
    texture_shape: Int
    """(o, 3) start, height, width in `textures`; height 0 for none."""

    @cached_property
    def rays(self) -> RayScene:
        """The scene for ray queries, built at first use."""
        return RayScene(self.vertices, self.triangles)

    @property
    def surface(self) -> Surface:
        """The arrays, as the kernels take them."""
        return Surface(
            self.vertices, self.triangles, self.object_id, self.uv, self.albedo, self.textures, self.texture_shape
        )

    @cached_property
    def corners(self) -> Float:
        """(t, 3, 3) triangle corners, contiguous for the kernels."""
        return np.ascontiguousarray(self.vertices[self.triangles])


def build_world(scene: Scene, root: Path, step: int = 0) -> World:
    """Load the visible objects' meshes and place them for a step. Raises InputError for a bad mesh or texture."""
    from render.mesh_files import load_mesh

    return place_meshes(scene, [load_mesh(item, root) for item in scene.visible_objects], step)


def place_meshes(scene: Scene, meshes: list[Mesh], step: int = 0) -> World:
    """Meshes of `scene.visible_objects`, in that order -> one world."""
    vertices, triangles, object_ids, uvs, textures = [], [], [], [], []
    albedo = np.ones((len(meshes), 3))
    texture_shape = np.zeros((len(meshes), 3), dtype=np.int32)
    offset = texel = 0
    any_texture = any(mesh.texture is not None and _uses_texture(item) for item, mesh in _pairs(scene, meshes))
    for i, (item, mesh) in enumerate(_pairs(scene, meshes)):
        vertices.append(transform_points(scene.T_world_object(item, step), mesh.vertices))
        triangles.append(mesh.triangles + np.int32(offset))
        object_ids.append(np.full(len(mesh.triangles), i, dtype=np.int32))
        offset += len(mesh.vertices)
        if any_texture:
            uvs.append(mesh.uv if mesh.uv is not None else np.zeros((len(mesh.triangles), 3, 2), dtype=np.float32))
        if mesh.texture is not None and _uses_texture(item):
            texture_shape[i] = texel, mesh.texture.shape[0], mesh.texture.shape[1]
            textures.append(mesh.texture.astype(np.float32).ravel())
            texel += mesh.texture.shape[0] * mesh.texture.shape[1]
        else:
            albedo[i] = _constant_albedo(item, mesh)
    return World(
        vertices=np.concatenate(vertices) if vertices else np.zeros((0, 3)),
        triangles=np.concatenate(triangles) if triangles else np.zeros((0, 3), dtype=np.int32),
        object_id=np.concatenate(object_ids) if object_ids else np.zeros(0, dtype=np.int32),
        uv=np.ascontiguousarray(np.concatenate(uvs), dtype=np.float32) if uvs else np.zeros((0, 3, 2), np.float32),
        albedo=albedo,
        textures=np.concatenate(textures) if textures else np.zeros(0, dtype=np.float32),
        texture_shape=texture_shape,
    )


def _pairs(scene: Scene, meshes: list[Mesh]) -> list[tuple[SceneObject, Mesh]]:
    return list(zip(scene.visible_objects, meshes, strict=True))


def _uses_texture(item: SceneObject) -> bool:
    return isinstance(item.material.albedo, Texture | FromMesh)


def _constant_albedo(item: SceneObject, mesh: Mesh) -> tuple[float, float, float]:
    albedo = item.material.albedo
    if isinstance(albedo, FromMesh):
        return mesh.colour if mesh.colour is not None else (0.5, 0.5, 0.5)
    if isinstance(albedo, Texture):
        return (1.0, 1.0, 1.0)
    return albedo if isinstance(albedo, tuple) else (albedo, albedo, albedo)
