"""The folder of a scan: frames, points, report, the project as it was run, and a manifest that is written last.

A folder without its manifest `scan.json` is an unfinished scan, so that half a result is never taken for a whole one.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from render.errors import InputError
from render.files import atomic_write, inside
from studio.project import Project
from studio.strict_json import pretty, read_object

MANIFEST, PROJECT = "scan.json", "scan_project.json"
FORMAT, FORMAT_VERSION = "blazer-scan", 1


@dataclass(frozen=True)
class ScanFolder:
    """A finished scan as found on disk."""

    folder: Path
    project: Project
    root: Path
    """Where the project's meshes and textures are."""
    frames: tuple[Path, ...]
    """The frames' sidecars, in the order of their steps."""
    manifest: dict[str, Any]


def begin(folder: Path, project: Project) -> None:
    """Make the folder, drop an old manifest, and write the project as it is run. InputError: not writable."""
    with atomic_write(folder / PROJECT) as temporary:
        temporary.write_text(project.to_text(), encoding="utf-8")
    (folder / MANIFEST).unlink(missing_ok=True)


def frame_stem(step: int) -> str:
    """Name of a frame's files, without suffix."""
    return f"frame_{step:04d}"


def finish(folder: Path, root: Path, result: dict[str, Any]) -> dict[str, Any]:
    """Write the manifest: the result, and where the project came from."""
    try:
        source = os.path.relpath(root, folder)
    except ValueError:  # another drive
        source = str(root.resolve())
    manifest = {"format": FORMAT, "format_version": FORMAT_VERSION, "project_folder": source, **result}
    with atomic_write(folder / MANIFEST) as temporary:
        temporary.write_text(pretty(manifest) + "\n", encoding="utf-8")
    return manifest


def open_folder(folder: Path) -> ScanFolder:
    """Read a finished scan. InputError: no manifest, of another kind or version, or files missing."""
    where = str(folder / MANIFEST)
    if not (folder / MANIFEST).is_file():
        cure = (
            "render or run the project first" if not folder.exists() else "the scan there did not finish: run it again"
        )
        raise InputError("there is no finished scan in this folder", where=str(folder), allowed=MANIFEST, cure=cure)
    manifest = read_object(folder / MANIFEST, "scan manifest")
    version = manifest.get("format_version")
    if manifest.get("format") != FORMAT or version != FORMAT_VERSION:
        found = f"{manifest.get('format')} {version}"
        raise InputError("unknown kind of manifest", where=where, found=found, allowed=f"{FORMAT} {FORMAT_VERSION}")
    names, source = manifest.get("frames"), manifest.get("project_folder")
    if not isinstance(names, list) or not isinstance(source, str) or not all(isinstance(name, str) for name in names):
        raise InputError("frames or project_folder is missing or of the wrong type", where=where)
    return ScanFolder(
        folder=folder,
        project=Project.load(folder / PROJECT),
        root=(folder / source).resolve(),
        frames=tuple(inside(folder, name, f"{where}: frames") for name in names),
        manifest=manifest,
    )
