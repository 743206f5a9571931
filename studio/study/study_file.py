"""A study as a file, and how that calls the project that it is of."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from render.base.errors import InputError
from render.base.files import atomic_write
from studio.project.document import Document
from studio.project.project import Project
from studio.project.project_files import check_no_project
from studio.project.strict_json import pretty
from studio.project.templates import DESCRIPTIONS, FOLDER
from studio.study.study import Study, base_project, named_bases

CURE = "save the project, then the study beside it or in a folder above"


def base_name(document: Document) -> str:
    """The open project's: a template by its name, else the project's file."""
    if document.path is not None:
        return document.path.name
    template = document.root.parent == FOLDER and document.root.name in DESCRIPTIONS
    return document.root.name if template else "project.json"


def write_study(file: Path, study: Study, document: Document, loaded: Mapping[str, Project]) -> None:
    """Of the open document, or of bases that came from files. InputError: it cannot be written, or finds no base."""
    check_no_project(file, "study")
    base = _base_from(file.parent, study.base, document, loaded)
    data = study.model_copy(update={"base": base}).model_dump(mode="json", exclude_defaults=True)
    with atomic_write(file) as temporary:
        temporary.write_text(pretty({"schema_version": 1, **data}) + "\n", encoding="utf-8")


def check_base(base: str, document: Document, loaded: Mapping[str, Project]) -> bool:
    """Whether the base of a study is the open project's own file, and not a ready-made one. loaded: as `_base_from`.

    InputError: it is in no file that a study's could name.
    """
    own = loaded.get(base, document.project)
    if base in named_bases() and own == base_project(base, Path()):
        return False
    if base in loaded or document.path is None or document.dirty:
        raise InputError("the study's base project is in no file beside it", where=base, cure=CURE)
    return True


def waits_for_project(base: str, document: Document, loaded: Mapping[str, Project]) -> bool:
    """Whether a study can be saved as soon as the open project is, and not before."""
    try:
        check_base(base, document, loaded)
    except InputError:
        return base not in loaded
    return False


def _base_from(folder: Path, base: str, document: Document, loaded: Mapping[str, Project]) -> str:
    """The base of a study whose file is to stand in a folder. loaded: bases that came from files.

    InputError: no path leads there.
    """
    path = document.path
    if not check_base(base, document, loaded) or path is None:
        return base
    try:
        return path.resolve().relative_to(folder.resolve()).as_posix()
    except ValueError:
        raise InputError("a study's file stands beside its base project", where=str(path), cure=CURE) from None
