"""Jobs for the desktop: one at a time in each lane, the newest request next or all in order, all signals on the
window's thread.
"""

from __future__ import annotations

import contextlib
import math
import sys
import time
from collections.abc import Callable
from typing import Any

from PySide6.QtCore import QCoreApplication, QObject, Qt, QTimer, Signal

from studio.runtime.jobs import Job, State, Work

RENDER = "render"
"""The lane of final renders: there is one at a time in the whole desktop."""
BUSY = "Something is being rendered: wait for it, or cancel it first (Shift+F5)"
"""What a person is told who asks for another one."""
PROGRESS_MS, RAREST_MS = 100, 1000
"""Between two looks at the progress of jobs: where the window is drawn slowly they are rarer."""
DRAWING = 0.1
"""Share of the time for drawing progress, at most: where 3D is drawn by the processor, which the jobs need, a word that
changes is a picture of the whole window."""
SWITCH_SECONDS = 0.002
"""How long a busy Python thread may keep the interpreter while the window waits for it (Python's own: 5 ms)."""


class JobRunner(QObject):
    """Starts jobs and tells about them. Every signal carries the `Job`."""

    started = Signal(object)
    progress = Signal(object)
    """At most ten times a second, also while the job is paused."""
    finished = Signal(object)
    failed = Signal(object)
    """`job.problem` says why."""
    cancelled = Signal(object)
    _ended = Signal(object)

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._running: dict[str, Job[Any]] = {}
        self._next: dict[str, list[Job[Any]]] = {}
        self._then: dict[Job[Any], Callable[[Any], None]] = {}
        self._closed = False
        self._timer = QTimer(self, interval=PROGRESS_MS)
        self._timer.timeout.connect(self._tell)
        self._ended.connect(self._end, Qt.ConnectionType.QueuedConnection)
        sys.setswitchinterval(SWITCH_SECONDS)
        app = QCoreApplication.instance()
        if app is not None:
            app.aboutToQuit.connect(self.close)

    def run(
        self,
        lane: str,
        name: str,
        work: Work[Any],
        then: Callable[[Any], None] | None = None,
        *,
        interrupt: bool = False,
        in_turn: bool = False,
    ) -> Job[Any]:
        """Start work in a lane, or have it wait for the job there; a newer request takes a waiting one's place.

        then: called with the result, on this thread. interrupt: the job that runs in the lane is cancelled. in_turn:
        it waits behind those that wait.
        """
        job: Job[Any] = Job(name, work, self._tell_end)
        if then is not None:
            self._then[job] = then
        if lane in self._running:
            if not in_turn:
                self._forget_waiting(lane)
            self._next.setdefault(lane, []).append(job)
            if interrupt:
                self._running[lane].cancel()
        else:
            self._start(lane, job)
        return job

    def job(self, lane: str = RENDER) -> Job[Any] | None:
        """The one that runs in a lane."""
        return self._running.get(lane)

    def jobs(self, lane: str) -> list[Job[Any]]:
        """The one that runs in a lane, and those that wait there."""
        running = self.job(lane)
        return [] if running is None else [running, *self._next.get(lane, [])]

    @property
    def busy(self) -> bool:
        """Something runs or waits."""
        return bool(self._running)

    def cancel(self, lane: str = RENDER) -> None:
        """Stop what runs in a lane, and forget what waits there."""
        self._forget_waiting(lane)
        if lane in self._running:
            self._running[lane].cancel()

    def close(self) -> None:
        """Cancel everything and wait for the threads; nothing starts or is told afterwards."""
        self._closed = True
        self._next.clear()
        self._then.clear()
        self._timer.stop()
        for job in self._running.values():
            job.cancel()
        for job in self._running.values():
            job.join()
        self._running.clear()

    def _forget_waiting(self, lane: str) -> None:
        for job in self._next.pop(lane, ()):
            self._then.pop(job, None)

    def _start(self, lane: str, job: Job[Any]) -> None:
        if self._closed:
            return
        self._running[lane] = job
        job.start()
        self._timer.start()
        self.started.emit(job)

    def _tell_end(self, job: Job[Any]) -> None:
        """On the job's thread; the runner may be gone by then."""
        with contextlib.suppress(RuntimeError):
            self._ended.emit(job)

    def _end(self, job: Job[Any]) -> None:
        lane = next((name for name, running in self._running.items() if running is job), None)
        if lane is None or self._closed:
            return
        job.join()
        del self._running[lane]
        waiting = self._next.pop(lane, [])
        then = self._then.pop(job, None)
        if not self._running and not waiting:
            self._timer.stop()
        if job.state is State.DONE:
            if then is not None:
                then(job.result)
            self.finished.emit(job)
        elif job.state is State.FAILED:
            self.failed.emit(job)
        else:
            self.cancelled.emit(job)
        if not waiting or self._closed:
            return
        if lane in self._running:  # what was told has started another
            self._next.setdefault(lane, waiting)
            return
        self._start(lane, waiting[0])
        if waiting[1:]:
            self._next[lane] = [*waiting[1:], *self._next.get(lane, [])]

    def _tell(self) -> None:
        began = time.perf_counter()
        for job in list(self._running.values()):
            self.progress.emit(job)
        # once what changed is drawn
        QTimer.singleShot(0, self, lambda: self._space(time.perf_counter() - began))

    def _space(self, drawn: float) -> None:
        """drawn: s that the last look took."""
        self._timer.setInterval(round(min(max(PROGRESS_MS, 1e3 * drawn / DRAWING), RAREST_MS)))


def time_left(seconds: float | None) -> str:
    """ "0:12 left"."""
    if seconds is None:
        return ""
    whole = max(1, round(seconds))
    minutes, rest = divmod(whole, 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d} left" if hours else f"{minutes}:{rest:02d} left"


def duration(seconds: float) -> str:
    """To the second below a minute, to the minute from an hour."""
    if seconds < 60.0:
        return f"{max(1, math.ceil(seconds))} s"
    minutes = round(seconds / 60.0)
    return f"{minutes} min" if minutes < 60 else f"{minutes // 60} h {minutes % 60:02d} min"
