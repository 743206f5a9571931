"""The driver: hands tasks to workers, keeps their rows, and asks what is next."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from render.base.threads import Cancel
from studio.project.project import Project
from studio.runtime.workers import EVERY_PROCESSOR, Engine, team
from studio.study.cells import WHOLE, Shard, next_cells
from studio.study.measuring import measure_task, tasks, warm_up
from studio.study.store import Store
from studio.study.study import Study

Progress = Callable[[int, int], None]
"""Cells done, and cells known of so far: a bisection finds out as it goes."""


def run_study(
    study: Study,
    bases: dict[str, Any],
    store: Store,
    *,
    engine: Engine = EVERY_PROCESSOR,
    shard: Shard = WHOLE,
    progress: Progress = lambda done, known: None,
    cancelled: Cancel = lambda: False,
) -> None:
    """Measure what is missing. Every task's rows are kept as it ends, so that nothing is lost or done twice.

    InputError: a field, value or base that does not fit, told before anything runs; workers that are lost again and
    again. Cancelled: so asked; what has been measured is kept.
    """
    first = next(iter(bases.values()))
    begin = partial(_warm_up, first.to_text(), str(first.folder))
    with team(engine, measure_task, begin, cancelled) as workers:
        while True:
            rows = store.rows()
            work = tasks(next_cells(study, bases, rows, shard), study.image_scale, study.laser)
            if not work:
                return
            done, known = store.count(), store.count() + sum(len(task.cells) for task in work)
            for _, found in workers.results(work, cancelled, "the study"):
                store.add(found)
                done += len(found)
                progress(done, known)


def _warm_up(text: str, folder: str) -> None:
    warm_up(Project.from_text(text).in_folder(Path(folder)))
