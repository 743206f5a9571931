"""What the first frame of a block leaves to the others: it guides them, and leaves their light what it is."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.stats import fisher_exact

from render.base.progress import Clock
from render.frame import Frame
from render.laser_indirect.integrator import LOOKS, TAUGHT
from render.laser_indirect.lesson import fan_between
from render.laser_indirect.photon_emission import FAN_BINS, FanDistribution, guided_fan, uniform_fan
from render.lessons import Lessons
from render.progressive import frames
from render.run import Run
from render.world.placed import PlacedScene
from render.world.world import build_world
from studio.project.project import Project
from studio.project.templates import template_folder
from studio.scan.render_goal import goal_of
from studio.scan.stages import scaled

FOLDER = template_folder("scan")
SEEDS = 10


def test_lessons_are_kept_until_the_teacher_is_done_and_do_not_change_after():
    lessons = Lessons()
    lessons.teach("fan", 1)
    assert lessons.taught("fan") is None and not lessons.given
    lessons.teach("fan", 2)
    lessons.give()
    lessons.teach("fan", 3)
    assert lessons.given and lessons.taught("fan") == 2 and lessons.taught("guide") is None
    assert Run(lessons=lessons).taught("fan") == 2 and Run().taught("fan") is None


def density(fan: FanDistribution) -> np.ndarray:
    """Of photons over that of the power, at quantiles of it."""
    places = (np.linspace(0.0, 1.0, 400_001) + 0.5 / 400_001)[:-1]
    part = ((places - fan.low) / (fan.high - fan.low) * FAN_BINS).astype(int)
    inside = (places >= fan.low) & (places < fan.high)
    found = np.diff(fan.cumulative)[np.clip(part, 0, FAN_BINS - 1)] * FAN_BINS / (fan.high - fan.low)
    return np.where(inside, found, 0.0)


def test_a_learnt_fan_reaches_all_that_another_frame_sees():
    found = np.zeros(FAN_BINS)
    found[40:60] = 1.0
    learnt = guided_fan(uniform_fan(0.3, 0.6), found)
    other = fan_between(learnt, uniform_fan(0.2, 0.8))
    assert (other.low, other.high) == (0.2, 0.8) and np.all(np.diff(other.cumulative) > 0.0)
    assert np.isclose(density(other).mean(), 1.0, atol=1e-3)
    # most goes where most was found, and a quarter everywhere
    place = (np.linspace(0.0, 1.0, 400_001) + 0.5 / 400_001)[:-1]
    bright = density(learnt) > 3.0
    assert density(other)[bright].mean() > 2.0 * density(other)[(place > 0.2) & (place < 0.8)].mean()
    assert density(other)[(place > 0.2) & (place < 0.8)].min() > 0.2
    # of a fan that is not learnt nothing is known, and the same fan stays as it is
    assert fan_between(learnt, uniform_fan(0.3, 0.6)) is learnt


@cache
def renders(seeds: int) -> tuple[list[Frame], list[Frame]]:
    """One step of a small scan, alone and taught by the step before, with one seed each."""
    project = scaled(Project.load(FOLDER / "project.json"), 0.08)
    project = project.replaced({"render.truth_images": False, "render.transport": "interreflection"})
    world, alone, taught = build_world(project.scene, FOLDER, 0), [], []
    for seed in range(seeds):
        lessons = Lessons()
        run = Run(seed=seed, goal=goal_of(project), threads=1)

        def render(step: int, run: Run) -> Frame:
            *_, last = frames(PlacedScene(world, project.scene, step), project.render, run, Clock(None))
            return last

        alone.append(render(8, run))
        render(7, replace(run, lessons=lessons))
        lessons.give()
        taught.append(render(8, replace(run, lessons=lessons)))
    return alone, taught


@pytest.mark.validation
def test_a_taught_frame_has_the_light_that_it_has_alone():
    alone, taught = renders(SEEDS)
    weights = [frame.importance for frame in taught]
    for light in (lambda frame: frame.laser_indirect[0], lambda frame: frame.ambient.mean(axis=2)):
        # where the line is: coarse light elsewhere is interpolated in either
        lit = np.any([one.laser[0] != 0.0 for one in weights], axis=0)
        one, other = (np.array([light(frame)[lit].mean() for frame in found], np.float64) for found in (alone, taught))
        spread = np.sqrt((one.var(ddof=1) + other.var(ddof=1)) / SEEDS)
        assert abs(one.mean() - other.mean()) < 4.0 * spread + 1e-3 * one.mean()


@pytest.mark.parametrize("seeds", [1, pytest.param(SEEDS, marks=pytest.mark.validation)])
def test_a_taught_frame_is_as_well_known_and_tells_so(seeds):
    for frame in renders(seeds)[1]:
        for one in frame.quality:
            assert one.lines is not None and one.unknown is not None
            assert one.reason != "target" or (one.error <= one.target and one.unknown <= 0.1 * one.lines + 1)


@pytest.mark.validation
@pytest.mark.parametrize("group", ["direct", "indirect", "ambient"])
def test_a_taught_frame_is_as_near_its_goal_as_alone(group):
    """Where it ends by its work as where it ends by its goal: by the seeds' own scatter, of which four times the
    standard error of the difference would show twice the error."""
    alone, taught = (
        np.log([one.error / one.target for frame in found for one in frame.quality if one.group == group])
        for found in renders(SEEDS)
    )
    assert len(alone) == len(taught) == SEEDS
    spread = np.sqrt((alone.var(ddof=1) + taught.var(ddof=1)) / SEEDS)
    assert taught.mean() - alone.mean() < 4.0 * spread < np.log(2.0)


@pytest.mark.validation
@pytest.mark.parametrize("group", ["direct", "indirect", "ambient"])
def test_no_more_rows_are_unknown_in_taught_frames_than_in_those_alone(group):
    """By the exact test of two shares (Fisher 1922): frames are independent, rows of one are not, so that it is frames
    with more than a twentieth of their rows unknown that are counted."""
    over = [
        sum(one.unknown > 0.05 * one.lines for frame in found for one in frame.quality if one.group == group)
        for found in renders(SEEDS)
    ]
    table = [[over[1], SEEDS - over[1]], [over[0], SEEDS - over[0]]]
    assert fisher_exact(table, alternative="greater").pvalue > 0.01


def test_passes_of_a_taught_frame_are_numbered_apart():
    """By the same random numbers it would look where these found light by chance."""
    assert TAUGHT > 1000 * LOOKS
    alone, taught = renders(1)
    assert not np.array_equal(alone[0].laser_indirect[0], taught[0].laser_indirect[0])
