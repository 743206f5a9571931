"""The files a project names, so that a project saved elsewhere takes them along. Qt-free."""

from __future__ import annotations

import contextlib
import shutil
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from render.base.errors import InputError
from render.base.files import atomic_write, inside, sha256
from render.material.material import BumpMap, GreyTexture, NormalMap, Texture
from render.mesh.trimesh_reader import side_files
from render.scene.scene import Scene
from render.scene.shape import MeshFile
from studio.project.project import Project
from studio.project.strict_json import read_object


def named_files(item: BaseModel, where: str) -> dict[str, str]:
    """Relative path -> the field that names it, of every mesh and texture in a model, however deep."""
    if isinstance(item, MeshFile | Texture | GreyTexture | NormalMap | BumpMap):
        return {item.path: f"{where}.path"}
    found: dict[str, str] = {}
    for name in type(item).model_fields:
        value = getattr(item, name)
        for i, each in enumerate(value if isinstance(value, tuple) else (value,)):
            if isinstance(each, BaseModel):
                place = f"{where}.{name}[{i}]" if isinstance(value, tuple) else f"{where}.{name}"
                found = named_files(each, place) | found
    return found


def check_no_project(file: Path, what: str) -> None:
    """InputError: a project is in the file that something else is to be written into: it would be lost.

    what: is to be written. Of a file that cannot be read whoever chose it has said that it may be replaced.
    """
    data: dict[str, Any] = {}
    with contextlib.suppress(InputError):
        data = read_object(file)
    if "scene" in data:
        raise InputError(f"the {what} would replace a project", where=str(file), cure="give it another name")


def in_project(path: str, root: Path) -> str:
    """A path as a project names it: one that is absolute, of a place inside the project's folder, begins there."""
    place = Path(path.strip())
    if not place.is_absolute() or "\0" in path:
        return path
    resolved, folder = place.resolve(), root.resolve()
    return resolved.relative_to(folder).as_posix() if folder in resolved.parents else path


def missing_files(scene: Scene, root: Path) -> list[tuple[int, Path]]:
    """Visible objects whose mesh or texture is not there: index and file. InputError: a path that leaves the folder."""
    found = []
    for i, item in enumerate(scene.objects):
        for path, where in named_files(item, f"scene.objects[{i}]").items():
            file = inside(root, path, where)
            if item.visible and not file.is_file():
                found.append((i, file))
    return found


def bring(found: Path, target: Path) -> None:
    """Copy a file to the place where a project has it, and beside it what reading it takes, as far as that is there.

    What is there already stays. InputError: it cannot be written.
    """
    beside = side_files(found, found.parent)
    for source, place in ((found, target), *((found.parent / name, target.parent / name) for name in beside)):
        if source.is_file() and not place.exists():
            with atomic_write(place) as temporary:
                shutil.copyfile(source, temporary)


def carry(project: Project, root: Path, folder: Path) -> list[Path]:
    """Copy the files the project names from `root` to the same places below `folder`; returns what was written.

    A chooser's weights take their card along. A file that is missing in `root` is passed over.
    InputError: another file is in the way, or `folder` is not writable.
    """
    if root.resolve() == folder.resolve():
        return []
    pairs = []
    named = named_files(project.scene, "scene")
    if project.delivery.logo:
        # one outside of the folder is not shown, which is told where it is named: it keeps nobody from saving
        with contextlib.suppress(InputError):
            inside(root, project.delivery.logo, "delivery.logo")
            named[project.delivery.logo] = "delivery.logo"
    weights = project.extraction.chooser
    if weights is not None:
        named |= dict.fromkeys((weights, str(Path(weights).with_suffix(".json"))), "extraction.chooser")
    for relative, where in named.items():
        beside = Path(relative).parent
        for each in (relative, *(str(beside / name) for name in side_files(inside(root, relative, where), root))):
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
