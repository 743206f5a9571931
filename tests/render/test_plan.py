"""A light group's quality says by itself why it is as it is."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from render.frame import Estimate, Frame
from render.plan import GroupQuality, Plan, TransportStep

INDIRECT = GroupQuality("indirect", "laser", 0.2, 0.1, 1e6, "light paths", 2e6)
LAMPS = TransportStep("ambient", "ambient", True, "always")
LASERS = TransportStep("direct", "direct", True, "always")


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({}, "unfinished"),
        ({"error": 0.1}, "target"),
        ({"work": 2e6}, "work"),
        ({"error": math.nan}, "unfinished"),
        ({"group": "direct", "most": math.inf}, "work"),  # no pixel could be divided further
        ({"group": "ambient", "work": 1.8e6}, "work"),  # whole samples on every tile: the mean may be a little off
        ({"group": "ambient", "work": 1.7e6}, "unfinished"),
        ({"group": "ambient", "error": math.nan, "work": 1.0, "most": 1.0}, "work"),
    ],
)
def test_the_reason_follows_from_error_and_work(changes, reason):
    assert replace(INDIRECT, **changes).reason == reason


def test_other_steps_of_a_group_take_the_place_of_those_before():
    pilot = TransportStep("indirect", "indirect", None, "pilot")
    found = tuple(TransportStep("indirect", name, True, "pilot", 0.1, 0.01) for name in ("interreflection", "caustic"))
    plan = Plan((LASERS, pilot, LAMPS)).with_steps("indirect", found)
    assert plan.steps == (LASERS, *found, LAMPS)
    assert plan.step("indirect", "caustic") == found[1] and plan.step("indirect", "indirect") is None


def test_a_frame_is_unfinished_until_every_group_of_its_plan_is_done():
    image = np.ones((2, 3), np.float32)
    frame = Frame(0, (image,), None, (), None, Plan((LASERS, LAMPS)))
    assert frame.unfinished  # the lamps have not begun
    ambient = GroupQuality("ambient", None, 0.01, 0.01, 4.0, "samples a pixel", 16.0)
    frame = frame.with_estimate("ambient", Estimate(np.ones((2, 3, 3), np.float32), (ambient,)))
    assert not frame.unfinished and frame.quality_of("ambient") == ambient
    under_way = frame.with_estimate("laser_indirect", Estimate((image, image), (INDIRECT,)))
    assert under_way.unfinished
    done = replace(INDIRECT, error=0.05)
    second = replace(done, laser="second")
    half = under_way.with_estimate("laser_indirect", Estimate((image, image), (done,)))
    assert half.unfinished  # of two lasers one has not begun
    whole = half.with_estimate("laser_indirect", Estimate((image, image), (done, second)))
    assert not whole.unfinished and whole.quality == (ambient, done, second)


def test_a_frame_that_goes_on_carries_what_it_has_not_come_to():
    image, sky = np.ones((2, 3), np.float32), np.ones((2, 3, 3), np.float32)
    ambient = GroupQuality("ambient", None, 0.02, 0.01, 4.0, "samples a pixel", 16.0)
    before = Frame(0, (image,), sky, (), None, quality=(INDIRECT, ambient), laser_indirect=(image,))
    better = replace(INDIRECT, error=0.1)
    frame = Frame(0, (2 * image,), None, (), None, quality=(better,), laser_indirect=(3 * image,)).carrying(before)
    assert frame.laser_direct[0][0, 0] == 2 and frame.laser_indirect[0][0, 0] == 3 and frame.ambient is sky
    assert frame.quality == (ambient, better)
