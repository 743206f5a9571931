"""Threads that wait for work: there at once, as many as are asked for, and without what their last task held."""

from __future__ import annotations

import gc
import os
import threading
import weakref
from functools import partial

import numpy as np
import pytest

from render.base import helper_threads
from render.base.errors import Cancelled
from render.base.helper_threads import KEPT, beside
from render.base.threads import map_chunks


def test_a_task_is_done_by_a_thread_that_is_there() -> None:
    names: list[int] = []
    for _ in range(20):
        beside(lambda: names.append(threading.get_ident())).acquire()
    assert len(names) == 20 and len(set(names)) == 1


def test_as_many_tasks_as_are_asked_for_go_at_once_and_few_threads_stay() -> None:
    """None waits for another to end, or work that calls for help within its own chunks would wait for itself."""
    together = threading.Barrier(3 * KEPT, timeout=20.0)
    for ended in [beside(lambda: together.wait() and None) for _ in range(3 * KEPT)]:
        ended.acquire()
    assert len(helper_threads._idle) <= KEPT


def test_chunks_within_chunks_are_all_done_once() -> None:
    done = np.zeros((20, 30), np.int64)

    def add(row: np.ndarray, start: int, stop: int) -> None:
        row[start:stop] += 1

    map_chunks(lambda start, stop: map_chunks(partial(add, done[start]), 30, 4, 4), 20, 1, 4)
    assert np.all(done == 1)


def test_nothing_of_a_task_is_held_after_it() -> None:
    class Large:
        pass

    held = Large()
    seen = weakref.ref(held)

    def work(start: int, stop: int, held: Large = held) -> None:
        pass

    map_chunks(work, 8, 1, 4)
    del held, work
    gc.collect()
    assert seen() is None


@pytest.mark.parametrize("error", [ValueError, Cancelled, KeyboardInterrupt])
def test_an_error_of_a_chunk_is_raised_once_all_chunks_under_way_have_ended(error: type[BaseException]) -> None:
    ended: list[int] = []

    def work(start: int, stop: int) -> None:
        if start == 3:
            raise error
        ended.append(start)

    with pytest.raises(error):
        map_chunks(work, 1000, 1, 4)
    before = len(ended)
    map_chunks(lambda a, b: None, 8, 1, 4)
    assert len(ended) == before < 1000


@pytest.mark.skipif(not hasattr(os, "fork"), reason="nothing is forked here")
@pytest.mark.filterwarnings("ignore:This process .* is multi-threaded:DeprecationWarning")
def test_a_forked_process_has_helpers_of_its_own() -> None:
    map_chunks(lambda a, b: None, 8, 1, 4)
    child = os.fork()
    if child == 0:
        total: list[int] = []
        map_chunks(lambda a, b: total.append(a), 8, 1, 4)
        os._exit(0 if sorted(total) == list(range(8)) else 1)
    assert os.waitpid(child, 0)[1] == 0
