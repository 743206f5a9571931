"""Work of hours that goes into a folder and on from there, beside what else the window does."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar

from PySide6.QtCore import QObject, Signal

from studio.qt.core.jobs import JobRunner
from studio.qt.core.session import Session
from studio.runtime.jobs import Job, State
from studio.runtime.workers import Engine


class LongWork(QObject):
    """One run at a time, in a lane of its own: renders go on beside it."""

    NAME: ClassVar[str]
    """What it makes: "study"; the name of its lane."""
    state_changed = Signal()
    """It runs, or no longer, or what it would make is another thing."""

    def __init__(self, session: Session) -> None:
        super().__init__(session)
        self.session = session
        self.engine = Engine()
        self.folder: Path | None = None
        self.jobs: JobRunner | None = None
        """The window's, for what its status bar tells of."""
        self.job: Job[Any] | None = None

    def attach(self, jobs: JobRunner) -> None:
        """Work is done by the window's runner."""
        self.jobs = jobs
        jobs.cancelled.connect(self._end)
        jobs.failed.connect(self._end)

    @property
    def running(self) -> bool:
        return self.job is not None

    def stop(self) -> None:
        """What is done stays; the next run goes on from there."""
        if self.job is not None:
            self.job.cancel()
            self.state_changed.emit()

    def _begin(self, work: Callable[..., Any], take: Callable[[Any], object]) -> None:
        """Run it in the background; take: hears its result when it is no longer under way."""
        assert self.jobs is not None

        def end(result: Any) -> None:
            self._end(self.job)
            take(result)

        self.job = self.jobs.run(self.NAME, self.NAME, work, end)
        self.state_changed.emit()

    def _end(self, job: object) -> None:
        if job is self.job and isinstance(job, Job):
            self.job = None
            self.state_changed.emit()
            self._after_run()
            if job.state is State.CANCELLED:
                self.session.message.emit("info", f"The {self.NAME} was stopped; {self._how_on()}: {self.folder}")

    def _how_on(self) -> str:
        """What a person can do about a run that was stopped."""
        return "Go on continues it"

    def _after_run(self) -> None:
        """However it ended."""
