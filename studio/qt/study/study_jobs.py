"""What the study of a session does on threads of its own: estimate, run, read a folder. Nothing here touches Qt."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from render.base.errors import InputError
from render.base.threads import Cancel
from studio.project.project import Project
from studio.runtime.jobs import Progress
from studio.runtime.workers import Engine
from studio.study.estimate import Costs, Estimate, costs, estimate
from studio.study.folder_run import Found, in_window, opened
from studio.study.start_up import foretold
from studio.study.store import Row
from studio.study.study import Study


@dataclass(frozen=True)
class Ended:
    """How a run of the study went. problem: why it could not go on, in a sentence."""

    found: Found | None
    problem: str = ""


def estimating(
    study: Study,
    bases: Mapping[str, Project],
    rows: Mapping[str, Row],
    known: dict[str, Costs],
    workers: int,
    *,
    timed: bool,
) -> Callable[[Progress, Cancel], Estimate | str]:
    """known: costs by sweep, to which those that are measured are added, where `timed` asks for them.

    workers: that a run starts.
    """

    def work(progress: Progress, cancelled: Cancel) -> Estimate | str:
        try:
            for number, sweep in enumerate(study.sweeps if timed else ()):
                if not cancelled():
                    progress(f"timing {sweep.name}", number / len(study.sweeps))
                    known[sweep.name] = costs(study, bases, number)
            return replace(estimate(study, bases, rows, known), start_up=foretold(workers))
        except InputError as error:
            return in_window(error)

    return work


def running(
    run: Callable[..., Found],
    folder: Path,
    study: Study,
    bases: dict[str, Project],
    engine: Engine,
    grew: Callable[[Found], None],
    started: Callable[[float], None],
    there: Callable[[float], None],
) -> Callable[[Progress, Cancel], Ended]:
    """run: `run_into`, which hears of the rest."""

    def work(progress: Progress, cancelled: Cancel) -> Ended:
        told = {"progress": progress, "cancelled": cancelled, "grew": grew, "started": started, "there": there}
        try:
            return Ended(run(folder, study, bases, engine=engine, **told))
        except InputError as error:
            return Ended(None, in_window(error))

    return work


def reading(folder: Path) -> Callable[[Progress, Cancel], Ended]:
    """What a folder's study found so far."""

    def work(progress: Progress, cancelled: Cancel) -> Ended:
        try:
            return Ended(opened(folder))
        except InputError as error:
            return Ended(None, in_window(error))

    return work
