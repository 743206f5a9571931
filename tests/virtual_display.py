"""A virtual display for the scripts that open windows, where there is no other."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager

SIZE = (1920, 1200)


@contextmanager
def display(size: tuple[int, int] = SIZE, anew: bool = False) -> Iterator[None]:
    """The one that is there, or a virtual one of this size, px, while the context lasts; anew: that in any case."""
    if os.environ.get("DISPLAY") and not anew:
        yield
        return
    from pyvirtualdisplay import Display

    made = Display(visible=False, size=size, color_depth=24)
    made.start()
    try:
        yield
    finally:
        made.stop()
