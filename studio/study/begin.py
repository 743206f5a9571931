"""Where every run of a study begins: all that it asks for is looked at, and its folder kept, before anything runs."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from render.base.errors import InputError
from render.base.files import remove_all_unfinished
from render.base.full_disk import require_room
from studio.project.project import Project
from studio.runtime.workers import Engine
from studio.scan.folder_lock import hold
from studio.study.as_begun import set_apart, told_apart
from studio.study.cells import WHOLE, Shard, check_size, next_cells
from studio.study.store import FILE, Store, described
from studio.study.study import Study

ROW_BYTES, CHART_BYTES = 2500, 250_000
"""On disk: of a cell in the store and the tables, and of a sweep's chart alone and in the page."""

RESULT = re.compile(r"(study|table|times|references|(chart|budget|bounds|boundary)_[0-9]+)\.[a-z]+")
"""Files made of the store."""


@contextmanager
def begin(
    folder: Path, study: Study, bases: dict[str, Project], engine: Engine, shard: Shard = WHOLE
) -> Iterator[Store]:
    """The store of a study's folder, which is this program's for so long.

    InputError: too many cells, a field or value that does not fit, no scheduler, a disk without room for it; the folder
    cannot be written, is at work elsewhere or holds another study.
    """
    check_size(study)
    cells = next_cells(study, bases, {}, shard)
    engine.check()
    there = sum(file.stat().st_size for file in folder.iterdir() if file.is_file()) if folder.is_dir() else 0
    require_room(folder, study_bytes(study, len(cells)) - there, "the study")
    _check_alike(folder, study, bases)
    with hold(folder), Store(folder, study.digest(bases)) as store:
        remove_all_unfinished(folder, RESULT.fullmatch)
        store.describe(study, bases)
        yield store


def _check_alike(folder: Path, study: Study, bases: dict[str, Project]) -> None:
    """InputError: the folder holds another study, and by which fields."""
    if not (folder / FILE).is_file():
        return
    try:
        there = described(folder)
    except InputError:  # told where the store is opened
        return
    if apart := set_apart(study, bases, *there):
        raise InputError(
            "the folder holds another study",
            where=str(folder),
            found=told_apart(apart),
            cure="choose another folder with --out; only values, methods and repeats may be added to this one",
        )


def study_bytes(study: Study, cells: int) -> int:
    """Of the folder of a study with so many cells, about."""
    return ROW_BYTES * cells + CHART_BYTES * len(study.sweeps)
