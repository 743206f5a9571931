"""The mesh of a scene object: read from its file or made from its primitive, checked, in metres, with its texture."""

from __future__ import annotations

import dataclasses
import warnings
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from render.base.errors import InputError
from render.base.files import check_regular, inside, sha256
from render.material.material import Blend, BumpMap, FromMesh, Glass, GreyTexture, NormalMap, Subsurface, Texture
from render.mesh.file_colours import merged_look, part_look
from render.mesh.mesh import Mesh
from render.mesh.mesh_headers import MAX_FILE_BYTES, MAX_TRIANGLES, check_together
from render.mesh.primitives import primitive_mesh, triangle_count
from render.mesh.texture import MAX_PIXELS, load_texture
from render.mesh.trimesh_reader import EXTENSIONS, SideFiles, read_parts
from render.mesh.vertex_normals import corner_normals
from render.mesh.watertight import closed_outward
from render.mesh.wear import worn
from render.mesh.weld_tee import weld_tee_mesh
from render.scene.scene import SceneObject
from render.scene.shape import UNITS, MeshFile, Parametric, Sphere, WeldTee
from render.scene.wear import Wear

MAX_EXTENT = 1e4
"""Largest distance of a vertex from its origin, m: beyond it float32 rays lose the micrometres."""
LARGE_EXTENT = 20.0
"""Extent, m, above which a part given in metres is assumed to be in millimetres."""


def load_mesh(item: SceneObject, root: Path) -> Mesh:
    """The triangles of an object, m, in its own frame; loaded meshes are kept, so that a scan reads each file once.

    root: the project folder, which every path is relative to and must stay inside.
    Zero-area triangles are dropped with a warning. A file that changed since the project was saved gives a warning.
    InputError: the file is absent, damaged, empty, of an unknown kind, too large, plainly not in metres though the unit
    says so, or has NaN, wrong indices or no area; it is open and the material needs a closed one; the albedo is a
    texture and the mesh has no UV, or the image is bad.
    """
    where = f"object {item.name!r}"
    filled = isinstance(item.material, Glass | Subsurface)
    if isinstance(item.shape, MeshFile):
        mesh = _from_file(item, item.shape, Path(root), where, filled)
    else:
        mesh = _made(item.shape, item.scale, item.wear, item.crease_angle, where, filled)
        _check_size(mesh.vertices, where)
    material = item.material.base if isinstance(item.material, Blend) else item.material
    albedo = material.albedo
    if not isinstance(albedo, Texture):
        return mesh
    if mesh.uv is None:
        raise InputError(
            "the albedo is a texture, but the mesh has no usable UV",
            where=where,
            found=item.shape.path if isinstance(item.shape, MeshFile) else item.shape.kind,
            cure="give the albedo as a number, or unwrap the mesh and export it with UV",
        )
    part = ".base" if isinstance(item.material, Blend) else ""
    field = f"{where}: material{part}.albedo.path"
    return dataclasses.replace(mesh, texture=object_texture(albedo, Path(root), field))


def load_meshes(items: Sequence[SceneObject], root: Path) -> list[Mesh]:
    """The meshes of a scene's visible objects, as `load_mesh`; what they hold together is bounded as they come.

    InputError: as `load_mesh`; more than MAX_TRIANGLES or, in their textures, MAX_PIXELS in all objects together.
    """
    meshes: list[Mesh] = []
    triangles, textures = 0, dict[int, int]()
    for item in items:
        where = f"object {item.name!r}"
        if isinstance(item.shape, WeldTee):
            check_together("triangles", triangles + item.shape.triangles, MAX_TRIANGLES, where)
        elif not isinstance(item.shape, MeshFile):
            check_together("triangles", triangles + triangle_count(item.shape), MAX_TRIANGLES, where)
        mesh = load_mesh(item, root)
        triangles += len(mesh.triangles)
        check_together("triangles", triangles, MAX_TRIANGLES, where)
        if mesh.texture is not None:
            textures[id(mesh.texture)] = mesh.texture.size // 3
            check_together("pixels of textures", sum(textures.values()), MAX_PIXELS, where)
        meshes.append(mesh)
    return meshes


