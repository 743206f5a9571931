"""One plan of the light for all frames of a scan."""

from __future__ import annotations

import math

import pytest

from render.laser_indirect.light_group import IndirectLight
from render.laser_indirect.path_vertex import INTERREFLECTION
from render.laser_indirect.transport_plan import LADDER
from render.material.material import Conductor
from render.run import Run
from render.scan_plan import pilot_steps, plan_scan
from render.scene.motion import LinearStage
from render.scene.settings import RenderSettings
from tests.render.laser_indirect.test_integrator import setting, turned_groove
from tests.render.scenes import paper_camera

CAMERA = paper_camera(0.04)


@pytest.fixture(scope="module")
def groove():
    """Twelve frames of a groove that the rig moves along."""
    scene, parts = setting([turned_groove()], [Conductor(roughness=0.2)], camera=CAMERA)
    motion = LinearStage(moves="rig", step=(0.0, 0.001, 0.0), steps=12)
    return scene.model_copy(update={"motion": motion}), parts[0]


def test_pilots_run_on_frames_that_are_spread_over_the_scan():
    assert pilot_steps(1) == (0,)
    assert pilot_steps(3) == (0, 1, 2)
    assert pilot_steps(20) == (0, 4, 9, 14, 19)


def test_a_single_frame_decides_for_itself(groove):
    scene, world = groove
    motion = scene.motion.model_copy(update={"steps": 1})
    assert plan_scan(scene.model_copy(update={"motion": motion}), RenderSettings(), lambda step: world) is None


def test_the_plan_is_the_same_on_any_number_of_threads_and_says_what_it_is(groove):
    scene, world = groove
    asked: list[int] = []

    def at(step: int):
        asked.append(step)
        return world

    one, two = (plan_scan(scene, RenderSettings(), at, run=Run(seed=3, threads=threads)) for threads in (1, 2))
    assert one == two and set(asked) == set(pilot_steps(12))
    assert one.plans["indirect"].kinds == INTERREFLECTION
    assert one.pilot_steps == (0, 2, 5, 8, 11) and one.frame_count == 12
    assert one.mark == f"ambient light 1, laser light {INTERREFLECTION}"


@pytest.mark.parametrize(("share", "computed"), [(0.03, True), (0.015, False), (math.inf, True)])
def test_what_one_frame_needs_is_computed_in_all(groove, monkeypatch, share, computed):
    """A share that only the last frame has, of one that is negligible below 2 %."""
    scene, world = groove
    nothing = {kind.field: (0.0, 0.0) for kind in LADDER}

    measured = IndirectLight.measured

    def pilot(light, placed, *args):
        assert set(measured(light, placed, *args)) == set(nothing)
        return {**nothing, "interreflection": (share, 0.001)} if placed.step == 11 else nothing

    monkeypatch.setattr(IndirectLight, "measured", pilot)
    plan = plan_scan(scene, RenderSettings(), lambda step: world)
    light = plan.plans["indirect"]
    assert (light.kinds is not None) == computed and light.steps[0].computed == computed


def test_nothing_is_measured_where_only_direct_light_is_asked_for(groove, monkeypatch):
    scene, world = groove
    monkeypatch.delattr(IndirectLight, "measured")
    plan = plan_scan(scene, RenderSettings(transport="direct"), lambda step: world)
    assert plan.plans["indirect"].kinds is None and plan.plans["indirect"].steps[0].reason == "switched off"
    assert plan.pilot_steps == ()
