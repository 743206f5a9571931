"""A render that ends at a time, of which each of its parts gets a share. A pause is not counted."""

from __future__ import annotations

import math
import threading
import time

from render.base.threads import Cancel

SHORTEST_PAUSE = 0.1
"""s; a question that takes longer to answer is a pause."""


class Deadline:
    """So many seconds from now on; None: no end."""

    def __init__(self, seconds: float | None = None) -> None:
        self.end = math.inf if seconds is None else time.monotonic() + seconds
        self._lock = threading.Lock()

    def share(self, parts: int) -> Cancel:
        """What says, from now on, whether an equal share of what is left, for so many parts, is over."""
        left = max(self.end - time.monotonic(), 0.0)
        for_others = left - left / max(parts, 1) if math.isfinite(self.end) else 0.0
        return lambda: time.monotonic() >= self.end - for_others

    def pausing(self, cancelled: Cancel) -> Cancel:
        """The same question; while whoever answers it holds the render, the time stands still."""

        def ask() -> bool:
            end, start = self.end, time.monotonic()
            stop = cancelled()
            held = time.monotonic() - start
            if held > SHORTEST_PAUSE:
                with self._lock:
                    # several threads are held at once, for the same time
                    self.end = max(self.end, end + held)
            return stop

        return ask
