"""What the project asks of the extraction beyond the method: exposures fused, geometry, along time."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from analysis.line.result import Flag
from render.base.errors import InputError
from render.scene.motion import LinearStage
from render.world.world import build_world
from studio.project.allowed_files import of_command_line
from studio.project.document import replaced
from studio.project.project import Project
from studio.project.templates import template_folder
from studio.scan.line_extraction import extract_line, extraction_of, working_volume
from studio.scan.options import ScanOptions
from studio.scan.results import compared_methods, measure_frame
from studio.scan.scan import run_scan
from studio.scan.stages import Clock, develop_step, measure_step, render_step, scaled

ROOT = template_folder("plane")
CLOCK = Clock(lambda stage, done: None, lambda: False)


def with_extraction(project: Project, **changes: object) -> Project:
    return project.model_copy(update={"extraction": project.extraction.model_copy(update=changes)})


@pytest.fixture(scope="module")
def rendered():
    project = replaced(scaled(Project.load(ROOT / "project.json"), 0.5), ("render", "goal"), None)
    world = build_world(project.scene, ROOT, 0)
    return project, world, render_step(project, world, 0, CLOCK)


@pytest.mark.parametrize("chooser", ["../mine.onnx", "/etc/mine.onnx"])
def test_a_project_names_no_chooser_outside_its_folder_but_the_command_line_may(chooser, tmp_path):
    project = with_extraction(Project.load(ROOT / "project.json"), chooser=chooser)
    with pytest.raises(InputError, match=r"extraction\.chooser"):
        extraction_of(project)
    inside = extraction_of(with_extraction(project, chooser="mine.onnx")).chooser
    assert inside is not None and Path(inside) == (ROOT / "mine.onnx").resolve()
    named = of_command_line(tmp_path / "mine.onnx")
    assert extraction_of(with_extraction(project, chooser=named)).chooser == named


def test_weights_that_are_no_chooser_s_are_refused_before_anything_is_rendered(tmp_path):
    weights = tmp_path / "mine.onnx"
    weights.write_bytes(b"none")
    project = with_extraction(Project.load(ROOT / "project.json"), select="learned", chooser=of_command_line(weights))
    with pytest.raises(InputError, match="chooser's card"):
        run_scan(project, ROOT, out=tmp_path / "out")
    assert not (tmp_path / "out").exists()


def bright(project: Project, times: float) -> Project:
    sensor = project.sensor.model_copy(update={"exposure_time": times * project.sensor.exposure_time})
    return project.model_copy(update={"sensor": sensor})


def test_fused_exposures_measure_a_line_that_one_exposure_saturates(rendered):
    project, world, frame = rendered
    project = bright(project, 12.0)
    single = measure_step(project, frame, world, develop_step(project, frame, CLOCK, None), CLOCK, None)[0]
    assert (single.line.flag[single.line.valid] == Flag.SATURATED).mean() > 0.5
    several = with_extraction(project, exposures=4, exposure_ratio=5.0)
    images = develop_step(several, frame, CLOCK, None)
    assert [one.exposure_time for one in images[0].shorter] == pytest.approx(
        [project.sensor.exposure_time / 5**k for k in (1, 2, 3)]
    )
    fused = measure_step(several, frame, world, images, CLOCK, None)[0]
    assert (fused.line.flag[fused.line.valid] == Flag.OK).all()
    assert fused.errors.completeness >= single.errors.completeness
    assert fused.errors.u.rmse < 0.5 * single.errors.u.rmse
    assert "4 exposures fused" in fused.line.note


def test_the_working_volume_of_the_project_decides_what_is_measured():
    root = template_folder("sphere")
    project = replaced(scaled(Project.load(root / "project.json"), 0.25), ("render", "goal"), None)
    frame = render_step(project, build_world(project.scene, root, 0), 0, CLOCK)
    image = develop_step(project, frame, CLOCK, None)[0]
    whole = extract_line(project, image, 0)
    depth = frame.curves[0].depth_z
    cut = float(np.median(depth))
    near = with_extraction(project, geometry=True, farthest=cut)
    assert working_volume(project, 0) is None and working_volume(near, 0).farthest == cut
    found = extract_line(near, image, 0)
    assert 0.3 < found.valid.mean() / whole.valid.mean() < 0.7
    at = np.interp(np.nonzero(found.valid)[0], frame.curves[0].index, depth)
    assert at.max() < cut + 1e-3
    assert (found.flag[whole.valid & ~found.valid] == Flag.REJECTED).all()
    assert "on the laser's plane" in found.note and f"to {1e3 * cut:g} mm" in found.note


def test_a_scan_along_time_takes_the_edges_out_of_the_line(tmp_path: Path):
    project = scaled(Project.load(template_folder("scan") / "project.json"), 0.125)
    # a shift along x by a third of the line's width a frame
    motion = LinearStage(moves="rig", step=(0.00035, 0.0, 0.0), steps=26)
    scene = project.scene.model_copy(update={"motion": motion, "lights": ()})
    update = {"transport": "direct", "truth_images": False, "laser_error": 0.01, "goal": None}
    render = project.render.model_copy(update=update)
    project = with_extraction(project.model_copy(update={"scene": scene, "render": render}), spacetime=True)
    done = run_scan(project, template_folder("scan"), out=tmp_path, options=ScanOptions(report=False))
    assert any("measured along time" in note for note in done.manifest["extraction"])
    own, other = done.manifest["results"][0], done.manifest["results"][1]
    assert own["points"] > 0 and other["method"] == "gaussian"


def test_along_time_needs_a_motion(tmp_path: Path):
    project = with_extraction(Project.load(ROOT / "project.json"), spacetime=True)
    with pytest.raises(InputError, match="nothing moves"):
        run_scan(project, ROOT, out=tmp_path)


def test_auto_is_not_compared_with_itself(rendered):
    project, world, frame = rendered
    asked = with_extraction(project, method="auto")
    images = develop_step(asked, frame, CLOCK, None)
    first = measure_frame(asked, frame, world, images, CLOCK, None, keep=False)
    methods = [one.line.method for one in first.lasers[0].extractions]
    assert len(set(methods)) == len(methods) and first.lasers[0].extractions[0].line.note
    # a later frame, where auto may pick another, is compared with the same methods
    dim = develop_step(bright(asked, 0.02), frame, CLOCK, None)
    later = measure_frame(asked, frame, world, dim, CLOCK, None, keep=False, compared=compared_methods(first))
    assert [one.line.method for one in later.lasers[0].extractions[1:]] == methods[1:]
