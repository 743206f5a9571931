"""Rendered blocks with a slot between them, of known widths and at any phase: the truth of their edges is exact."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from analysis.gauges.gauge import Gauge
from analysis.gauges.read import Reading
from render.run import Run
from render.scene.lights import Environment
from render.scene.scene import SceneObject
from render.scene.shape import Box
from render.world.world import build_world
from studio.project.project import ProfileSection, Project
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

ROOT = template_folder("step_block")
SCALE, PARTS = 0.25, 8
HEIGHT, BESIDE = 0.03, 0.012


@dataclass(frozen=True)
class Blocks:
    """Two blocks on the template's table; m."""

    middle: float
    slot: float
    width: float

    def edges(self) -> tuple[float, float, float, float]:
        """Along the world's y, against which the fan runs."""
        half = 0.5 * self.slot
        places = self.middle + np.array([-half - self.width, -half, half, half + self.width])
        return tuple(places.tolist())

    def project(self, seed: int, section: ProfileSection) -> Project:
        found = scaled(Project.load(ROOT / "project.json"), SCALE)
        low, left, right, high = self.edges()
        objects = [found.scene.objects[0]]
        for name, first, second in (("a", low, left), ("b", right, high)):
            pose = objects[0].T_world_object.model_copy(update={"translation": (0.0, 0.5 * (first + second), 0.015)})
            shape = Box(size_x=0.1, size_y=self.width, size_z=HEIGHT)
            objects.append(SceneObject(name=name, shape=shape, T_world_object=pose))
        regions = [(-place - BESIDE, -place + BESIDE) for place in (left, right, low, high)]
        measures = (
            Gauge(name="slot", kind="edge_to_edge", regions=(regions[1], regions[0])),
            Gauge(name="both", kind="edge_to_edge", regions=(regions[3], regions[2])),
        )
        dark = {"objects": tuple(objects), "lights": (), "environment": Environment(radiance=(0.0, 0.0, 0.0))}
        render = found.render.model_copy(update={"truth_images": False, "transport": "direct", "goal": None})
        scene = found.scene.model_copy(update=dark)
        values = {"scene": scene, "render": render, "measures": measures, "measured_in": section, "seed": seed}
        return found.model_copy(update=values)


def read_blocks(project: Project) -> tuple[Reading, ...]:
    clock = Clock(lambda stage, done: None, lambda: False)
    world = build_world(project.scene, ROOT, 0)
    frame = render_step(project, world, 0, clock, Run(threads=2))
    image = develop_step(project, frame, clock, 2)[0]
    line = extract_line(project, image, 0)
    points = triangulate_line(project, line, 0, 0)
    errors = compare_points(project, frame, world, points, line, 0)
    return readings(project, frame, [Measurement(0, 0, image, line, points, errors)])


@pytest.mark.parametrize("section", ["laser_plane", "upright"])
def test_edges_of_rendered_blocks_have_the_blocks_own_width_as_truth(section: ProfileSection) -> None:
    """A block of 150.000 mm had a truth of 150.186 mm, of the scan lines, beside which the value was off by 4 um."""
    random, told = np.random.default_rng(17), []
    for seed in range(PARTS):
        blocks = Blocks(random.uniform(-0.004, 0.004), random.uniform(0.03, 0.05), random.uniform(0.04, 0.06))
        slot, both = read_blocks(blocks.project(seed, section))
        assert slot.truth == pytest.approx(blocks.slot, abs=1e-8)
        assert both.truth == pytest.approx(blocks.slot + 2.0 * blocks.width, abs=1e-8)
        told += [slot.error_in_sigmas, both.error_in_sigmas]
    off = np.array(told)
    # a sum of two uniform errors: never beyond the root of six, and spread like its sigma
    assert np.abs(off).max() < np.sqrt(6.0) and np.mean(np.abs(off) <= 2.0) > 0.8
    assert off.std() == pytest.approx(1.0, abs=3.3 * np.sqrt((2.4 - 1.0) / 4.0 / len(off)))
    assert abs(off.mean()) < 3.3 / np.sqrt(len(off))


def test_a_block_that_goes_on_outside_the_image_has_no_truth_where_its_points_end() -> None:
    blocks = Blocks(0.0, 0.04, 0.4)
    project = blocks.project(1, "upright")
    first, second = project.measures[1].regions
    ends = (first[0] - 0.01, first[1] + 0.2), (second[0] - 0.2, second[1] + 0.01)
    (one,) = read_blocks(project.model_copy(update={"measures": (Gauge(kind="edge_to_edge", regions=ends),)}))
    assert one.value > 0.12 and np.isnan(one.truth) and "no truth: the surface goes on" in one.remark