def object_texture(texture: Texture | GreyTexture | NormalMap | BumpMap, root: Path, field: str) -> NDArray[np.float32]:
    """(h, w, 3) linear image of a texture below root; kept until the file changes. InputError: absent or bad."""
    path = inside(root, texture.path, field)
    state = path.stat() if path.exists() else None
    version = None if state is None else (state.st_mtime_ns, state.st_size)
    srgb = isinstance(texture, Texture) and texture.srgb
    scale = texture.scale if isinstance(texture, Texture | GreyTexture) else 1.0
    try:
        return _texture(path, srgb, scale, version)
    except InputError as error:  # kept by what it is read from, so that all objects share it, and not by the field
        where = f"{field}: {path.name}"
        raise InputError(error.what, where=where, found=error.found, allowed=error.allowed, cure=error.cure) from None


def unit_warning(mesh: Mesh, item: SceneObject) -> str | None:
    """What is suspicious about the size of a loaded mesh file, in words with the cure, or None."""
    if not isinstance(item.shape, MeshFile):
        return None
    extent = float(np.ptp(mesh.vertices, axis=0).max())
    unit = item.shape.unit
    if unit == "m" and extent > LARGE_EXTENT:
        return f'it is {extent:.4g} m across, which looks like millimetres; set unit to "mm"'
    if unit != "m" and extent < 2e-4:
        return f'it is {extent * 1e6:.3g} um across with unit "{unit}", which looks like metres; set unit to "m"'
    return None


@lru_cache(maxsize=8)
def _made(shape: Parametric, scale: float, wear: Wear | None, crease_angle: float, where: str, filled: bool) -> Mesh:
    """filled: its material needs a closed surface."""
    mesh = weld_tee_mesh(shape) if isinstance(shape, WeldTee) else primitive_mesh(shape)
    mesh = closed_outward(mesh, f"{where}: shape") if filled else mesh
    unit = mesh.vertices
    if scale != 1.0:
        mesh = dataclasses.replace(mesh, vertices=unit * scale)
    if isinstance(shape, Sphere) and crease_angle > 0.0 and wear is None:
        # the exact normals of the sphere, from which the mean over facets differs
        return dataclasses.replace(mesh, normals=(unit / shape.radius)[mesh.triangles].astype(np.float32))
    return _shaded(mesh if wear is None else worn(mesh, wear, where), crease_angle)


def _shaded(mesh: Mesh, crease_angle: float) -> Mesh:
    if crease_angle == 0.0:
        return mesh
    return dataclasses.replace(mesh, normals=corner_normals(mesh.vertices, mesh.triangles, crease_angle))


@lru_cache(maxsize=8)
def _texture(path: Path, srgb: bool, scale: float, version: object) -> NDArray[np.float32]:
    """`version` changes with the file, so that an edited texture is read anew."""
    return load_texture(path, srgb=srgb, scale=scale, where=str(path))


def _from_file(item: SceneObject, shape: MeshFile, root: Path, where: str, filled: bool) -> Mesh:
    path = inside(root, shape.path, f"{where}: shape.path")
    where = f"{where}: {shape.path}"
    if path.suffix[1:].lower() not in EXTENSIONS:
        allowed = ", ".join(f".{name}" for name in EXTENSIONS)
        found = path.suffix or path.name
        raise InputError("the mesh file's kind is not known", where=where, found=found, allowed=allowed)
    if not path.exists():
        cure = "put the mesh into the project folder, or correct shape.path"
        raise InputError("there is no such mesh file", where=where, cure=cure)
    check_regular(path, MAX_FILE_BYTES, "mesh file", where)
    state = path.stat()
    material = item.material.base if isinstance(item.material, Blend) else item.material
    colours = isinstance(material.albedo, FromMesh)
    factor = UNITS[shape.unit] * item.scale
    version = state.st_mtime_ns, state.st_size
    mesh = _read(path, Path(root), where, factor, colours, shape.sha256, item.wear, item.crease_angle, filled, version)
    warning = unit_warning(mesh, item)
    if warning and shape.unit == "m" and item.scale == 1.0:
        cure = 'if it really is in metres, say so with unit "cm" and scale 100'
        raise InputError("the mesh is suspiciously large", where=where, found=warning, cure=cure)
    return mesh


