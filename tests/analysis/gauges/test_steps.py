"""Over the steps of a scan a measure has no value where its points are stray ones, or where it lies beside the part."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from analysis.gauges.gauge import Gauge
from analysis.gauges.parts import is_stray, on_ground
from analysis.gauges.profile import Profile
from analysis.gauges.read import Reading, read
from analysis.gauges.steps import over_steps
from tests.analysis.gauges.profiles import ACROSS, gauge, noises, profile, shape

STEP = gauge("step", nominal=0.002, lower=-1e-4, upper=1e-4)
LOWER, UPPER = "lower side", "upper side"


def on(ground: np.ndarray | None) -> Profile:
    return replace(profile(shape("step")[0]), ground=ground)


def reading(step: int, *ground: str, stray: bool = False, gauge: Gauge = STEP, reason: str = "") -> Reading:
    value = np.nan if reason else 1e-3 * (2.0 + step)
    return Reading(gauge, step, value, 1e-6, 0.0, 20, 0.002, reason, stray=stray, ground=ground)


@pytest.mark.parametrize(("kept", "stray"), [(1.0, False), (0.6, False), (0.4, True), (0.0, True)])
def test_points_where_the_exact_line_is_not_are_stray(kept: float, stray: bool) -> None:
    """Of a step at the part's end the exact line had four points, and the scan 25 false ones: -453 mm."""
    measured = profile(shape("step")[0], noise=noises(1, 1.0, 3)[0])
    every = np.arange(len(ACROSS))
    truth = profile(shape("step")[0]).taken((ACROSS < 0.0) | (every % 10 < 10 * kept))
    assert is_stray(STEP, measured, truth) == stray
    found = read(STEP, 0, measured, truth)
    assert found.stray == stray and ("stray light" in found.remark) == stray
    assert found.verdict == (None if stray else "pass") and np.isfinite(found.value)


def test_regions_on_what_parts_stand_on_are_named_by_the_exact_line() -> None:
    nothing, left = np.zeros(len(ACROSS), dtype=bool), ACROSS < 0.0
    for ground, names in ((None, ()), (nothing, ()), (left, (LOWER,)), (left | True, (LOWER, UPPER))):
        assert on_ground(STEP, on(ground)) == names
        assert read(STEP, 0, on(None), on(ground)).ground == names
    # an edge in a region is of both
    assert on_ground(STEP, on(ACROSS < 0.01)) == (LOWER,)


def test_a_step_of_stray_points_has_no_value_and_tells_what_was_read() -> None:
    (good, bad) = over_steps([reading(0), reading(1, stray=True)])
    assert good == reading(0)
    assert bad.reason.startswith(
        "the exact line does not reach its regions: what is read there, 3.0000 mm, is of stray"
    )
    assert np.isnan(bad.value) and bad.verdict is None and bad.truth == 0.002 and bad.step == 1
    assert over_steps([good, bad]) == [good, bad], "once more it is the same"
    assert len(over_steps([reading(0, stray=True)])[0].reason) < 150


@pytest.mark.parametrize(
    ("grounds", "beside"),
    [
        # a step of the part
        ([(), (), (LOWER, UPPER)], [2]),
        # from the table to the part, whose upper side is missing in the last step
        ([(LOWER,), (LOWER,), (LOWER, UPPER)], [2]),
        # of the table itself
        ([(LOWER, UPPER), (LOWER, UPPER)], []),
        # most of the scan is beyond the part
        ([(LOWER, UPPER), (LOWER, UPPER), ()], [0, 1]),
    ],
)
def test_a_step_beside_the_part_is_told_from_those_of_it(grounds: list[tuple[str, ...]], beside: list[int]) -> None:
    found = over_steps([reading(step, *ground) for step, ground in enumerate(grounds)])
    assert [one.step for one in found if one.reason] == beside
    for step in beside:
        assert "on the plane that parts stand on" in found[step].reason and f"{2 + step}.0000 mm" in found[step].reason


def test_what_is_known_of_one_measure_or_of_stray_steps_says_nothing_of_another() -> None:
    other = STEP.model_copy(update={"name": "other"})
    whole = [
        reading(0, LOWER, UPPER),
        reading(1, gauge=other),
        reading(1, stray=True),
        reading(2, reason="too few points"),
    ]
    assert [bool(one.reason) for one in over_steps(whole)] == [False, False, True, True]
