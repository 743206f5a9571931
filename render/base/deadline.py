"""The time limit of a render, shared among its parts; pauses do not count."""

from __future__ import annotations

import math
import threading
import time

from render.base.threads import Cancel

SHORTEST_PAUSE = 0.1
"""Least duration, s, of a call of `cancelled` that counts as a pause."""


class Deadline:
    """A deadline so many seconds from now; None: never."""

    def __init__(self, seconds: float | None = None) -> None:
        self.end = math.inf if seconds is None else time.monotonic() + seconds
        self._lock = threading.Lock()

    def share(self, parts: int) -> Cancel:
        """A function that says whether an equal share of the time left, one of `parts`, is over, counted from now."""
        left = max(self.end - time.monotonic(), 0.0)
        for_others = left - left / max(parts, 1) if math.isfinite(self.end) else 0.0
        return lambda: time.monotonic() >= self.end - for_others

    def pausing(self, cancelled: Cancel) -> Cancel:
        """`cancelled`, with the deadline put off by the time for which it holds the render in a pause."""

        def ask() -> bool:
            end, start = self.end, time.monotonic()
            stop = cancelled()
            held = time.monotonic() - start
            if held > SHORTEST_PAUSE:
                with self._lock:
                    # threads that are held together put it off once, not once each
                    self.end = max(self.end, end + held)
            return stop

        return ask
