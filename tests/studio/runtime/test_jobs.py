"""Jobs: states, progress, pause, cancel, and what a failure tells a person."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from render.base.errors import Cancelled, InputError
from render.base.threads import Cancel, map_chunks
from render.run import Run
from studio.project.project import Project
from studio.runtime import jobs
from studio.runtime.jobs import Job, Progress, State


def until(condition: Callable[[], bool], seconds: float = 180.0) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        threading.Event().wait(0.001)


def until_it_stands(value: Callable[[], object]) -> None:
    """Until a value stays as it is: what was under way has ended."""

    def stands() -> bool:
        before = value()
        threading.Event().wait(0.05)
        return value() == before

    until(stands)


def spin(progress: Progress, cancelled: Cancel) -> int:
    """Counts until it is told to stop."""
    count = 0
    while not cancelled():
        count += 1
        progress("counting", 0.5)
    raise Cancelled


def started(work: Callable[[Progress, Cancel], object]) -> Job[object]:
    job = Job("count", work)
    job.start()
    until(lambda: job.state is State.RUNNING)
    return job


def test_a_job_is_queued_then_done_with_its_result() -> None:
    ended: list[State] = []
    job = Job("add", lambda progress, cancelled: 1 + 1, on_end=lambda job: ended.append(job.state))
    assert job.state is State.QUEUED and not job.ended
    job.start()
    assert job.join(180)
    assert (job.state, job.result, job.done, ended) == (State.DONE, 2, 1.0, [State.DONE])


def test_a_job_starts_only_once() -> None:
    job = Job("add", lambda progress, cancelled: 2)
    job.start()
    job.join()
    with pytest.raises(RuntimeError):
        job.start()


def test_cancel_stops_running_work() -> None:
    job = started(spin)
    job.cancel()
    assert job.join(180)
    assert job.state is State.CANCELLED and job.problem is None


def test_a_job_cancelled_before_its_start_never_works() -> None:
    worked = []
    job = Job("never", lambda progress, cancelled: worked.append(1))
    job.cancel()
    job.start()
    job.join()
    assert job.state is State.CANCELLED and worked == []


def test_a_paused_job_stands_still_and_its_clock_too() -> None:
    count = [0]

    def work(progress: Progress, cancelled: Cancel) -> None:
        while not cancelled():
            count[0] += 1
        raise Cancelled

    job = started(work)
    until(lambda: count[0] > 100)
    job.pause()
    assert job.state is State.PAUSED
    until_it_stands(lambda: (count[0], job.seconds))
    stood = count[0]
    job.resume()
    until(lambda: count[0] > stood)
    assert job.state is State.RUNNING
    job.cancel()
    assert job.join(180)


def test_a_paused_job_can_be_cancelled() -> None:
    job = started(spin)
    job.pause()
    job.cancel()
    assert job.join(180) and job.state is State.CANCELLED


def test_pause_holds_a_pool_of_threads_as_well() -> None:
    calls = []

    def work(progress: Progress, cancelled: Cancel) -> None:
        def chunk(start: int, stop: int) -> None:
            calls.append(start)
            time.sleep(0.01)

        map_chunks(chunk, 10_000_000, 1000, 2, cancelled)

    job = started(work)
    until(lambda: len(calls) > 10)
    job.pause()
    until_it_stands(lambda: len(calls))
    assert len(calls) < 10_000
    job.cancel()
    assert job.join(180) and job.state is State.CANCELLED


def test_time_left_follows_the_progress_and_never_grows_between_two_reports(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = [0.0]
    monkeypatch.setattr(jobs, "time", SimpleNamespace(perf_counter=lambda: clock[0]))
    begun, go, told, end = (threading.Event() for _ in range(4))

    def work(progress: Progress, cancelled: Cancel) -> None:
        progress("first steps", 0.02)
        begun.set()
        go.wait(180)
        progress("first quarter", 0.25)
        told.set()
        end.wait(180)

    job = started(work)
    assert begun.wait(180)
    clock[0] = 2.0  # a fiftieth says little of the rest
    assert job.seconds_left is None
    go.set()
    assert told.wait(180) and job.seconds_left == pytest.approx(6.0)
    clock[0] = 7.0
    assert job.seconds_left == pytest.approx(1.0)
    clock[0] = 9.0  # longer than was thought: nobody knows
    assert job.seconds_left is None
    end.set()
    job.join()
    assert job.seconds_left is None


def test_what_an_earlier_run_had_done_is_no_part_of_the_pace(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = [0.0]
    monkeypatch.setattr(jobs, "time", SimpleNamespace(perf_counter=lambda: clock[0]))
    told, end = threading.Event(), threading.Event()

    def work(progress: Progress, cancelled: Cancel) -> None:
        progress("60 of 100 cells", 0.6)
        clock[0] = 30.0
        progress("70 of 100 cells", 0.7)
        told.set()
        end.wait(180)

    job = Job("study", work)
    job.there, job.start_up = 0.6, 10.0
    job.start()
    assert told.wait(180) and job.seconds_left == pytest.approx(60.0)
    end.set()
    job.join()


def test_a_long_start_is_not_taken_for_the_pace_of_the_rest(monkeypatch: pytest.MonkeyPatch) -> None:
    """Workers of a study that start for a minute made 18 cells of ten seconds a matter of twenty minutes."""
    clock = [0.0]
    monkeypatch.setattr(jobs, "time", SimpleNamespace(perf_counter=lambda: clock[0]))
    go, told, end = (threading.Event() for _ in range(3))

    def work(progress: Progress, cancelled: Cancel) -> None:
        clock[0] = 70.0
        progress("1 of 18 cells", 1 / 18)
        told.set()
        go.wait(180)
        clock[0] = 90.0
        progress("3 of 18 cells", 3 / 18)
        told.set()
        end.wait(180)

    job = started(work)
    assert told.wait(180) and job.seconds_left is None
    told.clear()
    go.set()
    assert told.wait(180) and job.seconds_left == pytest.approx(150.0)
    end.set()
    job.join()


def test_what_an_earlier_run_has_done_is_no_measure_of_the_rest(monkeypatch: pytest.MonkeyPatch) -> None:
    """Half of a scan's frames were there and found in a second: the other half, of 10 s each, was foretold as one."""
    clock = [0.0]
    monkeypatch.setattr(jobs, "time", SimpleNamespace(perf_counter=lambda: clock[0]))
    reports, told = [threading.Event() for _ in range(4)], threading.Semaphore(0)

    def work(progress: Progress, cancelled: Cancel) -> None:
        for report, (seconds, done) in zip(reports, [(0.5, 0.25), (1.0, 0.5), (11.0, 0.6), (21.0, 0.7)], strict=True):
            report.wait(180)
            clock[0] = seconds
            progress("frames", done)
            told.release()

    job = Job("scan", work)
    job.there = 0.5
    job.start()
    left = []
    for report in reports[:3]:
        report.set()
        assert told.acquire(timeout=180)
        left.append(job.seconds_left)
    assert left == [None, None, pytest.approx(40.0)]
    reports[3].set()
    job.join()


