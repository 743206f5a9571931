"""What makes the start quick: imports as Python makes them, and no search for garbage where nothing is thrown away."""

from __future__ import annotations

import builtins
import gc
from collections.abc import Iterator
from contextlib import contextmanager


def plain_imports() -> None:
    """Once PySide6 is there: it reads the source of every module that is imported later, to see whether that uses one
    of its optional naming styles. Nobody does here, and it takes a third of a second.
    """
    builtins.__import__ = getattr(builtins, "__orig_import__", builtins.__import__)


@contextmanager
def no_collection() -> Iterator[None]:
    """Modules and panels that are made meanwhile stay: looking through them for garbage again and again is in vain."""
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()
