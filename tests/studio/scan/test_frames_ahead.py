"""Frames rendered at once, and taught by the first of their block: the same whatever the threads, in their order."""

from __future__ import annotations

import signal
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from render.base.errors import Cancelled, InputError
from render.checkpoint import RenderState
from render.frame import Frame
from render.world.world import World, build_world
from studio.project.project import Project
from studio.project.templates import template_folder
from studio.scan import blocks, frames_ahead, scan_folder
from studio.scan.blocks import Blocks, first_of_block
from studio.scan.frames_ahead import rendered_frames
from studio.scan.options import Listener, Scan, ScanOptions
from studio.scan.scan import run_scan
from studio.scan.stages import Clock

FOLDER = template_folder("scan")
STEPS = 7


@pytest.fixture(autouse=True)
def short_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Blocks of three frames."""
    monkeypatch.setattr(blocks, "FRAMES", 3)


@pytest.fixture(scope="module")
def project() -> Project:
    """A small scan of a grooved part, with all light, of which the lines are the goal."""
    found = Project.load(FOLDER / "project.json")
    motion = found.scene.motion.model_copy(update={"steps": STEPS})
    render = found.render.model_copy(update={"ambient_samples": 8, "truth_images": False})
    return found.model_copy(update={"scene": found.scene.model_copy(update={"motion": motion}), "render": render})


def scanned(project: Project, out: Path, listener: Listener = Listener(), **options: Any) -> list[bytes]:
    """The frames of a scan, as the files that it leaves."""
    given = ScanOptions(image_scale=0.08, measure=False, **options)
    run_scan(project, FOLDER, out=out, options=given, listener=listener)
    return [(out / f"frame_{step:04}.exr").read_bytes() for step in range(options.get("steps", STEPS))]


@pytest.fixture(scope="module")
def alone(project: Project, tmp_path_factory: pytest.TempPathFactory) -> list[bytes]:
    """The frames one after the other, on one thread."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(blocks, "FRAMES", 3)
        return scanned(project, tmp_path_factory.mktemp("alone"), threads=1)


