"""What a study that goes on reads off its projects: as its folder has it, unless what it asks for has changed."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from render.base.errors import InputError
from studio.project.project import READ_OFF, Project
from studio.study.store import FILE, described
from studio.study.study import Study, parts_of


def as_begun(study: Study, bases: Mapping[str, Project], begun: Mapping[str, Project]) -> dict[str, Project]:
    """Base projects for a study whose folder was begun with others.

    Measures of the part and the report that were changed since, and that the study does not ask for, are as they were,
    so that every row of the folder has the same columns and none is measured twice.
    """
    return {name: _one(study, base, begun.get(name)) for name, base in bases.items()}


def begun_in(folder: Path, study: Study, bases: Mapping[str, Project]) -> dict[str, Project]:
    """The same for a folder; one that holds no study, or one that cannot be read, leaves them as they are."""
    if (folder / FILE).is_file():
        with suppress(InputError):  # told where the folder is opened
            return as_begun(study, bases, described(folder)[1])
    return dict(bases)


def _one(study: Study, base: Project, begun: Project | None) -> Project:
    if begun is None or base.read_as(begun) != begun or _asked(study, base) != _asked(study, begun):
        return base
    return begun.in_folder(base.folder)


def _asked(study: Study, project: Project) -> Any:
    """What the study reads off the project: the measures that it names, and all where it varies or fixes a part."""
    fields = {*study.set, *(field for sweep in study.sweeps for field in sweep.set)}
    fields |= {one.field for sweep in study.sweeps for one in sweep.vary}
    if any(parts_of(field)[:1] == [name] for field in fields for name in READ_OFF):
        return [getattr(project, name) for name in READ_OFF]
    names = {name.partition(":")[2] for sweep in study.sweeps for name in sweep.asked if ":" in name}
    return [project.measured_in, *(one for one in project.measures if one.name in names)] if names else []
