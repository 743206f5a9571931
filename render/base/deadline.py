"""A render that ends at a time: each light group gets its share of it, and what there is then is kept."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Iterator
from typing import TypeVar

from render.base.errors import Cancelled
from render.base.threads import Cancel

Item = TypeVar("Item")
SHORTEST_PAUSE = 0.1
"""s; a question that takes longer to answer is a pause."""


class Limit:
    """So many seconds from now on; None: no end."""

    def __init__(self, seconds: float | None, cancelled: Cancel | None, keeps: Cancel | None) -> None:
        self.end = math.inf if seconds is None else time.monotonic() + seconds
        self._cancelled, self._keeps = cancelled, keeps
        self._begun = False
        self._lock = threading.Lock()

    def share(self, parts: int) -> Cancel | None:
        """Whether an equal share of what is left, for so many parts, is over."""
        if not math.isfinite(self.end):
            return None
        left = max(self.end - time.monotonic(), 0.0)
        for_others = left - left / max(parts, 1)
        return lambda: time.monotonic() >= self.end - for_others

    def over(self) -> bool:
        """The time is, once there was a first image; or a person asks to stop."""
        return self.asked() or (self._begun and time.monotonic() >= self.end)

    def keeps(self) -> bool:
        """Whether what is unfinished is wanted as well."""
        return not self.asked() or (self._keeps is not None and self._keeps())

    def until_over(self, items: Iterator[Item]) -> Iterator[Item]:
        """The items until the time is over, which is no cancellation. Raises Cancelled."""
        try:
            for item in items:
                self._begun = True
                yield item
        except Cancelled:
            if self.asked():
                raise

    def asked(self) -> bool:
        """A person asks to stop; while they hold the render, which is here, its time stands still."""
        if self._cancelled is None:
            return False
        end, start = self.end, time.monotonic()
        stop = self._cancelled()
        held = time.monotonic() - start
        if held > SHORTEST_PAUSE:
            with self._lock:
                # several threads are held at once, for the same time
                self.end = max(self.end, end + held)
        return stop
