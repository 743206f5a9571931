"""Points that are hardly known are told with the value that they make unsure."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from analysis.gauges.gauge import REGIONS
from analysis.gauges.read import read
from tests.analysis.gauges.profiles import REGION, gauge, profile, shape


@pytest.mark.parametrize(("times", "told"), [(20.0, True), (2.0, False)])
def test_a_region_of_points_that_are_far_less_sure_is_named(times: float, told: bool) -> None:
    """A step of 50 mm was undecided at 2.6 mm, since light lay beside its line, and nothing said so."""
    height, _ = shape("step")
    made = profile(height)
    there = made.weight(*REGION["step"][1]) > 0.0
    unsure = replace(made, random=np.where(there[:, None], times, 1.0) * made.random)
    remark = read(gauge("step"), 0, unsure, None).remark
    assert (f"the points in the region {REGIONS['step'][1]!r} are" in remark and "times less sure" in remark) == told


def test_a_profile_that_is_as_sure_everywhere_has_no_doubt() -> None:
    height, _ = shape("step")
    made = profile(height)
    assert not read(gauge("step"), 0, replace(made, random=30.0 * made.random), None).remark
