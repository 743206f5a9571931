"""Ctrl-C while a frame is rendered: the first asks to stop where what is done can be kept, the second stops at once."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from render.base.threads import Cancel


@contextmanager
def stop_on_interrupt(cancelled: Cancel) -> Iterator[Cancel]:
    """Yield a function that says whether a person, or `cancelled`, asks to stop."""
    here = threading.current_thread() is threading.main_thread()
    if not here or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield cancelled
        return
    asked = threading.Event()

    def ask(number: int, frame: Any) -> None:
        if asked.is_set():
            signal.default_int_handler(number, frame)
        asked.set()

    signal.signal(signal.SIGINT, ask)
    try:
        yield lambda: asked.is_set() or cancelled()
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)
