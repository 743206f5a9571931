"""What a study that goes on takes over from its folder, and what sets it apart from the study that is there."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from render.base.errors import InputError
from studio.project.project import READ_OFF, Project
from studio.study.changes import ONE, Change, changes
from studio.study.store import FILE, described
from studio.study.study import Study, field_place, parts_of

OF_NO_CELL = ("name", "extraction.method")
"""Fields that a cell has of its own, or does not have, whatever a study varies."""
MOST_TOLD = 4
LONGEST = 40
"""Characters of a list that is told."""


def as_begun(study: Study, bases: Mapping[str, Project], begun: Mapping[str, Project]) -> dict[str, Project]:
    """Base projects for a study whose folder was begun with others.

    What no cell takes of its base is as it was: a field that every sweep gives values of its own, and measures of the
    part and the report that the study does not ask for. So every row of the folder has the same columns and none is
    measured twice.
    """
    before = _before(bases, begun)
    return {name: _one(study, name, base, before.get(name)) for name, base in bases.items()}


def begun_in(folder: Path, study: Study, bases: Mapping[str, Project]) -> dict[str, Project]:
    """The same for a folder; one that holds no study, or one that cannot be read, leaves them as they are."""
    if (folder / FILE).is_file():
        with suppress(InputError):  # told where the folder is opened
            return as_begun(study, bases, described(folder)[1])
    return dict(bases)


def set_apart(
    study: Study, bases: Mapping[str, Project], begun: Study, begun_with: Mapping[str, Project]
) -> tuple[str, ...]:
    """Each field by which a study is another than that of a folder: "Bit depth: 12 in the folder, 10 now"."""
    told = []
    if begun.image_scale != study.image_scale:
        told.append(f"Image scale: {begun.image_scale:g} in the folder, {study.image_scale:g} now")
    if begun.laser != study.laser:
        measured, asked = _laser_of(begun, begun_with), _laser_of(study, bases)
        told.append(f"Laser: {measured} in the folder, {asked} now")
    for name in dict.fromkeys((*begun.set, *study.set)):
        there, now = begun.set.get(name, "not fixed"), study.set.get(name, "not fixed")
        if there != now:
            told.append(f"{name}, which is fixed: {there} in the folder, {now} now")
    known = _before(bases, begun_with)
    for name, base in as_begun(study, bases, begun_with).items():
        before = known.get(name)
        if before is None:
            told.append(f"Base project: {', '.join(sorted(begun_with))} in the folder, {name} now")
            continue
        read = base if _asked(study, base) != _asked(study, before) else base.read_as(before)
        told += [_told(one) for one in changes(before, read)]
    return tuple(dict.fromkeys(told))


def _laser_of(study: Study, bases: Mapping[str, Project]) -> str:
    """By its name; by its number where no base is known that has it."""
    base = bases.get(study.base)
    lasers = () if base is None else base.scene.lasers
    return lasers[study.laser].name if study.laser < len(lasers) else str(study.laser)


def told_apart(apart: tuple[str, ...]) -> str:
    """In one line, the first few of them."""
    more = len(apart) - MOST_TOLD
    return "; ".join(apart[:MOST_TOLD]) + (f"; and {more} more" if more > 0 else "")


def _told(change: Change) -> str:
    """Of long lists, as those of a calibration, only whether there is one."""
    there, now = (ONE if is_long(value) else value for value in (change.a, change.b))
    if there == now == ONE:
        return f"{change.label}: another one in the folder"
    return f"{change.label}: {there} in the folder, {'there is one' if now == ONE else now} now"


def is_long(value: str) -> bool:
    return value.startswith(("[", "{")) and len(value) > LONGEST


def _before(bases: Mapping[str, Project], begun: Mapping[str, Project]) -> dict[str, Project]:
    """What each base project was in the folder: the one of its name, else the one that it differs from least.

    A project's file may have another name since, or its first one, and holds what it held.
    """
    found = {name: begun[name] for name in bases if name in begun}
    left = [begun[name] for name in begun if name not in bases]
    for name in bases:
        if name not in found and left:
            apart = [sum(1 for _ in changes(one, bases[name])) for one in left]
            found[name] = left.pop(apart.index(min(apart)))
    return found


def _one(study: Study, name: str, base: Project, begun: Project | None) -> Project:
    if begun is None or base == begun:
        return base
    base = _as_in_no_cell(study, name, base, begun)
    if base.read_as(begun) != begun or _asked(study, base) != _asked(study, begun):
        return base
    return begun.in_folder(base.folder)


def _as_in_no_cell(study: Study, name: str, base: Project, begun: Project) -> Project:
    """The base with the values that it began with, of the fields that each of its sweeps gives its own."""
    given = [
        {*study.set, *sweep.set, *(one.field for one in sweep.vary)}
        for sweep in study.sweeps
        if (sweep.base or study.base) == name
    ]
    fields = {*OF_NO_CELL, *(set.intersection(*given) if given else ())}
    data, before = base.model_dump(mode="json"), begun.model_dump(mode="json")
    for field in sorted(fields):
        with suppress(InputError):  # of boards or effects, or one that the other project does not have
            (there, part), (place, own) = field_place(before, field, field), field_place(data, field, field)
            place[own] = there[part]
    for now, then in zip(data["scene"]["objects"], before["scene"]["objects"], strict=False):
        # saving a project writes the digests of its meshes into it, and changes no mesh
        if "sha256" in now["shape"] and then["shape"].get("sha256", "known") is None:
            now["shape"]["sha256"] = None
    with suppress(InputError):  # beside other values of now it may not be allowed, and another set-up stays one
        return Project.from_data(data, name).in_folder(base.folder)
    return base


def _asked(study: Study, project: Project) -> Any:
    """What the study reads off the project: the measures that it names, and all where it varies or fixes a part."""
    fields = {*study.set, *(field for sweep in study.sweeps for field in sweep.set)}
    fields |= {one.field for sweep in study.sweeps for one in sweep.vary}
    if any(parts_of(field)[:1] == [name] for field in fields for name in READ_OFF):
        return [getattr(project, name) for name in READ_OFF]
    names = {name.partition(":")[2] for sweep in study.sweeps for name in sweep.asked if ":" in name}
    return [project.measured_in, *(one for one in project.measures if one.name in names)] if names else []
