"""What pilots foretell of the seconds that light takes, beside those that it took: of the processor, not the clock."""

from __future__ import annotations

import math
import time
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest

from analysis.report.light_text import STAGES, foretold_lines, stage_note
from render.base import progress
from render.base.progress import Clock
from render.frame import Frame
from render.plan import GroupPlan
from render.progressive import frames
from render.run import Run
from render.scan_plan import plan_scan
from render.world.placed import PlacedScene
from render.world.world import build_world
from studio.project.project import Project
from studio.project.templates import template_folder
from studio.scan.render_goal import goal_of
from studio.scan.stages import scaled

SCATTER = 0.4
"""Standard deviation of the logarithm of seconds over those foretold, as the light groups tell it."""
TEMPLATES = ("weld_seam", "v_groove", "step_block")


def last_frame(template: str, scale: float, **changes: object) -> Frame:
    project = scaled(Project.load(template_folder(template) / "project.json"), scale).replaced(changes)
    world = build_world(project.scene, template_folder(template), 0)
    run = Run(seed=1, goal=goal_of(project, 1), threads=1)
    *_, last = frames(PlacedScene(world, project.scene, 0), project.render, run, Clock(None))
    return last


@cache
def logarithms() -> dict[str, list[float]]:
    """Of seconds over those foretold, by light group, of images of another size than the numbers were chosen on."""
    found: dict[str, list[float]] = {"indirect": [], "ambient": []}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(progress, "time", SimpleNamespace(perf_counter=time.process_time))
        for template in TEMPLATES:
            _, frame = last_frame(template, 0.25), last_frame(template, 0.25)  # the first loads kernels
            assert frame.foretold.keys() == found.keys()
            for group, seconds in frame.foretold.items():
                found[group].append(math.log(frame.seconds[STAGES[group]] / seconds))
    return found


@pytest.mark.validation
@pytest.mark.parametrize("group", ["indirect", "ambient"])
def test_pilots_foretell_the_processor_seconds_of_their_light(group):
    """Each within three times the scatter told, a factor of 3.3, and their mean within three standard errors."""
    off = np.array(logarithms()[group])
    assert np.abs(off).max() < 3.0 * SCATTER
    assert abs(off.mean()) < 3.0 * SCATTER / math.sqrt(len(off))


def test_nothing_is_foretold_of_light_that_is_left_out_or_rendered_for_the_image():
    assert last_frame("v_groove", 0.05, **{"render.transport": "direct"}).foretold == {}
    assert last_frame("v_groove", 0.05, **{"render.goal": None, "render.ambient_samples": 1}).foretold == {}


def test_the_plan_of_a_scan_foretells_each_of_its_frames():
    folder = template_folder("scan")
    project = scaled(Project.load(folder / "project.json"), 0.1)
    world = build_world(project.scene, folder, 0)
    plan = plan_scan(project.scene, project.render, lambda step: world, Run(goal=goal_of(project, 1), threads=1))
    assert plan is not None and plan.foretold["ambient"] > 0.0
    kept = [group for group, chosen in plan.plans.items() if isinstance(chosen, GroupPlan) and group in plan.foretold]
    assert all(any(step.computed for step in plan.plans[group].steps) for group in kept)
    placed = PlacedScene(world, project.scene, 3)
    run = Run(seed=1, goal=goal_of(project, 1), threads=1)
    *_, frame = frames(placed, project.render, run, Clock(None), scan=plan)
    assert frame.foretold == plan.foretold


def test_it_is_told_as_roughly_as_it_is_known():
    assert foretold_lines({"indirect": 1.234, "ambient": 0.0567}) == [
        "reflected on light: about 1 s of the processor, by its pilot",
        "ambient light: about 0.06 s of the processor, by its pilot",
    ]
    assert stage_note("ambient light", (), {"indirect": 1.0, "ambient": 23.0}) == "about 20 s of the processor"
