"""A render that ends at a time: each light group gets its share of it, and what there is then is kept."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from typing import TypeVar

from render.errors import Cancelled
from render.threads import Cancel

Item = TypeVar("Item")


class Limit:
    """So many seconds from now on; None: no end."""

    def __init__(self, seconds: float | None, cancelled: Cancel | None, keeps: Cancel | None) -> None:
        self.end = math.inf if seconds is None else time.monotonic() + seconds
        self._cancelled, self._keeps = cancelled, keeps
        self._begun = False

    def share(self, parts: int) -> Cancel | None:
        """Whether an equal share of what is left, for so many parts, is over."""
        if not math.isfinite(self.end):
            return None
        now = time.monotonic()
        end = now + max(self.end - now, 0.0) / max(parts, 1)
        return lambda: time.monotonic() >= end

    def over(self) -> bool:
        """The time is, once there was a first image; or a person asks to stop."""
        return self._asked() or (self._begun and time.monotonic() >= self.end)

    def keeps(self) -> bool:
        """Whether what is unfinished is wanted as well."""
        return not self._asked() or (self._keeps is not None and self._keeps())

    def until_over(self, items: Iterator[Item]) -> Iterator[Item]:
        """The items until the time is over, which is no cancellation. Raises Cancelled."""
        try:
            for item in items:
                self._begun = True
                yield item
        except Cancelled:
            if self._asked():
                raise

    def _asked(self) -> bool:
        return self._cancelled is not None and self._cancelled()
