"""Results that are kept for whoever asks the same next: a second thread that asks meanwhile waits for the first."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable
from functools import wraps
from typing import Any, ParamSpec, TypeVar

Asked = ParamSpec("Asked")
Result = TypeVar("Result")


def kept(most: int) -> Callable[[Callable[Asked, Result]], Callable[Asked, Result]]:
    """Decorates a function whose arguments by position, all hashable, decide its result; those by keyword do not.

    most: results that are kept. What a function raises is not kept.
    """

    def decorate(function: Callable[Asked, Result]) -> Callable[Asked, Result]:
        lock, known = threading.Lock(), OrderedDict[tuple[Hashable, ...], Any]()

        @wraps(function)
        def ask(*args: Asked.args, **kwargs: Asked.kwargs) -> Result:
            with lock:
                if args not in known:
                    known[args] = function(*args, **kwargs)
                    if len(known) > most:
                        known.popitem(last=False)
                known.move_to_end(args)
                found: Result = known[args]
                return found

        return ask

    return decorate
