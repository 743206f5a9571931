"""Threads that wait for work: a new one takes ten times as long to start as one that is there to begin."""

from __future__ import annotations

import os
import queue
import threading
from collections.abc import Callable

Task = Callable[[], None]
KEPT = 8
"""Idle threads, at most; others end with their task."""

_idle: list[_Helper] = []
_lock = threading.Lock()


class _Helper:
    """A thread that does one task after the other."""

    def __init__(self) -> None:
        self.tasks: queue.SimpleQueue[tuple[Task, threading.Lock]] = queue.SimpleQueue()
        # an idle one is nothing that the end of the program has to wait for
        threading.Thread(target=self._work, name="chunks", daemon=True).start()

    def _work(self) -> None:
        kept = True
        while kept:
            task, ended = self.tasks.get()
            task()
            del task  # and all that it holds
            with _lock:
                kept = len(_idle) < KEPT
                if kept:
                    # before anybody is told: who asks next is to find it
                    _idle.append(self)
            ended.release()


def beside(task: Task) -> threading.Lock:
    """Do a task, which raises nothing, on another thread at once; the lock is free when it has ended."""
    ended = threading.Lock()
    ended.acquire()
    with _lock:
        helper = _idle.pop() if _idle else None
    (helper or _Helper()).tasks.put((task, ended))
    return ended


def _forget() -> None:
    """In a process that was forked, in which these threads are not."""
    global _lock
    _lock = threading.Lock()
    _idle.clear()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget)
