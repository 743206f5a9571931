"""Results that are kept: made once, whoever asks, and forgotten when others came."""

from __future__ import annotations

import threading
import time

import pytest

from render.base.kept_result import kept


def test_two_threads_that_ask_at_once_have_it_made_once() -> None:
    made: list[int] = []

    @kept(most=2)
    def slow(number: int, *, threads: int | None = None) -> list[int]:
        time.sleep(0.05)
        made.append(number)
        return [number]

    found: list[list[int]] = []
    asking = [threading.Thread(target=lambda i=i: found.append(slow(7, threads=i))) for i in range(4)]
    for one in asking:
        one.start()
    for one in asking:
        one.join()
    assert made == [7] and all(one is found[0] for one in found)


def test_the_one_that_was_asked_for_longest_ago_goes() -> None:
    made: list[int] = []

    @kept(most=2)
    def result(number: int) -> int:
        made.append(number)
        return number

    for number in (1, 2, 1, 3, 1, 2):
        assert result(number) == number
    assert made == [1, 2, 3, 2]


def test_a_failure_is_not_kept() -> None:
    asked: list[int] = []

    @kept(most=1)
    def fails_once(number: int) -> int:
        asked.append(number)
        if len(asked) == 1:
            raise MemoryError
        return number

    with pytest.raises(MemoryError):
        fails_once(1)
    assert fails_once(1) == 1
