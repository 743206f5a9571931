"""The driver: hands tasks to processes or to a Dask cluster, keeps their rows, and asks what is next."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from multiprocessing.synchronize import Event
from typing import Any

from render.base.errors import Cancelled, InputError
from render.base.threads import Cancel, thread_count
from render.run import never
from studio.study.cells import WHOLE, Shard, next_cells
from studio.study.measuring import Task, measure_task, tasks, warm_up
from studio.study.store import Store
from studio.study.study import Study

Progress = Callable[[int, int], None]
"""Cells done, and cells known of so far: a bisection finds out as it goes."""
Submit = Callable[[Task], Any]
MOST_LOST = 3
"""Times that a task may take its worker with it before it is given up."""
POLL = 0.2
"""s between looks at Ctrl-C."""


@dataclass(frozen=True)
class Engine:
    """workers: processes here, None for one a processor; scheduler: address of a Dask cluster in place of them."""

    workers: int | None = None
    scheduler: str | None = None


def run_study(
    study: Study,
    bases: dict[str, Any],
    store: Store,
    *,
    engine: Engine = Engine(),
    shard: Shard = WHOLE,
    progress: Progress = lambda done, known: None,
    cancelled: Cancel = lambda: False,
) -> None:
    """Measure what is missing. Every task's rows are kept as it ends, so that nothing is lost or done twice.

    InputError: a field, value or base that does not fit, told before anything runs; workers that are lost again and
    again. Cancelled: so asked; what has been measured is kept.
    """
    with _workers(bases, engine, cancelled) as (submit, together):
        while True:
            rows = store.rows()
            work = tasks(next_cells(study, bases, rows, shard), study.image_scale, study.laser)
            if not work:
                return
            done, known = store.count(), store.count() + sum(len(task.cells) for task in work)
            for found in _measured(submit, together, work, cancelled):
                store.add(found)
                done += len(found)
                progress(done, known)


def _measured(submit: Submit, together: int, work: Sequence[Task], cancelled: Cancel) -> Iterator[list[Any]]:
    """Rows of each task as it ends; few are handed out at a time, so that a long study takes no memory."""
    waiting, lost = list(reversed(work)), dict[Task, int]()
    running: dict[Future[Any], Task] = {}
    while waiting or running:
        if cancelled():
            raise Cancelled
        while waiting and len(running) < together:
            task = waiting.pop()
            running[submit(task)] = task
        done, _ = wait(running, timeout=POLL, return_when=FIRST_COMPLETED)
        for future in done:
            task = running.pop(future)
            try:
                yield future.result()
            except (BrokenProcessPool, ConnectionError) as error:
                lost[task] = lost.get(task, 0) + 1
                if lost[task] >= MOST_LOST:
                    raise InputError(
                        "workers of the study end before their work is done",
                        found=f"{type(error).__name__}, {MOST_LOST} times at one render",
                        cure="give it fewer --workers, as each takes memory; what was measured is kept",
                    ) from None
                waiting.append(task)


@contextmanager
def _workers(bases: dict[str, Any], engine: Engine, cancelled: Cancel) -> Iterator[tuple[Submit, int]]:
    """How to hand a task out, and how many at a time."""
    if engine.scheduler is not None:
        from studio.study.cluster import cluster

        with cluster(engine.scheduler) as (submit, together):
            yield submit, together
        return
    count = thread_count(engine.workers)
    first = next(iter(bases.values()))
    warm_up(first)  # once, before the processes do it beside each other
    if count == 1:
        yield partial(_here, cancelled=cancelled), 1
        return
    pool = _Pool(count, first)
    try:
        yield pool.submit, 2 * count
    finally:
        pool.close()


def _here(task: Task, cancelled: Cancel) -> Future[Any]:
    """Measure in this process."""
    done: Future[Any] = Future()
    done.set_result(measure_task(task, cancelled))
    return done


class _Pool:
    """Processes that are started anew where one was lost."""

    def __init__(self, count: int, base: Any) -> None:
        self.count, self.base = count, base
        self.context = multiprocessing.get_context("spawn")  # a fork would copy threads' locks
        self.stop = self.context.Event()
        self.executor = self._start()

    def _start(self) -> ProcessPoolExecutor:
        begin_with = self.base.to_text(), str(self.base.folder), self.stop
        return ProcessPoolExecutor(self.count, self.context, initializer=_begin, initargs=begin_with)

    def submit(self, task: Task) -> Future[Any]:
        try:
            return self.executor.submit(_in_worker, task)
        except BrokenProcessPool:
            self.executor.shutdown(wait=False, cancel_futures=True)
            self.executor = self._start()
            return self.executor.submit(_in_worker, task)

    def close(self) -> None:
        """What is under way is given up, so that a study that was stopped ends at once."""
        self.stop.set()
        self.executor.shutdown(wait=True, cancel_futures=True)


_stopped: Cancel = never
"""In a worker: the driver gives up."""


def _in_worker(task: Task) -> list[Any]:
    return measure_task(task, _stopped)


def _begin(text: str, folder: str, stop: Event) -> None:
    """In each process: Ctrl-C is the driver's to hear, and kernels are loaded before anything is timed."""
    global _stopped
    import signal

    from studio.project.project import Project

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _stopped = stop.is_set
    warm_up(Project.from_text(text).in_folder(folder))
