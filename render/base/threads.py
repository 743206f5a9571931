"""Work in chunks on threads. Results never depend on the number of threads: a chunk writes its own slice."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable

from render.base.errors import Cancelled
from render.base.helper_threads import beside

Cancel = Callable[[], bool]
Progress = Callable[[float], None]


_most: int | None = None


def use_at_most(threads: int | None) -> None:
    """Of work that asks for no number of threads, from now on; None: as many as there are processors."""
    global _most
    _most = threads


def thread_count(threads: int | None) -> int:
    """The requested number, or the number of processors that this process may use, `use_at_most` at most."""
    if threads is not None:
        return max(1, threads)
    there = _processors()
    return there if _most is None else max(1, min(_most, there))


def _processors() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def rows_of(width: int, least: int, pixels: int = 1 << 15) -> int:
    """Rows of an image to take at a time: about so many pixels, so that narrow images are not taken in many calls; an
    even number, at least `least`."""
    return max(least, pixels // width // 2 * 2)


def map_chunks(
    work: Callable[[int, int], None],
    count: int,
    chunk: int,
    threads: int | None = None,
    cancelled: Cancel | None = None,
    progress: Progress | None = None,
) -> None:
    """Call work(start, stop) over range(count) in chunks. Raises Cancelled between chunks; progress gets 0..1.

    The calling thread works as well, and alone reports progress.
    """
    starts = range(0, count, chunk)
    lock, left = threading.Lock(), iter(starts)
    done = 0
    failed: list[BaseException] = []

    def run_chunks(report: Progress | None) -> None:
        nonlocal done
        while True:
            with lock:
                start = None if failed else next(left, None)
            if start is None:
                return
            if cancelled is not None and cancelled():
                raise Cancelled
            work(start, min(start + chunk, count))
            with lock:
                done += 1
            if report is not None:
                report(done / len(starts))

    def helper() -> None:
        try:
            run_chunks(None)
        except BaseException as error:
            failed.append(error)

    helpers = [beside(helper) for _ in range(min(thread_count(threads), len(starts)) - 1)]
    try:
        run_chunks(progress)
    except BaseException as error:
        failed.append(error)
    for ended in helpers:
        while True:
            try:
                ended.acquire()
                break
            except BaseException as error:  # Ctrl-C, which the helpers hear of at their next chunk
                failed.append(error)
    if failed:
        raise failed[0]
    if helpers and progress is not None:
        progress(1.0)
