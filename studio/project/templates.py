"""New projects from the ones that come with the program; nothing that is there is overwritten unasked.

All files are written beside the folder first, so that a full disk leaves no part of a project behind.
"""

from __future__ import annotations

import os
import secrets
import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from render.base.errors import InputError

DESCRIPTIONS = {
    "weld_seam": "the founding paper's rig over a single-bevel tee joint",
    "shiny_weld_seam": "the same joint with its seam ground to bright steel: reflections between the plates",
    "plane": "a tilted plane: the simplest thing with a closed form",
    "sphere": "a sphere on a table: every slope at once",
    "step_block": "five steps of 10 mm: depth linearity",
    "glass_ball": "a glass ball in the beam, half of the line seen through a plate: caustics",
    "v_groove": "a 90 degree groove: inner corners",
    "scan": "the scanner swept over the step block by a linear stage, 20 frames",
}
PROJECT_NAME = "project.json"
FOLDER = Path(__file__).resolve().parents[2] / "assets" / "projects"


@dataclass(frozen=True)
class NewProject:
    """Files that were written."""

    project: Path
    files: tuple[Path, ...]


def template_folder(template: str) -> Path:
    """The folder of a template that comes with the program. InputError: no such template."""
    if template not in DESCRIPTIONS:
        import difflib

        near = difflib.get_close_matches(template, DESCRIPTIONS, n=1)
        raise InputError(
            "there is no such template",
            found=template,
            allowed=", ".join(DESCRIPTIONS),
            cure=f"did you mean {near[0]}?" if near else "",
        )
    return FOLDER / template


def new_project(template: str, folder: Path, *, force: bool = False) -> NewProject:
    """Copy a template into a folder, which is made. InputError: unknown template, or files there and not `force`."""
    source = template_folder(template)
    pairs = [(file, folder / file.relative_to(source)) for file in sorted(source.rglob("*")) if file.is_file()]
    there = [target for _, target in pairs if target.exists()]
    if there and not force:
        raise InputError(
            "a file is there already",
            where=str(there[0]),
            cure="choose another folder, or overwrite it with --force",
        )
    _copy(source, folder, [file.relative_to(source) for file, _ in pairs])
    return NewProject(project=folder / PROJECT_NAME, files=tuple(target for _, target in pairs))


def _copy(source: Path, folder: Path, names: Sequence[Path]) -> None:
    """The files into a folder, all or none. InputError: they cannot be written."""
    target = Path(os.path.realpath(folder))
    staged = target.with_name(f".{target.name}.{secrets.token_hex(4)}")
    try:
        for name in names:
            (staged / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(source / name, staged / name)
        if not target.exists():
            staged.rename(target)
            return
        for name in sorted(names, key=lambda name: name == Path(PROJECT_NAME)):  # the project when its files are there
            (target / name).parent.mkdir(parents=True, exist_ok=True)
            os.replace(staged / name, target / name)
    except OSError as error:
        raise InputError(
            "the project cannot be written",
            where=str(folder),
            found=error.strerror or error,
            cure="choose a folder that you may write to and that has free space",
        ) from None
    finally:
        shutil.rmtree(staged, ignore_errors=True)
