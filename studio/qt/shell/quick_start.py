"""What makes the start quick: imports as Python makes them, and no search for garbage where nothing is thrown away."""

from __future__ import annotations

import builtins
import gc
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from types import ModuleType

PYPLOT = "matplotlib.pyplot"


def plain_imports() -> None:
    """Once PySide6 is there: it reads the source of every module that is imported later, to see whether that uses one
    of its optional naming styles. Nobody does here, and it takes a third of a second.
    """
    builtins.__import__ = getattr(builtins, "__orig_import__", builtins.__import__)


def pyplot_when_asked_for() -> None:
    """PyVista imports `matplotlib.pyplot`, a tenth of the start, for a cycle of colours that nobody here draws with."""
    if PYPLOT not in sys.modules:
        sys.modules[PYPLOT] = _Later(PYPLOT)


class _Later(ModuleType):
    """Imported when something of it is asked for. `importlib.util.LazyLoader` would be by a second import already."""

    def __getattr__(self, name: str) -> object:
        if name.startswith("__"):
            raise AttributeError(name)
        if sys.modules.get(self.__name__) is self:  # else another thread imports it, and this one waits for that
            del sys.modules[self.__name__]
        self.__dict__.update(import_module(self.__name__).__dict__)
        return self.__dict__[name]


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
