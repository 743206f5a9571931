"""The runner: lanes, the newest request, signals on the window's thread, and a clean end."""

from __future__ import annotations

import threading
import time

import pytest
from PySide6.QtCore import QThread

from render.base.errors import Cancelled, InputError
from studio.qt.core.jobs import JobRunner


@pytest.fixture
def runner(qtbot):
    made = JobRunner()
    yield made
    made.close()


def wait_for(event: threading.Event):
    def work(progress, cancelled):
        while not event.wait(0.005):
            if cancelled():
                raise Cancelled
        return "done"

    return work


def test_results_arrive_on_the_windows_thread(qtbot, runner):
    threads = []
    with qtbot.waitSignal(runner.finished) as ended:
        runner.run(
            "a",
            "add",
            lambda progress, cancelled: threads.append(threading.current_thread()),
            lambda result: threads.append(QThread.currentThread()),
        )
    assert ended.args[0].name == "add"
    assert threads[0] is not threading.main_thread() and threads[1] is runner.thread()
    assert not runner.busy


def test_the_newest_waiting_request_wins(qtbot, runner):
    first, results = threading.Event(), []
    runner.run("a", "first", wait_for(first), lambda result: results.append("first"))
    for i in range(20):
        runner.run("a", f"{i}", lambda progress, cancelled, i=i: i, results.append)
    first.set()
    qtbot.waitUntil(lambda: not runner.busy)
    assert results == ["first", 19]


def test_requests_in_turn_are_all_done_in_order(qtbot, runner):
    first, results = threading.Event(), []
    runner.run("a", "first", wait_for(first), lambda result: results.append("first"))
    for i in range(5):
        runner.run("a", f"{i}", lambda progress, cancelled, i=i: i, results.append, in_turn=True)
    assert [job.name for job in runner.jobs("a")] == ["first", "0", "1", "2", "3", "4"]
    first.set()
    qtbot.waitUntil(lambda: not runner.busy)
    assert results == ["first", 0, 1, 2, 3, 4]


def test_what_waits_in_turn_goes_on_where_an_end_starts_another(qtbot, runner):
    first, results = threading.Event(), []

    def again(result):
        results.append("first")
        runner.run("a", "more", lambda progress, cancelled: "more", results.append, in_turn=True)

    runner.run("a", "first", wait_for(first), again)
    for i in range(3):
        runner.run("a", f"{i}", lambda progress, cancelled, i=i: i, results.append, in_turn=True)
    first.set()
    qtbot.waitUntil(lambda: not runner.busy)
    assert sorted(map(str, results)) == ["0", "1", "2", "first", "more"]


def test_cancelling_a_lane_forgets_all_that_waits(qtbot, runner):
    results = []
    runner.run("a", "first", lambda progress, cancelled: wait_for(threading.Event())(progress, cancelled))
    for i in range(3):
        runner.run("a", f"{i}", lambda progress, cancelled, i=i: i, results.append, in_turn=True)
    runner.cancel("a")
    qtbot.waitUntil(lambda: not runner.busy)
    assert results == [] and runner.jobs("a") == []


def test_lanes_do_not_wait_for_each_other(qtbot, runner):
    held, results = threading.Event(), []
    runner.run("render", "long", wait_for(held))
    runner.run("develop", "short", lambda progress, cancelled: 1, results.append)
    qtbot.waitUntil(lambda: results == [1])
    assert runner.job("render") is not None and runner.job("develop") is None
    held.set()
    qtbot.waitUntil(lambda: not runner.busy)


def test_interrupting_cancels_what_runs(qtbot, runner):
    never, results = threading.Event(), []
    runner.run("a", "old", wait_for(never), lambda result: results.append("old"))
    with qtbot.waitSignal(runner.cancelled) as told:
        runner.run("a", "new", lambda progress, cancelled: "new", results.append, interrupt=True)
    assert told.args[0].name == "old"
    qtbot.waitUntil(lambda: results == ["new"])


def test_failures_are_told_with_their_reason(qtbot, runner):
    def work(progress, cancelled):
        raise InputError("no such mesh", where="a.stl")

    with qtbot.waitSignal(runner.failed) as told:
        runner.run("a", "load", work)
    assert told.args[0].problem.text == "a.stl: no such mesh"


def test_progress_is_told_at_most_ten_times_a_second(qtbot, runner):
    end, told, began = threading.Event(), [], time.monotonic()

    def work(progress, cancelled):
        count = 0
        while not end.is_set():
            count += 1
            progress("counting", (count % 100) / 100)
            if count % 1000 == 0:
                end.wait(0.001)

    runner.progress.connect(lambda job: told.append(job.stage))
    runner.run("a", "count", work)
    qtbot.waitUntil(lambda: told.count("counting") >= 3)
    end.set()
    qtbot.waitUntil(lambda: not runner.busy)
    # before its thread has begun a job is in no stage
    assert len(told) <= 1 + 10 * (time.monotonic() - began) and set(told) <= {"", "counting"}


def test_where_progress_is_drawn_slowly_it_is_told_less_often(qtbot, runner):
    """Drawing the bar took as much of the processor as the render beside it."""
    held, told = threading.Event(), []
    runner.progress.connect(lambda job: (told.append(job), time.sleep(0.04)))
    runner.run("render", "long", wait_for(held))
    qtbot.waitUntil(lambda: len(told) >= 4, timeout=20000)
    held.set()
    qtbot.waitUntil(lambda: not runner.busy)
    assert 400 <= runner._timer.interval() <= 1000, "ten times what it takes, but it does not stand still"
    for drawn, interval in ((0.001, 100), (0.03, 300), (5.0, 1000)):
        runner._space(drawn)
        assert runner._timer.interval() == interval


def test_closing_stops_and_joins_everything(qtbot, runner):
    never, results = threading.Event(), []
    runner.run("a", "long", wait_for(never), results.append)
    runner.run("a", "waiting", lambda progress, cancelled: 1, results.append)
    runner.close()
    assert not [thread for thread in threading.enumerate() if thread.name.startswith("job ")]
    runner.run("a", "late", lambda progress, cancelled: 1, results.append)
    qtbot.wait(20)
    assert results == []
