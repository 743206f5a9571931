"""How often two sigma hold in rendered templates with all of the sensor's trouble switched on: noise, uneven gain and
speckle. Reduced to a quarter, where lines are 0.13 to 0.3 px wide.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from render.run import Run
from render.world.world import build_world
from studio.project.project import Project
from studio.project.templates import template_folder
from studio.scan.line_extraction import extract_line
from studio.scan.stages import Clock, compare_points, develop_step, render_step, scaled, triangulate_line

pytestmark = pytest.mark.validation

SCALE = 0.25


@pytest.mark.parametrize(
    "template",
    ["plane", "sphere", "step_block", "v_groove", "scan", "weld_seam", "shiny_weld_seam", "glass_ball"],
)
def test_two_sigma_hold_where_everything_is_switched_on(template):
    folder = template_folder(template)
    project = scaled(Project.load(folder / "project.json"), SCALE)
    sensor = project.sensor.model_copy(update={"speckle": "depolarised", "prnu": 0.01})
    render = project.render.model_copy(update={"truth_images": False})
    project = project.model_copy(update={"sensor": sensor, "render": render})
    clock = Clock(lambda stage, done: None, lambda: False)
    world = build_world(project.scene, folder, 0)
    frame = render_step(project, world, 0, clock, Run(threads=2))
    line = extract_line(project, develop_step(project, frame, clock, 2)[0], 0)
    points = triangulate_line(project, line, 0, 0)
    errors = compare_points(project, frame, world, points, line, 0)
    found = np.isfinite(errors.position) & ~errors.outlier
    share = np.mean(np.abs(errors.position[found]) < 2.0 * points.sigma_pixel[found])
    print(f"\n{template}: 2 sigma hold {share:.3f} of {found.sum()}")
    chance = 3 * math.sqrt(0.05 * 0.95 / found.sum())
    assert 0.92 - chance < share < 0.97 + chance