def test_bad_input_is_told_in_its_own_words() -> None:
    def work(progress: Progress, cancelled: Cancel) -> None:
        raise InputError("the mesh is missing", where="part.stl", cure="choose the file again")

    job = Job("render", work)
    job.start()
    job.join()
    assert job.state is State.FAILED and job.problem is not None
    assert job.problem.text == "part.stl: the mesh is missing; choose the file again"
    assert job.problem.details == ""


def test_too_little_memory_is_told_with_its_cure() -> None:
    job = Job("render", lambda progress, cancelled: np.empty(1 << 60, np.uint8))
    job.start()
    job.join()
    assert job.state is State.FAILED and job.problem is not None
    assert "memory" in job.problem.text and "smaller image" in job.problem.text
    assert "Traceback" not in job.problem.text and "Traceback" in job.problem.details


def test_an_internal_error_keeps_its_traceback_for_the_log() -> None:
    def work(progress: Progress, cancelled: Cancel) -> None:
        raise KeyError("lamp")

    job = Job("render", work)
    job.start()
    job.join()
    assert job.problem is not None
    assert "internal error" in job.problem.text and "KeyError" in job.problem.text
    assert "Traceback" not in job.problem.text and "test_jobs" in job.problem.details


def test_a_render_in_a_job_is_cancelled_in_the_middle_of_a_pass() -> None:
    from render.progressive import refine
    from render.world.world import build_world
    from studio.project.templates import template_folder
    from studio.scan.stages import scaled

    folder: Path = template_folder("sphere")
    project = scaled(Project.load(folder / "project.json"), 0.25)
    world = build_world(project.scene, folder)
    frames = []

    def work(progress: Progress, cancelled: Cancel) -> None:
        endless = {"ambient_samples": 65536, "ambient_error": 2e-4, "goal": None}
        settings = project.render.model_copy(update=endless)
        for frame in refine(world, project.scene, settings=settings, progress=progress, run=Run(cancelled=cancelled)):
            frames.append(frame)

    job = started(work)
    until(lambda: len(frames) >= 4, 60)
    job.cancel()
    seen = len(frames)
    assert job.join(180)
    # a pass of thousands of samples would take minutes; how soon it ends is measured in bench_desktop.py
    assert job.state is State.CANCELLED and len(frames) <= seen + 1 and frames[-1].ambient is not None


def test_where_the_work_tells_when_it_began_the_first_batch_is_a_measure_of_the_rest(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Four of twelve cells came after 85 s, four more at once: "0:14 left" was told of minutes."""
    clock = [0.0]
    monkeypatch.setattr(jobs, "time", SimpleNamespace(perf_counter=lambda: clock[0]))
    told, end = threading.Event(), threading.Event()

    def work(progress: Progress, cancelled: Cancel) -> None:
        clock[0] = 85.0
        job.start_up = 5.0
        progress("4 of 12 cells", 4 / 12)
        told.set()
        end.wait(180)

    job = Job("study", work)
    job.start()
    assert told.wait(180) and job.seconds_left == pytest.approx(160.0)
    end.set()
    job.join()
