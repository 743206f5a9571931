"""How a study's file calls the project that it is of."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from render.base.errors import InputError
from studio.project.document import Document
from studio.project.project import Project
from studio.project.templates import DESCRIPTIONS, FOLDER
from studio.study.study import base_project


def base_name(document: Document) -> str:
    """The open project's: a template by its name, else the project's file."""
    if document.path is not None:
        return document.path.name
    template = document.root.parent == FOLDER and document.root.name in DESCRIPTIONS
    return document.root.name if template else "project.json"


def base_from(folder: Path, base: str, document: Document, loaded: Mapping[str, Project]) -> str:
    """The base of a study whose file is to stand in a folder. loaded: bases that came from files.

    InputError: no path leads there.
    """
    own = loaded.get(base, document.project)
    if base in DESCRIPTIONS and own == base_project(base, folder):
        return base
    path = document.path
    cure = "save the project, then the study beside it or in a folder above"
    if base in loaded or path is None or document.dirty:
        raise InputError("the study's base project is in no file beside it", where=base, cure=cure)
    try:
        return path.resolve().relative_to(folder.resolve()).as_posix()
    except ValueError:
        raise InputError("a study's file stands beside its base project", where=str(path), cure=cure) from None
