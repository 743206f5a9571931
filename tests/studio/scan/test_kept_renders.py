"""Renders kept with the project come back to the bit, by name; damaged ones are told and passed over."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from analysis.gauges.gauge import Gauge
from analysis.gauges.read import Reading
from render.base.errors import InputError
from render.frame import Frame
from render.output.frame_files import read_frame
from studio.project.project import Project
from studio.scan.kept_renders import Kept, as_read_now, keep, kept_renders, open_kept
from tests.studio.small_scan import scan, small_project, write_plate

FIGURES = {"Depth RMSE": 12.5, "Line RMSE": math.nan}


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Frame, Project]:
    folder = tmp_path_factory.mktemp("kept")
    file = small_project(folder / "project")
    done = scan(file, folder / "scan")
    return file.parent, read_frame(done.folder / "frame_0000.json"), Project.load(done.folder / "scan_project.json")


def kept(project: Project, name: str = "first look") -> Kept:
    return Kept(name, "2030-01-02 03:04:05+00:00", project, 0.05, FIGURES)


def test_a_kept_render_comes_back_to_the_bit(made: tuple[Path, Frame, Project]) -> None:
    root, frame, project = made
    one = keep(root, kept(project, "a / b: 1"), frame)
    two = keep(root, kept(project, "a / b: 1"), frame)
    assert one.folder is not None and two.folder is not None and one.folder != two.folder
    found, wrong = kept_renders(root)
    assert [each.name for each in found] == ["a / b: 1"] * 2 and wrong == []
    assert found[0].project == project and found[0].figures["Depth RMSE"] == 12.5
    assert math.isnan(found[0].figures["Line RMSE"]) and found[0].image_scale == 0.05
    again = open_kept(found[0], root)
    assert np.array_equal(again.laser_direct[0], frame.laser_direct[0]) and again.step == frame.step


def test_what_was_read_of_a_kept_render_is_there_until_the_measure_is_another(
    made: tuple[Path, Frame, Project],
) -> None:
    root, frame, project = made
    step = Gauge(name="step", kind="step", regions=((-0.02, 0.0), (0.0, 0.02)))
    project = project.model_copy(update={"measures": (step,)})
    read = Reading(step, 0, 0.001, 2e-6, math.nan, 90, 0.00101, remark="of few points")
    keep(root, replace(kept(project, "measured"), readings=(read,)), frame)
    (again,) = (one for one in kept_renders(root)[0] if one.name == "measured")
    (found,) = again.readings
    assert (found.value, found.sigma_random, found.points, found.truth) == (0.001, 2e-6, 90, 0.00101)
    assert found.gauge == step and math.isnan(found.sigma_systematic) and found.remark == "of few points"
    judged = step.model_copy(update={"name": "height", "nominal": 0.001, "upper": 1e-5})
    moved = step.model_copy(update={"regions": ((-0.02, 0.0), (0.0, 0.01))})
    for now, names in ((step, ["step"]), (judged, ["height"]), (moved, [])):
        shown = as_read_now(again, project.model_copy(update={"measures": (now,)}))
        assert [one.gauge.name for one in shown.readings] == names
    assert as_read_now(again, project.model_copy(update={"measured_in": "upright"})).readings == ()
    assert again.folder is not None
    record = again.folder / "kept.json"
    data = json.loads(record.read_text())
    for damaged in (3, {"step": 4}, {"step": {"value": "x", "points": None}}):
        record.write_text(json.dumps(data | {"measures": damaged}))
        (again,) = (one for one in kept_renders(root)[0] if one.name == "measured")
        assert all(math.isnan(one.value) for one in again.readings)


def test_what_is_damaged_is_passed_over_and_told(made: tuple[Path, Frame, Project]) -> None:
    root, frame, project = made
    one = keep(root, kept(project, "broken"), frame)
    assert one.folder is not None
    record = one.folder / "kept.json"
    data = json.loads(record.read_text())
    for change in ({"format": "other"}, {"image_scale": True}, {"figures": None}, {"name": 3}):
        record.write_text(json.dumps(data | change))
        found, wrong = kept_renders(root)
        assert all(each.name != "broken" for each in found) and len(wrong) == 1
    record.unlink()
    assert kept_renders(root)[1] == []


def test_a_mesh_that_has_changed_since_is_named(made: tuple[Path, Frame, Project]) -> None:
    root, frame, project = made
    one = keep(root, kept(project, "before"), frame)
    write_plate(root, rise=0.01)
    with pytest.raises(InputError, match=r"plate\.obj"):
        open_kept(one, root)
    write_plate(root)
    open_kept(one, root)


def test_a_render_without_a_name_is_not_kept(made: tuple[Path, Frame, Project]) -> None:
    root, frame, project = made
    with pytest.raises(InputError, match="name"):
        keep(root, kept(project, " . "), frame)
