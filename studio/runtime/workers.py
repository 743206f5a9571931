"""Tasks handed to processes of this machine or to a Dask cluster; each result comes back as its task ends.

What a worker does is a function of a task and of "asked to stop"; both it and its tasks can be pickled.
"""

from __future__ import annotations

import hashlib
import multiprocessing
import os
import pickle
import threading
from collections.abc import Callable, Hashable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from multiprocessing.connection import wait as wait_for
from multiprocessing.synchronize import Event
from pathlib import Path
from typing import Any, TypeVar

from render.base.errors import Cancelled, InputError
from render.base.kernel_cache import kept_in
from render.base.threads import Cancel, thread_count
from render.run import never
from studio.runtime.memory import return_large_blocks

T = TypeVar("T", bound=Hashable)
R = TypeVar("R")
Work = Callable[[T, Cancel], R]
MOST_LOST = 3
"""Times that a task may take its worker with it before it is given up."""
POLL = 0.2
"""s between looks at Ctrl-C."""


@dataclass(frozen=True)
class Engine:
    """workers: processes here, None for one a processor; scheduler: address of a Dask cluster in place of them."""

    workers: int | None = None
    scheduler: str | None = None

    def check(self) -> None:
        """Before anything is written for its work. InputError: no scheduler answers."""
        if self.scheduler is not None:
            from studio.runtime.cluster import check_answers

            check_answers(self.scheduler)


EVERY_PROCESSOR = Engine()


@dataclass(frozen=True)
class Team:
    """Workers that wait for tasks."""

    submit: Callable[[Any], Future[Any]]
    together: int
    """Tasks to hand out at a time: few, so that long work takes no memory."""

    def results(
        self, tasks: Sequence[T], cancelled: Cancel, what: str, more: Callable[[], Sequence[T]] = tuple
    ) -> Iterator[tuple[T, Any]]:
        """Each task with its result, as it ends. what: "the study", whose tasks they are.

        more: asked as soon as a result was taken, for tasks that follow from it, which go before those that wait.
        InputError: workers are lost again and again at one task. Cancelled: so asked.
        """
        waiting, lost = list(reversed(tasks)), dict[T, int]()
        running: dict[Future[Any], T] = {}
        while waiting or running:
            if cancelled():
                raise Cancelled
            while waiting and len(running) < self.together:
                task = waiting.pop()
                running[self.submit(task)] = task
            done, _ = wait(running, timeout=POLL, return_when=FIRST_COMPLETED)
            for future in done:
                task = running.pop(future)
                try:
                    yield task, future.result()
                except (BrokenProcessPool, ConnectionError) as error:
                    lost[task] = lost.get(task, 0) + 1
                    if lost[task] >= MOST_LOST:
                        raise InputError(
                            f"workers of {what} end before their work is done",
                            found=f"{type(error).__name__}, {MOST_LOST} times at one render",
                            cure="give it fewer --workers, as each takes memory; what was done is kept",
                        ) from None
                    waiting.append(task)
                else:
                    waiting += reversed(more())


@contextmanager
def team(engine: Engine, work: Work[Any, Any], begin: Callable[[], None], cancelled: Cancel) -> Iterator[Team]:
    """Workers that do `work`. begin: what each process does first, which compiles or loads the kernels of the work.

    It is done by this process once, where it never was, and by the others after that, so that nothing is compiled
    twice; they start meanwhile.
    InputError: no scheduler answers.
    """
    if engine.scheduler is not None:
        from studio.runtime.cluster import cluster

        with cluster(engine.scheduler, work) as (submit, together):
            yield Team(submit, together)
        return
    count = thread_count(engine.workers)
    if count == 1:
        return_large_blocks()
        begin()
        yield Team(partial(_here, work, cancelled), 1)
        return
    pool = _Pool(count, work, begin)
    try:
        pool.let_begin()
        yield Team(pool.submit, 2 * count)
    finally:
        pool.close()


def _here(work: Work[Any, Any], cancelled: Cancel, task: Any) -> Future[Any]:
    """Work in this process."""
    done: Future[Any] = Future()
    done.set_result(work(task, cancelled))
    return done


class _Pool:
    """Processes that are started anew where one was lost."""

    def __init__(self, count: int, work: Work[Any, Any], begin: Callable[[], None]) -> None:
        self.count, self.work, self.begin = count, work, begin
        self.context = multiprocessing.get_context("spawn")  # a fork would copy threads' locks
        self.stop, self.prepared = self.context.Event(), self.context.Event()
        self.executor = self._start()

    def _start(self) -> ProcessPoolExecutor:
        given = (self.begin, self.prepared, self.stop)
        executor = ProcessPoolExecutor(self.count, self.context, initializer=_begin, initargs=given)
        executor.submit(_nothing)  # which starts the processes
        return executor

    def let_begin(self) -> None:
        """Compile what was never compiled, while the processes start; then they go on."""
        done = Path(kept_in(), f"{hashlib.sha256(pickle.dumps(self.begin)).hexdigest()[:16]}.begun")
        if not done.exists():
            self.begin()
            with suppress(OSError):
                done.touch()
        self.prepared.set()

    def submit(self, task: Any) -> Future[Any]:
        try:
            return self.executor.submit(_in_worker, self.work, task)
        except BrokenProcessPool:
            self.executor.shutdown(wait=False, cancel_futures=True)
            self.executor = self._start()
            return self.executor.submit(_in_worker, self.work, task)

    def close(self) -> None:
        """What is under way is given up, so that work that was stopped ends at once."""
        self.stop.set()
        self.prepared.set()
        self.executor.shutdown(wait=True, cancel_futures=True)


_stopped: Cancel = never
"""In a worker: the driver gives up."""


def _in_worker(work: Work[Any, Any], task: Any) -> Any:
    return work(task, _stopped)


def _nothing() -> None:
    """The first task of a process."""


def _end_with_the_driver() -> None:
    """A driver that was killed can ask for nothing, and nobody would take what is found."""
    driver = multiprocessing.parent_process()
    if driver is not None:
        wait_for([driver.sentinel])
        os._exit(1)


def _begin(begin: Callable[[], None], prepared: Event, stop: Event) -> None:
    """In each process: Ctrl-C is the driver's to hear, and kernels are loaded before anything is timed."""
    global _stopped
    import signal

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_the_driver, name="end with the driver", daemon=True).start()
    _stopped = stop.is_set
    return_large_blocks()
    prepared.wait()
    if not stop.is_set():
        begin()
