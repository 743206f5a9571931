"""Faults in overrides of Qt's methods reach the program's own handler: before Python 3.12 PySide may crash on them.

There an exception raised by C code, `int("x")` or the use of a deleted widget, is no object yet when it leaves the
override, and PySide reads it as one (6.8 to 6.12 do). Python makes it an object wherever it passes a handler.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import wraps
from types import FunctionType
from typing import Any

from PySide6.QtCore import QObject


def let_faults_out() -> None:
    """For every class of Qt's objects that is defined from now on."""
    if sys.version_info < (3, 12):
        QObject.__init_subclass__ = classmethod(_pass_on_faults)  # type: ignore[assignment]


def _pass_on_faults(cls: type[QObject]) -> None:
    known = [vars(base) for base in cls.__mro__ if base.__module__.startswith("PySide6.")]
    for name, value in list(vars(cls).items()):
        if isinstance(value, FunctionType) and not name.startswith("__") and any(name in names for names in known):
            setattr(cls, name, _through_a_handler(value))


def _through_a_handler(override: Callable[..., Any]) -> Callable[..., Any]:
    @wraps(override)
    def call(*given: Any, **named: Any) -> Any:
        try:
            return override(*given, **named)
        except Exception:
            raise

    return call
