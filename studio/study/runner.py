"""The driver: hands tasks to workers, keeps their rows, and asks what is next."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from analysis.line.settings import Method
from render.base.threads import Cancel
from studio.project.project import Project
from studio.runtime.workers import EVERY_PROCESSOR, Engine, team
from studio.study.cells import WHOLE, Cell, Shard, methods_of, next_cells
from studio.study.searching import Searching
from studio.study.store import Store
from studio.study.study import SEARCHES, Study
from studio.study.tables import LOAD, task_seconds
from studio.study.tasks import Task, tasks

Progress = Callable[[int, int, int], None]
"""Cells done, cells known of so far, and how many searches may ask for beside those."""


def run_study(
    study: Study,
    bases: dict[str, Any],
    store: Store,
    *,
    engine: Engine = EVERY_PROCESSOR,
    shard: Shard = WHOLE,
    progress: Progress = lambda done, known, to_come: None,
    cancelled: Cancel = lambda: False,
    begun: Callable[[float], None] = lambda at: None,
) -> None:
    """Measure what is missing. Every task's rows are kept as it ends, so that nothing is lost or done twice.

    InputError: a field, value or base that does not fit, told before anything runs; workers that are lost again and
    again. Cancelled: so asked; what has been measured is kept. begun: hears, with the first cells, by `time.monotonic`
    when they were begun, as far as workers take time to start.
    """
    missing = next_cells(study, bases, store.rows(), shard)
    if not missing:
        return
    first = next(iter(bases.values()))
    methods = tuple(dict.fromkeys(method for sweep in study.sweeps for method in methods_of(study, sweep)))
    begin = partial(_warm_up, first.to_text(), str(first.folder), methods)
    searching = Searching(study, bases, shard, missing, store.rows())
    measured: list[str] = []
    done, known = store.count(), store.count() + len(missing)

    def follow() -> list[Task]:
        """What the searches ask for now."""
        nonlocal known
        cells = searching.next_cells(measured, store.rows)
        measured.clear()
        known += len(cells)
        return tasks(cells, study.image_scale, study.laser)

    first_told = False
    work = tasks(_searches_first(study, missing), study.image_scale, study.laser)
    progress(done, known, searching.to_come)
    with team(engine, _measure, begin, cancelled) as workers:
        for _, (seconds, found) in workers.results(work, cancelled, "the study", follow):
            if not first_told:
                begun(time.monotonic() - seconds)
                first_told = True
            store.add(found)
            measured += [key for key, _, _ in found]
            done += len(found)
            progress(done, known, searching.to_come)


def _searches_first(study: Study, cells: list[Cell]) -> list[Cell]:
    """One step of a search waits for the other, and other cells fill the time."""
    return sorted(cells, key=lambda cell: study.sweeps[cell.sweep].sampling not in SEARCHES)


def _measure(task: Task, cancelled: Cancel) -> Any:
    # not at the top: measuring takes libraries that the driver of several workers does without
    from studio.study.measuring import measure_task

    start = time.monotonic()
    found = measure_task(task, cancelled)
    taken = time.monotonic() - start
    processor = task_seconds([seconds for _, _, seconds in found])
    load = {LOAD: taken / processor} if processor > 0.0 else {}
    return taken, [(key, row, {**seconds, **load}) for key, row, seconds in found]


def _warm_up(text: str, folder: str, methods: tuple[Method, ...]) -> None:
    from studio.study.measuring import warm_up

    warm_up(Project.from_text(text).in_folder(Path(folder)), methods)
