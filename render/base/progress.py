"""Wall time by stage of a render, and its progress: of the whole, or of each stage."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field

StageProgress = Callable[[str, float], None]
"""Called as progress(name of the stage, fraction done 0..1)."""


@dataclass
class Clock:
    """Times stages, and reports each one's own progress."""

    progress: StageProgress | None
    seconds: dict[str, float] = field(default_factory=dict)
    running: tuple[str, float] | None = None

    def so_far(self) -> dict[str, float]:
        """Seconds by stage, with those of the one under way."""
        seconds = dict(self.seconds)
        if self.running is not None:
            name, start = self.running
            seconds[name] = seconds.get(name, 0.0) + time.perf_counter() - start
        return seconds

    @contextmanager
    def shown(self) -> Iterator[None]:
        """Exclude the time in which a frame is shown from the running stage."""
        start = time.perf_counter()
        yield
        if self.running is not None:
            name, began = self.running
            self.running = name, began + time.perf_counter() - start

    @contextmanager
    def stage(self, name: str, work: float) -> Iterator[Callable[[float], None]]:
        """Time a stage; yields the function that takes its own progress, 0..1. work: estimated rays."""
        self.running = name, time.perf_counter()

        def report(done: float) -> None:
            if self.progress is not None:
                self.progress(name, done)

        report(0.0)
        # 1.0 is reported only after the last frame has been passed on
        yield lambda done: report(min(done, 0.999))
        self.seconds, self.running = self.so_far(), None
        report(1.0)


@dataclass
class WholeClock:
    """Times stages, and reports the fraction of the whole work that is done."""

    total: float
    """Sum of the work of all stages."""
    progress: StageProgress | None
    finished: float = 0.0
    clock: Clock = field(default_factory=lambda: Clock(None))

    def so_far(self) -> dict[str, float]:
        """Seconds by stage, with those of the one under way."""
        return self.clock.so_far()

    def shown(self) -> AbstractContextManager[None]:
        """As `Clock.shown`."""
        return self.clock.shown()

    @contextmanager
    def stage(self, name: str, work: float) -> Iterator[Callable[[float], None]]:
        """As `Clock.stage`."""

        def report(done: float) -> None:
            if self.progress is not None:
                self.progress(name, min(1.0, (self.finished + done * work) / self.total))

        report(0.0)
        with self.clock.stage(name, work):
            yield report
        self.finished += work
