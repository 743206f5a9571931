"""A laser that lights nothing: what is found all the same is counted by table, record, remarks and report."""

from __future__ import annotations

import math
from contextlib import closing
from dataclasses import replace

import numpy as np
import pytest

from analysis.report.record import record_of
from analysis.report.summary import headline, remarks
from analysis.report.tables import measure_tables
from analysis.report.total import total
from render.base.pose import Pose
from render.frame import Frame
from render.material.material import Conductor
from render.world.world import World, build_world
from studio.project.document import FieldPath, replaced
from studio.project.project import Project
from studio.project.templates import template_folder
from studio.scan.remarks import frame_result
from studio.scan.result_series import ERROR_VIEWS, table
from studio.scan.results import report_input
from studio.scan.stages import Clock, Measurement, develop_step, measure_step, render_step, scaled
from studio.scan.summary import summarise

ROOT = template_folder("v_groove")
LASER: FieldPath = ("scene", "rig", "lasers", 0, "T_rig_laser")
STEEL = Conductor(metal="steel", roughness=0.1, roughness_across=0.35)


def measured(degrees: float) -> tuple[Project, World, Frame, Measurement]:
    """A groove of ground steel at a quarter of its pixels a side, with the laser turned away from it."""
    project = scaled(Project.load(ROOT / "project.json"), 0.25)
    project = replaced(project, LASER, Pose(translation=(0.2, 0.0, 0.0), rotation=(0.0, math.radians(degrees), 0.0)))
    project = replaced(project, ("scene", "objects", 0, "material"), STEEL)
    clock = Clock(lambda *_: None, lambda: False)
    world = build_world(project.scene, ROOT, 0)
    frame = render_step(project, world, 0, clock)
    (one,) = measure_step(project, frame, world, develop_step(project, frame, clock, None), clock, None)
    return project, world, frame, one


@pytest.mark.parametrize("degrees", [60.0, -60.0])
def test_positions_without_a_line_are_false_scan_lines_whether_their_rays_give_points_or_not(degrees: float) -> None:
    """Beside 447 positions that were plotted the table said 0 false scan lines: their rays miss the laser's plane."""
    project, world, frame, one = measured(degrees)
    rows = len(np.unique(one.points.index))
    assert rows > 20 and one.errors.truth_rows == 0
    assert one.points.valid.any() == (degrees < 0.0)
    figures = {name: values for name, _, values in table([one], ERROR_VIEWS[0])}
    assert figures["False scan lines"] == [rows] and figures["Points"] == [np.count_nonzero(one.points.valid)]
    with closing(record_of(project.scene, [frame_result(project, frame, {"likelihood": [one]})])) as record:
        (row,), found = summarise(record), total(record.chosen())
        assert row["false_scan_lines"] == found.false_alarms == rows
        report = report_input(project, world, record, {}, notes=[], created="")
        told = f"What was found on {rows} false scan lines is stray light or noise."
        assert told in headline(report) and any(told in text for text in remarks(found))
        lines = dict(measure_tables(report)[0].lines)
        assert ("with neither, but a peak" in lines) == (degrees > 0.0)
        alone = replace(found, truth_rows=1000, depth_z=replace(found.depth_z, count=1000), measured_rows=1000)
        carried = f"{rows} false scan lines carry a peak whose ray gives no depth"
        assert any(text.startswith(carried) for text in remarks(alone)) == (degrees > 0.0)
