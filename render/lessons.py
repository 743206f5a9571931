"""What the first frame of a block of a scan leaves to the others, which are much like it.

It decides only where frames look and how often, or is checked in each of them, so that every frame stays an unbiased
estimate of itself. A block has one teacher, whichever frames were rendered before: what a frame is taught does not
depend on threads, on how many frames are rendered at once, or on where a scan was interrupted.
"""

from __future__ import annotations

from typing import Any


class Lessons:
    """Parts by name, which one frame teaches and, once it is done, others are taught."""

    def __init__(self) -> None:
        self._parts: dict[str, Any] = {}
        self._given = False

    @property
    def given(self) -> bool:
        """The teacher is done: nothing changes any more."""
        return self._given

    def teach(self, part: str, value: object) -> None:
        """Leave a value, which nobody changes from now on; after the teacher is done nothing is left any more."""
        if not self._given:
            self._parts[part] = value

    def taught(self, part: str) -> Any:
        """The value of a part; None: there is none, or the teacher is not done."""
        return self._parts.get(part) if self._given else None

    def give(self) -> None:
        """The teacher is done."""
        self._given = True
