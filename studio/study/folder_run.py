"""A study measured into a folder: the store while it runs, tables and page at its end, and what is heard meanwhile."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from render.base.errors import InputError
from render.base.threads import thread_count
from studio.project.project import Project
from studio.runtime.console import StageProgress
from studio.runtime.workers import EVERY_PROCESSOR, Engine
from studio.scan.folder_lock import hold
from studio.study.answers import Answer, answers
from studio.study.as_begun import begun_in, set_apart
from studio.study.begin import begin
from studio.study.cells import Cell, cells_at, row_of
from studio.study.start_up import remember
from studio.study.store import Row, Store, described
from studio.study.study import Study
from studio.study.tables import values_of, write_tables

SHARE = 0.1
"""Of the driver's time that may go into working out answers while the study runs."""


@dataclass(frozen=True)
class Found:
    """What a study's folder holds so far."""

    study: Study
    bases: Mapping[str, Project]
    rows: Mapping[str, Row]
    answers: tuple[Answer, ...]
    """Of each sweep."""

    def is_of(self, study: Study, bases: Mapping[str, Project]) -> bool:
        """Whether a study's cells may join it: its numbers are decided by the same things."""
        return self.study.digest(dict(self.bases)) == study.digest(dict(bases))

    def set_apart(self, study: Study, bases: Mapping[str, Project]) -> tuple[str, ...]:
        """The fields by which a study is another than this one, with their values."""
        return set_apart(study, bases, self.study, self.bases)

    def cell_of(self, number: int, spot: int) -> Cell:
        """The cell behind a spot of a sweep's chart: of its repeats the one that is nearest to their mean."""
        answer = self.answers[number]
        shown, name = answer.spots[spot], answer.sweep.measure
        asked = cells_at(self.study, number, self.bases, [shown.point])
        there = [(cell, row_of(cell, self.rows)) for cell in asked if cell.method == shown.method]
        measured = [(cell, row) for cell, row in there if row is not None]
        apart = abs(values_of([row for _, row in measured], name) - shown.measure.mean)
        cells = [cell for cell, _ in measured]
        return min(zip(apart, cells, strict=True), key=lambda pair: (not pair[0] >= 0.0, pair[0]))[1]


def found_in(study: Study, bases: Mapping[str, Project], rows: Mapping[str, Row]) -> Found:
    return Found(study, bases, rows, tuple(answers(study, bases, rows)))


def run_into(  # noqa: PLR0913
    folder: Path,
    study: Study,
    bases: dict[str, Project],
    *,
    engine: Engine = EVERY_PROCESSOR,
    progress: StageProgress = lambda stage, done: None,
    cancelled: Callable[[], bool] = lambda: False,
    grew: Callable[[Found], None] = lambda found: None,
    started: Callable[[float], None] = lambda seconds: None,
    there: Callable[[float], None] = lambda share: None,
) -> Found:
    """Measure what is missing, then write tables, charts and page. grew: hears what is found as it grows; started: how
    many seconds had passed when the first cells were begun; there: which share of all had been measured before.

    InputError: as `begin` and `run_study`. Cancelled: so asked; what has been measured is kept.
    """
    from studio.study.runner import run_study  # takes a while: not before a study runs

    progress("preparing", 0.0)
    called = time.monotonic()
    bases = begun_in(folder, study, bases)
    with begin(folder, study, bases, engine) as store:
        before, next_look = store.count(), 0.0

        def tell(done: int, known: int, to_come: int) -> None:
            nonlocal next_look
            first = "" if done > before else "; the first ones are under way, or wait for their workers to start"
            # by what the estimate counts on, so that the time left does not grow with what searches ask for
            all_cells = max(known + to_come, 1)
            there(before / all_cells)
            progress(f"{done} of {'up to ' if to_come else ''}{all_cells} cells{first}", done / all_cells)
            now = time.monotonic()
            if now >= next_look:
                grew(found_in(study, bases, store.rows()))
                spent = time.monotonic() - now
                next_look = now + spent / SHARE

        def begun(at: float) -> None:
            started(at - called)
            if engine.scheduler is None:
                remember(thread_count(engine.workers), at - called)

        try:
            run_study(
                study,
                bases,
                store,
                engine=engine,
                progress=tell,
                cancelled=cancelled,
                begun=begun,
            )
        finally:
            found = found_in(study, bases, store.rows())
            grew(found)
        from studio.study.page import write_page

        progress("writing tables and charts", 1.0)
        write_tables(folder, study, bases, found.rows)
        write_page(folder, study, bases, found.rows)
        return found


def opened(folder: Path) -> Found:
    """What a folder's study found so far. InputError: it holds none, or one of another program version."""
    study, bases = described(folder)
    with hold(folder, reading=True), Store(folder, None) as store:
        return found_in(study, bases, store.rows())


def in_window(error: InputError) -> str:
    """An error of a study as the window tells it, which has no options."""
    return str(error).replace(" with --out", "").replace("fewer --workers", "fewer workers")
