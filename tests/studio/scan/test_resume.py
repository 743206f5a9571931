"""A scan that is stopped goes on where it ended, and ends in the same files."""

from __future__ import annotations

import os
import signal
from functools import partial
from pathlib import Path

import pytest

from analysis.report.light_text import quality_lines
from render.base.errors import Cancelled, InputError
from render.checkpoint import state_of
from render.output.frame_files import read_frame
from render.world.world import build_world
from studio.project.project import Project
from studio.project.templates import template_folder
from studio.scan.interrupt import stop_on_interrupt
from studio.scan.options import Listener, ScanOptions
from studio.scan.resume import made_of, saved_path
from studio.scan.scan import run_scan

FOLDER = template_folder("v_groove")


@pytest.fixture(scope="module")
def project() -> Project:
    found = Project.load(FOLDER / "project.json")
    changes = {"transport": "interreflection", "indirect_error": 0.02, "ambient_error": 0.01, "ambient_samples": 16}
    return found.model_copy(update={"render": found.render.model_copy(update=changes)})


def scan(project: Project, out: Path, listener: Listener = Listener(), folder: Path = FOLDER, **options):
    given = ScanOptions(image_scale=0.05, measure=False, **options)
    return run_scan(project, folder, out=out, options=given, listener=listener)


@pytest.fixture(scope="module")
def whole(project: Project, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("whole")
    scan(project, out)
    return out


def test_a_stopped_scan_goes_on_to_the_same_frame(project: Project, whole: Path, tmp_path: Path) -> None:
    reached: list[str] = []

    def stop() -> bool:
        return reached.count("reflected laser light") > 2

    with pytest.raises(Cancelled, match="--resume"):
        scan(project, tmp_path, Listener(lambda stage, done: reached.append(stage), stop))
    assert saved_path(tmp_path, 0).is_file() and not (tmp_path / "frame_0000.exr").exists()
    scan(project, tmp_path, resume=True)
    assert not saved_path(tmp_path, 0).exists()
    assert (tmp_path / "frame_0000.exr").read_bytes() == (whole / "frame_0000.exr").read_bytes()


def test_a_frame_that_is_there_is_taken_as_it_is(project: Project, whole: Path) -> None:
    before, stages = (whole / "frame_0000.exr").read_bytes(), set()
    scan(project, whole, Listener(lambda stage, done: stages.add(stage)), resume=True)
    assert "reflected laser light" not in stages
    assert (whole / "frame_0000.exr").read_bytes() == before


def test_a_time_limit_leaves_a_frame_and_what_it_takes_to_go_on(project: Project, tmp_path: Path) -> None:
    long = {"goal": None, "indirect_error": 2e-4, "light_paths": 1 << 40, "truth_images": False}
    endless = project.render.model_copy(update=long)
    slow = project.model_copy(update={"render": endless})
    done = scan(slow, tmp_path, seconds=0.5)
    first = read_frame(tmp_path / "frame_0000.json")
    assert first.unfinished and saved_path(tmp_path, 0).is_file()
    groups = {one["group"]: one for one in done.manifest["light"][0]["groups"]}
    assert groups["indirect"]["error"] > groups["indirect"]["target"] == 2e-4
    assert groups["indirect"]["reason"] == "unfinished" and groups["direct"]["reason"] == "target"
    begun = first.quality_of("indirect", "laser").work
    second = first
    for _ in range(20):  # a busy machine may spend a whole limit on what was there
        scan(slow, tmp_path, seconds=0.5, resume=True)
        second = read_frame(tmp_path / "frame_0000.json")
        if second.quality_of("indirect", "laser").work > begun:
            break
    assert second.quality_of("indirect", "laser").work > begun > 0
    names = [name for name, _ in quality_lines(second.quality)]
    assert names == ["laser, direct", "ambient", "laser, reflected on"]
    assert all(one.invalid == 0 for one in second.quality)


def test_a_moving_scan_keeps_its_one_plan_when_it_goes_on(tmp_path: Path) -> None:
    """Stopped after its first frame and gone on with on other threads, and first cut short by its number of steps."""
    found = Project.load(template_folder("scan") / "project.json")
    render = found.render.model_copy(update={"truth_images": False, "ambient_samples": 1, "laser_error": 0.05})
    moving = found.model_copy(update={"render": render})

    run = partial(scan, moving, folder=template_folder("scan"))
    whole = run(out=tmp_path / "whole", steps=2, threads=1)
    stages: list[str] = []
    with pytest.raises(Cancelled):
        stop = Listener(lambda stage, done: stages.append(stage), lambda: stages.count("writing frames") > 2)
        run(out=tmp_path / "part", listener=stop, threads=2)
    assert (tmp_path / "part" / "frame_0000.exr").is_file()
    gone_on = run(out=tmp_path / "part", steps=2, threads=2, resume=True)
    plans = [one["plan"] for done in (whole, gone_on) for one in done.manifest["light"]]
    assert len(plans) == 4 and all(plan == plans[0] for plan in plans)
    assert plans[0]["frame_count"] == 20 and plans[0]["pilot_steps"] == [0, 4, 9, 14, 19]
    for step in range(2):
        name = f"frame_{step:04d}.exr"
        assert (tmp_path / "part" / name).read_bytes() == (tmp_path / "whole" / name).read_bytes()


def test_a_frame_of_another_plan_is_another_frame(project: Project) -> None:
    world = build_world(project.scene, FOLDER, 0)
    alone, one, other = (
        state_of(world, project.scene, project.render, plan=plan) for plan in (None, "laser light 0", "laser light 1")
    )
    assert len({str(made_of(project, state.marks, {})) for state in (alone, one, other)}) == 3


def test_what_is_left_of_another_scene_is_refused(project: Project, tmp_path: Path) -> None:
    saved_path(tmp_path, 0).write_bytes(b"nothing")
    with pytest.raises(InputError, match="damaged"):
        scan(project, tmp_path, resume=True)


def test_the_first_interrupt_asks_and_the_second_stops() -> None:
    with stop_on_interrupt(lambda: False) as cancelled:
        assert not cancelled()
        os.kill(os.getpid(), signal.SIGINT)
        assert cancelled()
        with pytest.raises(KeyboardInterrupt):
            os.kill(os.getpid(), signal.SIGINT)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
