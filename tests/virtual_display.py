"""A virtual display for the scripts that open windows, where there is no other."""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from studio.runtime.system import VIRTUAL_DISPLAY, message

SIZE = (1920, 1200)


@contextmanager
def display(size: tuple[int, int] = SIZE, anew: bool = False) -> Iterator[None]:
    """The one that is there, or a virtual one of this size, px, while the context lasts; anew: that in any case."""
    if os.environ.get("DISPLAY") and not anew:
        yield
        return
    if not shutil.which("Xvfb"):
        sys.exit(f"no display, and none can be made\n{message([VIRTUAL_DISPLAY])}")
    from pyvirtualdisplay import Display

    made = Display(visible=False, size=size, color_depth=24)
    made.start()
    try:
        yield
    finally:
        made.stop()
