"""A mesh file from anywhere becomes part of the project: copied beside it with its side files, its unit judged."""

from __future__ import annotations

import shutil
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from render.base.errors import InputError
from render.base.files import atomic_write, check_regular, sha256
from render.mesh.load import LARGE_EXTENT, load_mesh
from render.mesh.mesh_headers import MAX_FILE_BYTES
from render.mesh.trimesh_reader import EXTENSIONS, SideFiles, read_parts, side_files
from render.scene.scene import SceneObject
from render.scene.shape import UNITS, MeshFile, Unit
from studio.project.step_file import is_step, read_step, write_parts

FOLDER = "meshes"
TOO_LARGE = 5.0
"""Times the camera's view; a mesh larger than that in metres is taken for millimetres."""


@dataclass(frozen=True)
class ImportedMesh:
    """path: relative to the project, with slashes; bounds: lowest and highest corner, m, in that unit."""

    path: str
    unit: Unit
    bounds: tuple[tuple[float, ...], tuple[float, ...]]
    triangles: int
    name: str = ""
    """Of a part of an assembly."""
    colour: tuple[float, float, float] | None = None
    """Linear reflectance, where a STEP file tells it."""
    closed: bool | None = None
    """Of a part of a STEP file: without a gap between its faces."""

    @property
    def size(self) -> tuple[float, ...]:
        return tuple(high - low for low, high in zip(*self.bounds, strict=True))


def is_mesh(file: Path) -> bool:
    """By its suffix."""
    return file.suffix[1:].lower() in EXTENSIONS or is_step(file)


def needs_copy(file: Path, root: Path) -> bool:
    """The file is outside the project's folder, where a project may not read."""
    return not file.resolve().is_relative_to(root.resolve())


def import_mesh(file: Path, root: Path, view: float) -> ImportedMesh:
    """Copy a mesh (where needed), read and judge it. Takes as long as reading does.

    root: the project's folder; a file from outside is copied into `meshes/` in it, with its material, buffer and image
    files; view: width of what the camera sees, m, to tell metres from millimetres. What was copied is removed again if
    the mesh is no good. InputError: no mesh, damaged, or the folder cannot be written.
    """
    if file.suffix[1:].lower() not in EXTENSIONS:
        allowed = ", ".join(f".{name}" for name in EXTENSIONS)
        raise InputError("this is not a mesh file", where=str(file), found=file.suffix or file.name, allowed=allowed)
    check_regular(file, MAX_FILE_BYTES, "mesh file")
    made: list[Path] = []
    try:
        inside = _copied(file, root / FOLDER, made) if needs_copy(file, root) else file.resolve()
        return _judged(inside, root, view)
    except BaseException:
        for copy in made:
            copy.unlink(missing_ok=True)
        raise


def folder_of_parts(file: Path, root: Path) -> Path:
    """A new one below `meshes/` of a project for the parts of a STEP file, called as the file is."""
    folder, number = root.resolve() / FOLDER / file.stem, 1
    while folder.exists():
        number += 1
        folder = root.resolve() / FOLDER / f"{file.stem} {number}"
    return folder


def import_step(file: Path, root: Path, chord: float) -> list[ImportedMesh]:
    """The parts of a STEP file as meshes in `meshes/` of the project, each with the bounds of the whole assembly.

    A single part is called as the file is: programs write names of their own for it.
    root: the project's folder; chord: how far facets may be off the true surface, m. InputError: as `read_step`, or
    the folder cannot be written; nothing is left behind then.
    """
    parts = read_step(file, chord)
    if len(parts) == 1:
        parts = [replace(parts[0], name=file.stem)]
    folder = folder_of_parts(file, root)
    places = np.concatenate([part.vertices for part in parts])
    bounds = tuple(places.min(axis=0).tolist()), tuple(places.max(axis=0).tolist())
    made: list[Path] = []
    try:
        meshes = []
        for part, copy in zip(parts, write_parts(parts, folder, made), strict=True):
            path = copy.relative_to(root.resolve()).as_posix()
            # the full checks, as rendering will make them
            load_mesh(SceneObject(name=copy.stem[:100], shape=MeshFile(path=path, unit="mm")), root)
            name = part.name.strip()[:100] or copy.stem
            meshes.append(ImportedMesh(path, "mm", bounds, len(part.triangles), name, part.colour, part.closed))
        return meshes
    except BaseException:
        for copy in made:
            copy.unlink(missing_ok=True)
        if folder.is_dir() and not any(folder.iterdir()):
            folder.rmdir()
        raise


def copied_beside(file: Path, root: Path, folder: str) -> str:
    """A file's path relative to the project; one from outside is copied into `folder` of it. InputError: cannot be."""
    if not needs_copy(file, root):
        return file.resolve().relative_to(root.resolve()).as_posix()
    return _copied(file, root / folder, []).relative_to(root.resolve()).as_posix()


def _copied(file: Path, folder: Path, made: list[Path]) -> Path:
    """The file in a folder of the project; the same bytes there are used again, another file of that name is kept."""
    check_regular(file, MAX_FILE_BYTES)
    sides = side_files(file, file.parent) if file.suffix[1:].lower() in EXTENSIONS else []
    target, number = folder / file.name, 1
    while target.exists() and sha256(target) != sha256(file):
        number += 1
        target = folder / (f"{file.stem} {number}{file.suffix}" if not sides else f"{file.stem} {number}/{file.name}")
    for source, copy in [(file, target), *((file.parent / name, target.parent / name) for name in sides)]:
        if copy.exists():
            continue
        check_regular(source, MAX_FILE_BYTES, "file that the mesh names")
        with atomic_write(copy) as temporary:
            shutil.copyfile(source, temporary)
        made.append(copy)
    return target.resolve()


def _judged(file: Path, root: Path, view: float) -> ImportedMesh:
    relative = file.relative_to(root.resolve()).as_posix()
    where = f"mesh {relative}"
    parts = read_parts(file, where, SideFiles(file, root, where), colours=False)
    low = np.min([part.vertices.min(axis=0) for part in parts], axis=0)
    high = np.max([part.vertices.max(axis=0) for part in parts], axis=0)
    extent = float((high - low).max())
    unit: Unit = "mm" if extent > min(LARGE_EXTENT, TOO_LARGE * view) else "m"
    # the full checks, as rendering will make them
    mesh = load_mesh(SceneObject(name=file.stem[:100] or "mesh", shape=MeshFile(path=relative, unit=unit)), root)
    low, high = low * UNITS[unit], high * UNITS[unit]
    return ImportedMesh(relative, unit, (tuple(low.tolist()), tuple(high.tolist())), len(mesh.triangles))