def test_blocks_are_of_one_length_and_no_longer_than_they_may_be() -> None:
    for count in (1, 2, 3, 4, 7, 9, 10):
        begins = [first_of_block(step, count) for step in range(count)]
        assert begins == sorted(begins) and all(begin <= step for step, begin in enumerate(begins))
        lengths = np.unique(begins, return_counts=True)[1]
        assert lengths.max() <= 3 and len(lengths) == -(-count // 3)
        assert np.all(lengths[:-1] == lengths.max())


@pytest.mark.parametrize("threads", [5, pytest.param(2, marks=pytest.mark.validation)])
def test_frames_are_the_same_on_any_number_of_threads(
    project: Project, alone: list[bytes], threads: int, tmp_path: Path
) -> None:
    assert scanned(project, tmp_path, threads=threads) == alone


def test_a_scan_cut_short_has_the_frames_of_the_whole(project: Project, alone: list[bytes], tmp_path: Path) -> None:
    assert scanned(project, tmp_path, threads=2, steps=5) == alone[:5]


@pytest.mark.validation
@pytest.mark.parametrize("missing", [[1, 2, 3], [6]])
def test_frames_rendered_anew_are_as_they_were(
    project: Project, alone: list[bytes], missing: list[int], tmp_path: Path
) -> None:
    """Whether the first of their block, which taught them, is there already or not."""
    scanned(project, tmp_path, threads=2)
    for step in missing:
        (tmp_path / f"frame_{step:04}.json").unlink()
    assert scanned(project, tmp_path, threads=2, resume=True) == alone


def test_a_scan_that_was_stopped_goes_on_to_the_same_frames(
    project: Project, alone: list[bytes], tmp_path: Path
) -> None:
    heard: list[Frame] = []

    def stop() -> bool:
        return len(heard) >= 2

    with pytest.raises(Cancelled):
        scanned(project, tmp_path, Listener(cancelled=stop, refined=heard.append), threads=2)
    assert not (tmp_path / f"frame_{STEPS - 1:04}.json").exists()
    assert scanned(project, tmp_path, threads=2, resume=True) == alone


def stood_in(project: Project, folder: Path, monkeypatch: pytest.MonkeyPatch, frame_of_step: Any, **clock: Any) -> Any:
    """The frames of a scan of four threads, with something that stands in for `frame_of_step`."""
    small = project.model_copy(update={"scene": project.scene.scaled(0.08)})
    begun = scan_folder.Begun(folder, {}, small, FOLDER)
    clock_of = Clock(lambda stage, done: None, clock.get("cancelled", lambda: False))
    scan = Scan(begun, clock_of, ScanOptions(threads=4, measure=False), lambda frame: None)
    monkeypatch.setattr(frames_ahead, "frame_of_step", frame_of_step)
    return rendered_frames(scan, build_world(small.scene, FOLDER, 0), STEPS)


def frame(step: int) -> tuple[Frame, RenderState]:
    return Frame(step, (), None, (), None), RenderState({})


def test_frames_come_in_their_order_and_few_are_ahead(
    project: Project, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun: list[int] = []

    def frame_of_step(scan: Scan, world: World, step: int, lessons: Any) -> Any:
        begun.append(step)
        time.sleep(0.02 * (step % 3))
        return frame(step)

    steps, ahead = [], []
    for one in stood_in(project, tmp_path, monkeypatch, frame_of_step):
        steps.append(one.frame.step)
        ahead.append(len(begun) - len(steps))
    # four at once, and the first frame of the next block
    assert steps == list(range(STEPS)) and max(ahead) <= 5
    assert [step for step in begun if step % 3 == 0] == [0, 3, 6]
    assert begun.index(3) < begun.index(2) and begun.index(6) < begun.index(5)


@pytest.mark.parametrize("bad", [0, 1, 3, 6])
def test_an_error_is_raised_where_its_frame_would_come(
    project: Project, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, bad: int
) -> None:
    def frame_of_step(scan: Scan, world: World, step: int, lessons: Any) -> Any:
        if step == bad:
            raise InputError("bad", where=str(step), found="1")
        time.sleep(0.01)
        return frame(step)

    steps = []
    with pytest.raises(InputError, match="bad"):
        for one in stood_in(project, tmp_path, monkeypatch, frame_of_step):
            steps.append(one.frame.step)
    assert steps == list(range(bad))


def test_those_under_way_are_cancelled_with_the_iterator(
    project: Project, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    ended: list[int] = []

    def frame_of_step(scan: Scan, world: World, step: int, lessons: Any) -> Any:
        while step and not scan.clock.cancelled():
            time.sleep(0.001)
        ended.append(step)
        if step:
            raise Cancelled
        return frame(step)

    frames = stood_in(project, tmp_path, monkeypatch, frame_of_step)
    assert next(frames).frame.step == 0
    frames.close()
    # all that were begun have ended when it returns
    assert (
        0 in ended and len(ended) >= 4 and not [one for one in threading.enumerate() if one.name.startswith("frame_")]
    )


def test_a_request_to_cancel_reaches_every_frame(
    project: Project, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = threading.Event()

    def frame_of_step(scan: Scan, world: World, step: int, lessons: Any) -> Any:
        if step == 3:
            asked.set()
        while not scan.clock.cancelled():
            time.sleep(0.001)
        raise Cancelled

    with pytest.raises(Cancelled):
        list(stood_in(project, tmp_path, monkeypatch, frame_of_step, cancelled=asked.is_set))


def test_an_interrupt_reaches_frames_on_other_threads(
    project: Project, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def frame_of_step(scan: Scan, world: World, step: int, lessons: Any) -> Any:
        if step == 0:
            signal.raise_signal(signal.SIGINT)
        while not scan.clock.cancelled():
            time.sleep(0.001)
        raise Cancelled

    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    with pytest.raises(Cancelled):
        list(stood_in(project, tmp_path, monkeypatch, frame_of_step))
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_the_first_of_a_block_is_done_before_it_teaches(
    project: Project, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What it leaves is what others get; of blocks before the present one nothing is kept."""
    seen: dict[int, int] = {}

    def frame_of_step(scan: Scan, world: World, step: int, lessons: Any) -> Any:
        own = lessons()
        if step % 3 == 0:
            time.sleep(0.03)
            own.teach("step", step)
        else:
            seen[step] = own.taught("step")
        return frame(step)

    monkeypatch.setattr(Blocks, "_alone", False)
    list(stood_in(project, tmp_path, monkeypatch, frame_of_step))
    assert seen == {1: 0, 2: 0, 4: 3, 5: 3}
