"""One plan of the light for all frames of a scan."""

from __future__ import annotations

import math

import pytest

from render import scan_plan
from render.laser_indirect.path_vertex import INTERREFLECTION
from render.laser_indirect.transport_plan import TRANSPORT_STEPS, pilot_shares
from render.material.material import Conductor
from render.scan_plan import looked_at, plan_scan
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


def test_the_frames_looked_at_are_spread_over_the_scan():
    assert looked_at(1) == (0,)
    assert looked_at(3) == (0, 1, 2)
    assert looked_at(20) == (0, 4, 9, 14, 19)


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

    one, two = (plan_scan(scene, RenderSettings(), at, seed=3, threads=threads) for threads in (1, 2))
    assert one == two and set(asked) == set(looked_at(12))
    assert one.light.kinds == INTERREFLECTION
    assert "the same for all 12 frames: pilots on the steps 0, 2, 5, 8, 11" in one.light.text
    assert one.mark == f"laser light {INTERREFLECTION}, ambient light 1"


@pytest.mark.parametrize(("share", "computed"), [(0.03, True), (0.015, False), (math.inf, True)])
def test_what_one_frame_needs_is_computed_in_all(groove, monkeypatch, share, computed):
    """A share that only the last frame has, of one that is negligible below 2 %."""
    scene, world = groove
    nothing = {step.share: (0.0, 0.0) for step in TRANSPORT_STEPS}

    def pilot(*args, step, **options):
        assert set(pilot_shares(*args, step=step, **options)) == set(nothing)
        return {**nothing, "interreflection": (share, 0.001)} if step == 11 else nothing

    monkeypatch.setattr(scan_plan, "pilot_shares", pilot)
    plan = plan_scan(scene, RenderSettings(), lambda step: world)
    assert plan.light.indirect == computed


def test_nothing_is_measured_where_only_direct_light_is_asked_for(groove, monkeypatch):
    scene, world = groove
    monkeypatch.delattr(scan_plan, "pilot_shares")
    plan = plan_scan(scene, RenderSettings(transport="direct"), lambda step: world)
    assert plan.light.kinds is None and "switched off" in plan.light.text
