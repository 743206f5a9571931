"""The files a project names, so that a project saved elsewhere takes them along. Qt-free."""

from __future__ import annotations

import shutil
from pathlib import Path

from render.errors import InputError
from render.files import atomic_write, inside, sha256
from render.material import Texture
from render.scene import Scene
from render.shape import MeshFile
from studio.mesh_import import side_files


def named_files(scene: Scene) -> dict[str, str]:
    """Relative path -> the field that names it: meshes and textures."""
    found: dict[str, str] = {}
    for i, item in enumerate(scene.objects):
        if isinstance(item.shape, MeshFile):
            found.setdefault(item.shape.path, f"scene.objects[{i}].shape.path")
        albedo = item.material.albedo
        if isinstance(albedo, Texture):
            found.setdefault(albedo.path, f"scene.objects[{i}].material.albedo.path")
    return found


def missing_files(scene: Scene, root: Path) -> list[tuple[int, Path]]:
    """Objects whose mesh or texture is not there: index and file. InputError: a path that leaves the folder."""
    found = []
    for i, item in enumerate(scene.objects):
        albedo = item.material.albedo
        paths = [item.shape.path] if isinstance(item.shape, MeshFile) else []
        paths += [albedo.path] if isinstance(albedo, Texture) else []
        for path in paths:
            file = inside(root, path, f"scene.objects[{i}]")
            if item.visible and not file.is_file():
                found.append((i, file))
    return found


def carry(scene: Scene, root: Path, folder: Path) -> list[Path]:
    """Copy the files the scene names from `root` to the same places below `folder`; returns what was written.

    A file that is missing in `root` is passed over.
    InputError: another file is in the way, or `folder` is not writable.
    """
    if root.resolve() == folder.resolve():
        return []
    pairs = []
    for relative, where in named_files(scene).items():
        beside = Path(relative).parent
        for each in (relative, *(str(beside / name) for name in side_files(inside(root, relative, where)))):
            source, target = inside(root, each, where), inside(folder, each, where)
            if not source.is_file():
                continue
            if not target.exists():
                pairs.append((source, target))
            elif sha256(source) != sha256(target):
                raise InputError(
                    "another file of that name is in the way", where=str(target), cure="save into another folder"
                )
    for source, target in pairs:
        with atomic_write(target) as temporary:
            shutil.copyfile(source, temporary)
    return [target for _, target in pairs]
