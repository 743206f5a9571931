"""Dimensions of 200 rendered parts, each of its own size and place: two sigma hold, and nothing is biased.

Steps, balls and grooves as the templates have them, drawn anew, at half the size of their image, with shot and read
noise, uneven gain and speckle. Each part is photographed several times: its render's own noise is the same in all.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from analysis.gauges.gauge import Gauge, Kind
from render.base.pose import invert, transform_points
from render.frame import Frame
from render.run import Run
from render.world.world import build_world
from studio.project.project import Project
from studio.project.templates import template_folder
from studio.scan.gauging import readings
from studio.scan.line_extraction import extract_line
from studio.scan.stages import (
    Clock,
    Measurement,
    compare_points,
    develop_step,
    render_step,
    scaled,
    triangulate_line,
)

pytestmark = pytest.mark.validation

PARTS, EXPOSURES = 200, 4
SCALE = 0.5
TEMPLATES = {"step": "step_block", "radius": "sphere", "angle": "v_groove"}
Regions = tuple[tuple[float, float], ...]


def drawn(kind: Kind, rng: np.random.Generator) -> Project:
    """The template with its part, the last of its objects, of another size, place and brightness."""
    project = scaled(Project.load(template_folder(TEMPLATES[kind]) / "project.json"), SCALE)
    part = project.scene.objects[-1]
    size = {
        "step": {"rise": rng.uniform(0.004, 0.015), "tread": rng.uniform(0.025, 0.035)},
        "radius": {"radius": rng.uniform(0.03, 0.06)},
        "angle": {"angle": math.radians(rng.uniform(80.0, 130.0)), "depth": rng.uniform(0.012, 0.025)},
    }[kind]
    x, y = rng.uniform(-0.005, 0.005, 2)
    z = size["radius"] if kind == "radius" else rng.uniform(0.0, 0.004)
    a, b, turn = part.T_world_object.rotation
    pose = {"translation": (x, y, z), "rotation": (a, b, turn + rng.uniform(-0.1, 0.1))}
    values = {
        "shape": part.shape.model_copy(update=size),
        "material": part.material.model_copy(update={"albedo": rng.uniform(0.3, 0.8)}),
        "T_world_object": part.T_world_object.model_copy(update=pose),
    }
    objects = (*project.scene.objects[:-1], part.model_copy(update=values))
    sensor = project.sensor.model_copy(update={"speckle": "depolarised", "prnu": 0.01})
    render = project.render.model_copy(update={"truth_images": False})
    scene = project.scene.model_copy(update={"objects": objects})
    return project.model_copy(update={"scene": scene, "sensor": sensor, "render": render})


def regions(kind: Kind, project: Project, frame: Frame) -> Regions:
    """Where a person would drag them: clear of the part's edges, by the exact line."""
    curve, shape = frame.curves[0], project.scene.objects[-1].shape
    laser = transform_points(invert(project.scene.T_camera_laser(0)), curve.point[curve.irradiance > 0.0])
    order = np.argsort(laser[:, 1])
    across, height = laser[order, 1], -laser[order, 2]
    middle = -project.scene.objects[-1].T_world_object.translation[1]
    if kind == "radius":
        return ((middle - 0.5 * shape.radius, middle + 0.5 * shape.radius),)
    if kind == "angle":
        half = shape.depth * math.tan(0.5 * shape.angle)
        return ((middle - 0.85 * half, middle - 0.15 * half), (middle + 0.15 * half, middle + 0.85 * half))
    # an edge may lie between two scan lines or on one
    jumps = np.abs(height[2:] - height[:-2]) > 0.5 * shape.rise
    edges = across[1:-1][jumps & ~np.append(False, jumps[:-1])]
    first = len(edges) // 2 - 1
    low, edge, high = edges[first : first + 3]
    margins = 0.1 * (edge - low), 0.1 * (high - edge)
    return ((low + margins[0], edge - margins[0]), (edge + margins[1], high - margins[1]))


def errors_in_sigmas(kind: Kind, seed: int) -> list[float]:
    """Of one part, by exposures."""
    project = drawn(kind, np.random.default_rng(seed))
    clock = Clock(lambda stage, done: None, lambda: False)
    world = build_world(project.scene, template_folder(TEMPLATES[kind]), 0)
    project = project.model_copy(update={"seed": seed})
    frame = render_step(project, world, 0, clock, Run(threads=2))
    gauge = Gauge(name=kind, kind=kind, regions=regions(kind, project, frame))
    found = []
    for exposure in range(EXPOSURES):
        one = project.model_copy(update={"seed": 1000 * seed + exposure, "measures": (gauge,)})
        image = develop_step(one, frame, clock, 2)[0]
        line = extract_line(one, image, 0)
        points = triangulate_line(one, line, 0, 0)
        errors = compare_points(one, frame, world, points, line, 0)
        (reading,) = readings(one, frame, [Measurement(0, 0, image, line, points, errors)])
        assert not reading.reason
        found.append(reading.error_in_sigmas)
    return found


@pytest.mark.parametrize("kind", list(TEMPLATES))
def test_dimensions_of_rendered_parts_are_as_sure_as_they_say(kind: Kind) -> None:
    told = np.array([errors_in_sigmas(kind, seed) for seed in range(1, PARTS + 1)])
    held, bias = float(np.mean(np.abs(told) < 2.0)), float(told.mean())
    # exposures of a part share its render, so that the parts' means tell how well the bias is known
    chance = float(told.mean(axis=1).std(ddof=1)) / math.sqrt(PARTS)
    print(f"\n{kind}: 2 sigma hold {held:.3f} of {told.size}, bias {bias:+.3f} +- {chance:.3f} sigma", end="")
    assert 0.93 <= held <= 0.97
    assert abs(bias) < 0.1