@lru_cache(maxsize=16)
def _read(  # noqa: PLR0913
    path: Path,
    root: Path,
    where: str,
    factor: float,
    colours: bool,
    expected_sha256: str | None,
    wear: Wear | None,
    crease_angle: float,
    filled: bool,
    version: object,
) -> Mesh:
    """A checked mesh, its vertices multiplied by factor; `version` changes with the file."""
    if expected_sha256 is not None and sha256(path) != expected_sha256:
        warnings.warn(f"{where}: the file has changed since the project was saved", stacklevel=2)
    files = SideFiles(path, root, where)
    parts = read_parts(path, where, files, colours=colours)
    if colours and files.refused:
        raise files.refused[0]
    counts = [len(part.triangles) for part in parts]
    vertices = np.concatenate([part.vertices for part in parts]) * factor
    offsets = np.cumsum([0, *(len(part.vertices) for part in parts[:-1])])
    triangles = np.concatenate([part.triangles + offset for part, offset in zip(parts, offsets, strict=True)])
    _check_size(vertices, where)

    linear = path.suffix.lower() in (".glb", ".gltf")
    looks = [
        part_look(part.geometry, part.triangles, colours=colours, linear_colours=linear, where=where) for part in parts
    ]
    look = merged_look(looks, counts, where)
    keep = _with_area(vertices, triangles, where)
    uv = None if look.uv is None else look.uv[keep]
    kept = np.ascontiguousarray(triangles[keep], dtype=np.int32)
    normals = None
    if crease_angle > 0.0:
        normals = corner_normals(vertices, kept, crease_angle)
        starts = np.cumsum([0, *counts])
        for part, start, stop in zip(parts, starts[:-1], starts[1:], strict=True):
            if part.normals is not None:
                mine = np.cumsum(keep)[start:stop][keep[start:stop]] - 1
                normals[mine] = part.normals[part.triangles[keep[start:stop]]]
    mesh = Mesh(
        vertices,
        kept,
        None if uv is None else np.ascontiguousarray(uv, dtype=np.float32),
        look.texture,
        look.colour,
        normals,
        smooth_normals=any(part.normals is not None for part in parts),
    )
    mesh = closed_outward(mesh, where) if filled else mesh
    return mesh if wear is None else _shaded(worn(mesh, wear, where), crease_angle)


def _check_size(vertices: NDArray[np.float64], where: str) -> None:
    """InputError: a vertex is not finite, or too far from the mesh's origin."""
    bad = int((~np.isfinite(vertices).all(axis=1)).sum())
    if bad:
        raise InputError(
            "the mesh has vertices that are not finite",
            where=where,
            found=f"NaN or infinity in {bad} of {len(vertices)} vertices",
            cure="remove the invalid points and export it again",
        )
    reach = float(np.abs(vertices).max())
    if reach > MAX_EXTENT:
        raise InputError(
            "the mesh is too large, or too far from its origin",
            where=where,
            found=f"a coordinate of {reach:.4g} m after unit and scale",
            allowed=f"at most {MAX_EXTENT:g} m",
            cure="correct unit and scale, or move the mesh to its origin before exporting it",
        )


def _with_area(vertices: NDArray[np.float64], triangles: NDArray[np.int64], where: str) -> NDArray[np.bool_]:
    """(t,) True where a triangle has an area. InputError: at least half of them have none."""
    keep = np.empty(len(triangles), dtype=np.bool_)
    for start in range(0, len(triangles), 2**20):  # in pieces, to bound the memory
        a, b, c = (vertices[triangles[start : start + 2**20, k]] for k in range(3))
        keep[start : start + 2**20] = np.cross(b - a, c - a).any(axis=1)
    flat = len(keep) - int(keep.sum())
    if 2 * flat >= len(keep):
        raise InputError(
            "the mesh is degenerate",
            where=where,
            found=f"{flat} of {len(keep)} triangles without area",
            allowed="less than half",
            cure="export it again with more digits, or repair it",
        )
    if flat:
        warnings.warn(f"{where}: {flat} of {len(keep)} triangles have no area and were left out", stacklevel=2)
    return keep
