"""Work in chunks on a thread pool. Results never depend on the number of threads: a chunk writes its own slice."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, as_completed

from render.errors import Cancelled

Cancel = Callable[[], bool]
Progress = Callable[[float], None]


def thread_count(threads: int | None) -> int:
    """The number asked for, or the number of processors this process may use."""
    if threads is not None:
        return max(1, threads)
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def map_chunks(
    work: Callable[[int, int], None],
    count: int,
    chunk: int,
    threads: int | None = None,
    cancelled: Cancel | None = None,
    progress: Progress | None = None,
) -> None:
    """Call work(start, stop) over range(count) in chunks. Raises Cancelled between chunks; progress gets 0..1."""
    starts = range(0, count, chunk)
    workers = min(thread_count(threads), len(starts))

    def one(start: int) -> None:
        if cancelled is not None and cancelled():
            raise Cancelled
        work(start, min(start + chunk, count))

    if workers <= 1:
        for done, start in enumerate(starts, 1):
            one(start)
            if progress is not None:
                progress(done / len(starts))
        return
    with ThreadPoolExecutor(workers) as pool:
        futures = [pool.submit(one, start) for start in starts]
        try:
            for done, future in enumerate(as_completed(futures), 1):
                future.result()
                if progress is not None:
                    progress(done / len(starts))
        except BaseException:
            pool.shutdown(wait=True, cancel_futures=True)
            raise
