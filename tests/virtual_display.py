"""A virtual display for the scripts that open windows, where there is no other."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager

SIZE = (1920, 1200)


@contextmanager
def display() -> Iterator[None]:
    """The one that is there, or a virtual one while the context lasts."""
    if os.environ.get("DISPLAY"):
        yield
        return
    with screen(SIZE):
        yield


@contextmanager
def screen(size: tuple[int, int]) -> Iterator[None]:
    """A virtual one of that size, px, even where there is another."""
    from pyvirtualdisplay import Display

    made = Display(visible=False, size=size, color_depth=24)
    made.start()
    try:
        yield
    finally:
        made.stop()
