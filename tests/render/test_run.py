"""How a render's work is done: its time, its pauses, its parts, and who may stop it."""

from __future__ import annotations

from dataclasses import replace

import pytest

from render.base import deadline
from render.base.deadline import Deadline
from render.base.errors import Cancelled
from render.run import Run


@pytest.fixture
def now(monkeypatch):
    """A clock that stands until it is set."""
    time = [100.0]
    monkeypatch.setattr(deadline.time, "monotonic", lambda: time[0])
    return time


def test_without_a_deadline_no_time_is_ever_over(now):
    over = Run().time_is_over()
    now[0] = 1e12
    assert not over()


def test_parts_that_are_left_have_equal_shares_and_inherit_what_is_not_used(now):
    run = Run(deadline=Deadline(12.0), later=1)
    first = run.time_is_over(2)  # two lasers, and the ambient light after them
    now[0] = 103.9
    assert not first()
    now[0] = 104.0
    assert first()
    now[0] = 102.0  # the first was done early: five seconds each for the others
    second = run.time_is_over(1)
    now[0] = 106.9
    assert not second()
    now[0] = 107.0
    assert second()


def test_the_time_stands_still_while_a_person_holds_the_render(now):
    end = Deadline(10.0)

    def held():
        now[0] += 60.0
        return False

    over, ask = end.share(1), end.pausing(held)
    assert not ask() and not over() and end.end == pytest.approx(170.0)


def test_progress_of_a_part_of_a_part_lies_within_it():
    told = []
    Run(progress=told.append).between(0.5, 1.0).between(0.0, 0.5).progress(0.5)
    assert told == [0.625]


def test_another_seed_is_one_that_kernels_can_take():
    assert Run(seed=5).shifted(2).seed == 7
    assert Run(seed=2**63 - 1).shifted(1).seed == 0


def images(wanted):
    """Images that notice a cancellation between each two, and give an unfinished one where it is wanted."""

    def make(run):
        for number in range(5):
            try:
                run.stop()
            except Cancelled:
                if run.keep_partial():
                    yield "unfinished"
                raise
            yield number
            wanted()

    return make


def test_the_end_of_the_time_ends_the_images_with_what_there_is_but_not_before_the_first(now):
    run = Run(deadline=Deadline(1.0))
    now[0] = 200.0  # over before it began
    assert list(run.until_over(images(lambda: None))) == [0, "unfinished"]


@pytest.mark.parametrize("keep", [True, False])
def test_a_person_who_cancels_is_told_so_and_gets_what_they_want(now, keep):
    asked, found = [False], []
    run = Run(deadline=Deadline(1e6), cancelled=lambda: asked[0], keep_partial=lambda: keep)
    with pytest.raises(Cancelled):
        for image in run.until_over(images(lambda: asked.__setitem__(0, len(found) == 2))):
            found.append(image)
    assert found == [0, 1, "unfinished"][: 3 if keep else 2]


def test_what_is_kept_is_restored_under_the_name_of_its_part():
    class Memory(dict):
        def keep(self, part, sums):
            self[part] = sums

        def restore(self, part, load):
            return load(self[part]) if part in self else None

    memory = Memory()
    run = Run(checkpoint=memory, part="laser 1")
    run.keep({"n": 3})
    assert run.restore(dict) == {"n": 3} and memory == {"laser 1": {"n": 3}}
    assert replace(run, part="ambient").restore(dict) is None and Run().restore(dict) is None
