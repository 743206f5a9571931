"""Long work on a thread of its own: progress, time left, pause, cancel, and failures in plain words. Qt-free."""

from __future__ import annotations

import contextlib
import os
import threading
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import Generic, TypeVar

from render.base.errors import Cancelled, InputError
from render.base.threads import Cancel
from studio.runtime.place_words import in_words

Result = TypeVar("Result")
Progress = Callable[[str, float], None]
"""progress(what is being done, share of the whole job 0..1)."""
Work = Callable[[Progress, Cancel], Result]
"""What a job runs: it calls cancelled() every few milliseconds, and raises Cancelled or returns when it says True."""

POLITENESS = 5
"""Added to the niceness of a job's threads, so that the window's thread is served first."""
EARLIEST_ESTIMATE = 0.5
"""Seconds of work before the time left is told."""
LONG_START = 10.0
"""s without any progress that are no measure of what follows."""
SMALL_SHARE, LONG_WORK = 0.05, 20.0
"""Of the work, by which alone nobody can judge the rest, and seconds from which a poor estimate is better than none."""


class State(StrEnum):
    QUEUED = "queued"
    RUNNING = "running"
    PAUSED = "paused"
    CANCELLED = "cancelled"
    FAILED = "failed"
    DONE = "done"


ENDED = frozenset({State.CANCELLED, State.FAILED, State.DONE})


@dataclass(frozen=True)
class Problem:
    """Why a job failed: `text` names cause and cure for a person, `details` is for the log."""

    text: str
    details: str = ""
    exception: BaseException | None = None


def explain(error: BaseException, name: str) -> Problem:
    """The problem that an exception stands for."""
    if isinstance(error, InputError):
        return Problem(in_words(str(error)), "", error)
    details = "".join(traceback.format_exception(error))
    if isinstance(error, MemoryError):
        cure = "close other programs, or choose a smaller image scale, a smaller image or lighter meshes"
        return Problem(f"{name} needs more memory than there is; {cure}", details, error)
    reason = f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
    text = f"{name} stopped by an internal error ({reason}); the project is unharmed, the log holds the details"
    return Problem(text, details, error)


class Job(Generic[Result]):
    """One piece of work on one thread. `on_end(job)` is called once, on that thread, in the state the job ended in."""

    def __init__(self, name: str, work: Work[Result], on_end: Callable[[Job[Result]], None] = lambda job: None) -> None:
        """name: as a status bar shows it ("render")."""
        self.name = name
        self.on_end = on_end
        self.stage = ""
        self.done = 0.0
        self.there = 0.0
        """Share of the work that an earlier run has done: it is found in no time, which is no measure of the rest."""
        self.start_up: float | None = None
        """s before what is counted was begun, where the work tells; None: judged by the first progress."""
        self.result: Result | None = None
        self.problem: Problem | None = None
        self._work = work
        self._state = State.QUEUED
        self._stop = threading.Event()
        self._go = threading.Event()
        self._go.set()
        self._lock = threading.Lock()
        self._thread: threading.Thread | None = None
        self._since: float | None = None
        self._seconds = 0.0
        self._told = 0.0
        """Seconds of work when `done` was told last."""
        self._begun = (0.0, 0.0)
        """Seconds of work, and how much was done then, from which on the rest is foretold."""

    @property
    def state(self) -> State:
        return self._state

    @property
    def ended(self) -> bool:
        return self._state in ENDED

    @property
    def seconds(self) -> float:
        """Time at work so far; pauses do not count."""
        since = self._since
        return self._seconds + (time.perf_counter() - since if since is not None else 0.0)

    @property
    def seconds_left(self) -> float | None:
        """Estimated from the progress; None while that says too little."""
        enough = 0.01 if self.seconds >= LONG_WORK else SMALL_SHARE
        if self.ended or self.done - self.there < enough * (1.0 - self.there) or self.seconds < EARLIEST_ESTIMATE:
            return None
        begun, first = self._begun if self.start_up is None else (self.start_up, self.there)
        if self.done <= first:
            return None
        # time that passes since the work told how far it is makes what is left less, not more
        left = (self._told - begun) / (self.done - first) * (1.0 - first) + begun - self.seconds
        return left if left > 0.0 else None

    def start(self) -> None:
        """Begin; a job that was cancelled before ends without having worked."""
        if self._thread is not None:
            raise RuntimeError(f"job {self.name!r} was started before")
        self._thread = threading.Thread(target=self._run, name=f"job {self.name}", daemon=True)
        self._thread.start()

    def pause(self) -> None:
        """Hold the work at its next look at `cancelled`."""
        with self._lock:
            if self._state is State.RUNNING:
                self._state = State.PAUSED
                self._stop_clock()
                self._go.clear()

    def resume(self) -> None:
        with self._lock:
            if self._state is State.PAUSED:
                self._state = State.RUNNING
                self._since = time.perf_counter()
                self._go.set()

    def cancel(self) -> None:
        """Ask the work to stop; a paused one as well."""
        self._stop.set()
        self._go.set()

    def cancelled(self) -> bool:
        """For the work: waits while the job is paused, then says whether to stop."""
        self._go.wait()
        return self._stop.is_set()

    @property
    def cancel_asked(self) -> bool:
        """As `cancelled`, without waiting."""
        return self._stop.is_set()

    def join(self, seconds: float | None = None) -> bool:
        """Wait for the thread to end; False: it has not within that time."""
        if self._thread is not None and self._thread is not threading.current_thread():
            self._thread.join(seconds)
            return not self._thread.is_alive()
        return True

    def _progress(self, stage: str, done: float) -> None:
        done = min(max(done, 0.0), 1.0)
        if done != self.done:
            self._told = self.seconds
            if done <= self.there:
                self._begun = self._told, done
            elif self.done == 0.0 and self._told > LONG_START:
                self._begun = self._told, done  # until then workers started, which the rest does not do again
        self.stage, self.done = stage, done

    def _run(self) -> None:
        _be_polite()
        with self._lock:
            self._state, self._since = State.RUNNING, time.perf_counter()
        state = State.DONE
        try:
            if self._stop.is_set():
                raise Cancelled
            self.result = self._work(self._progress, self.cancelled)
            self.done = 1.0
        except Cancelled:
            state = State.CANCELLED
        except BaseException as error:  # whatever it is, a person must hear of it
            self.problem = explain(error, self.name)
            state = State.FAILED
        with self._lock:
            self._stop_clock()
            self._state = state
        self.on_end(self)

    def _stop_clock(self) -> None:
        if self._since is not None:
            self._seconds += time.perf_counter() - self._since
            self._since = None


def _be_polite() -> None:
    """Lower this thread's priority, and so that of every pool it opens; only Linux has it by thread."""
    if hasattr(os, "setpriority") and os.uname().sysname == "Linux":
        with contextlib.suppress(OSError):
            here = threading.get_native_id()
            os.setpriority(os.PRIO_PROCESS, here, os.getpriority(os.PRIO_PROCESS, here) + POLITENESS)
