"""The files a project names, so that a project saved elsewhere takes them along. Qt-free."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path

from render.errors import InputError
from render.files import atomic_write, inside, sha256
from render.material import Texture
from render.scene import Scene
from render.shape import MeshFile


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

    A file that is missing in `root` is passed over. InputError: another file is in the way, or `folder` is not writable.
    """
    if root.resolve() == folder.resolve():
        return []
    pairs = []
    for relative, where in named_files(scene).items():
        for each in (relative, *_companions(inside(root, relative, where), relative)):
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


def _companions(file: Path, relative: str) -> list[str]:
    """Files that a mesh file names, relative to the same root: MTL and textures of OBJ, buffers and images of GLTF."""
    folder = Path(relative).parent
    try:
        if file.suffix.lower() == ".obj":
            materials = _values(file, r"^mtllib\s+(.+)$")
            textures = [
                path for name in materials for path in _values(file.parent / name, r"^\s*(?:map_\w+|norm)\s.*?(\S+)$")
            ]
            names = materials + textures
        elif file.suffix.lower() == ".gltf":
            data = json.loads(file.read_text(encoding="utf-8"))
            parts = [*data.get("buffers", []), *data.get("images", [])]
            names = [part["uri"] for part in parts if not str(part.get("uri", "data:")).startswith("data:")]
        else:
            return []
    except (OSError, ValueError, TypeError, AttributeError):
        return []
    return [str(folder / name) for name in names]


def _values(file: Path, pattern: str) -> list[str]:
    if not file.is_file():
        return []
    return [found.strip() for found in re.findall(pattern, file.read_text(encoding="utf-8", errors="replace"), re.M)]
