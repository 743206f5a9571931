"""A scan of any length: nothing held grows with its frames, and what fails at its end costs nothing before it."""

from __future__ import annotations

import gc
import json
import tracemalloc
import warnings
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from analysis.cloud import read_ply
from analysis.report.frame_result import FrameResult
from analysis.report.record import ScanRecord
from render.base.errors import InputError
from render.checkpoint import RenderState
from render.world.world import build_world
from studio.project.project import Project
from studio.project.templates import template_folder
from studio.runtime.console import frame_of
from studio.scan import frames_ahead
from studio.scan.options import Listener, ScanOptions
from studio.scan.scan import run_scan
from studio.scan.scan_folder import open_folder
from studio.scan.stages import Clock, render_step, scaled

ROOT = template_folder("scan")
SCALE = 0.06
FRAMES = 24


@pytest.fixture(scope="module")
def project() -> Project:
    found = Project.load(ROOT / "project.json")
    motion = found.scene.motion.model_copy(update={"steps": FRAMES, "step": (1e-5, 0.0, 0.0)})
    render = found.render.model_copy(update={"transport": "direct", "truth_images": False, "ambient_samples": 1})
    scene = found.scene.model_copy(update={"motion": motion})
    return found.model_copy(update={"scene": scene, "render": render})


@pytest.fixture
def rendered_once(project: Project, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every step is the first frame again, with a warning of its own."""
    small = scaled(project, SCALE)
    world = build_world(small.scene, ROOT, 0)
    frame = render_step(small, world, 0, Clock(lambda stage, done: None, lambda: False))

    def again(scan, world, step, lessons):
        warnings.warn("every frame says the same", UserWarning, stacklevel=1)
        return replace(frame, step=step, warnings=(f"doubtful, by {step} %",)), RenderState({})

    monkeypatch.setattr(frames_ahead, "frame_of_step", again)


def test_nothing_held_grows_with_the_frames_but_a_few_numbers(
    project: Project, rendered_once: None, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """By tracemalloc at two frames of the same scan, well after the sample is full; one frame's points are 100 kB."""
    monkeypatch.setattr("studio.scan.measuring.ScanRecord", partial(ScanRecord, most_lines=512))
    monkeypatch.setattr("analysis.spool.IN_MEMORY", 1)
    take, held = frames_ahead.frame_of_step, []

    def traced(*args, **options):
        if not tracemalloc.is_tracing():
            tracemalloc.start()
        return take(*args, **options)

    def each(frame: FrameResult) -> None:
        if frame.step in (FRAMES // 3, FRAMES - 1):
            gc.collect()
            held.append(tracemalloc.get_traced_memory()[0])

    monkeypatch.setattr(frames_ahead, "frame_of_step", traced)
    try:
        done = run_scan(
            project,
            ROOT,
            out=tmp_path,
            options=ScanOptions(image_scale=SCALE, report=False),
            listener=Listener(measured=each),
        )
    finally:
        tracemalloc.stop()
    assert (held[1] - held[0]) / (FRAMES - 1 - FRAMES // 3) < 8_000
    assert done.manifest["notes"][-2:] == ["doubtful, by 0 %", "every frame says the same"]
    row = done.manifest["results"][0]
    assert row["sampled_scan_lines"] <= 512 < row["scan_lines"]
    points = read_ply(tmp_path / "points.ply")
    assert row["points"] == len(points["x"]) and set(points["step"]) == set(range(FRAMES))
    error = points["error_depth"][np.isfinite(points["error_depth"])]
    assert row["depth_m"]["bias"] == pytest.approx(np.mean(error), rel=1e-9)
    assert row["depth_m"]["rmse"] == pytest.approx(np.sqrt(np.mean(error**2)), rel=1e-9)


@pytest.mark.parametrize(
    "failure", [RuntimeError("a bug"), InputError("the file cannot be written"), KeyboardInterrupt()]
)
def test_a_report_that_fails_costs_neither_points_nor_manifest(
    failure: BaseException, project: Project, rendered_once: None, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def fail(*args: object) -> None:
        raise failure

    monkeypatch.setattr("analysis.report.write.write_report", fail)
    with pytest.raises(type(failure)):
        run_scan(project, ROOT, out=tmp_path, options=ScanOptions(image_scale=SCALE, steps=2))
    found = open_folder(tmp_path)
    assert len(found.frames) == 2 and found.manifest["report"] == []
    assert json.loads((tmp_path / "scan.json").read_text())["results"][0]["points"] > 0
    assert len(read_ply(tmp_path / "points.ply")["x"]) == found.manifest["results"][0]["points"]
    assert [path.name for path in tmp_path.iterdir() if path.name.startswith(".")] == []


def test_progress_tells_the_frame_under_way() -> None:
    assert [frame_of(i / 20, 20) for i in (0, 18, 19, 20)] == [
        "frame 1 of 20", "frame 19 of 20", "frame 20 of 20", "frame 20 of 20",
    ]  # fmt: skip
    assert [frame_of(i / 2000, 2000) for i in range(2000)] == [f"frame {i + 1} of 2000" for i in range(2000)]


def test_where_no_frame_is_kept_other_methods_measure_those_alone_that_the_report_may_show(
    project: Project, rendered_once: None, tmp_path: Path
) -> None:
    """Evenly spread; the project's own method measures all, the same as ever."""
    found = {}
    for frames in ("all", "none"):
        options = ScanOptions(image_scale=SCALE, steps=24, frames=frames, report=False)
        found[frames] = run_scan(project, ROOT, out=tmp_path / frames, options=options).manifest
    (own, *others), (same, *fewer) = (found[frames]["results"] for frames in ("all", "none"))
    assert same == own and [one["method"] for one in fewer] == [one["method"] for one in others] != []
    for one, of_all in zip(fewer, others, strict=True):
        assert one["scan_lines"] == of_all["scan_lines"]  # of the scan, whoever measured them
        assert one["points"] == pytest.approx(16 / 24 * of_all["points"], rel=0.05)
        assert one["completeness"] == pytest.approx(of_all["completeness"], rel=0.05)
    told = "Other methods, to compare with, measured 16 of 24 frames."
    assert told in found["none"]["extraction"] and told not in found["all"]["extraction"]
