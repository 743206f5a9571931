"""Where a command reads and writes: the project that is asked for, and the folder of its results."""

from __future__ import annotations

import os
import re
from pathlib import Path

from render.base.errors import InputError
from studio.project.project import Project, project_file, template_or_path
from studio.project.templates import template_folder

SAMPLE = "weld_seam"
OUTPUT = "scan-output"


def chosen_file(path: Path | None) -> Path:
    """The project file at a path (itself, or the one in a folder), or of a template by its name, or the sample's."""
    return project_file(template_folder(SAMPLE) if path is None else template_or_path(str(path)))


def load_project(path: Path | None) -> tuple[Project, Path]:
    """The project at a path (a file, or a folder with one project), a template, or the sample; and its folder."""
    file = chosen_file(path)
    return Project.load(file), file.parent


def folder_name(name: str) -> str:
    """A project's name as a folder: lower case, words joined by underscores."""
    return re.sub(r"[^a-z0-9]+", "_", name.lower()).strip("_") or "project"


def check_output(folder: Path) -> None:
    """InputError before any work where results could not be written afterwards."""
    place = folder
    while not place.exists() and place != place.parent:
        place = place.parent
    if not place.is_dir() or not os.access(place, os.W_OK | os.X_OK):
        raise InputError(
            "the output folder cannot be written",
            where=str(folder),
            found="a file of that name" if place.is_file() else f"no permission to write in {place}",
            cure="choose another with --out",
        )


def never() -> bool:
    """Ctrl-C raises KeyboardInterrupt; nothing else cancels a command."""
    return False
