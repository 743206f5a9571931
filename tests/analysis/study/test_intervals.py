"""Intervals hold as often as they say."""

from __future__ import annotations

import math

import numpy as np
import pytest

from analysis.study.intervals import mean_interval


def test_the_interval_holds_the_mean_in_95_percent_of_cases() -> None:
    random = np.random.default_rng(1)
    trials = 4000
    held = sum(one.low <= 3.0 <= one.high for one in map(mean_interval, random.normal(3.0, 2.0, (trials, 5))))
    # 4 standard deviations of a binomial
    assert abs(held / trials - 0.95) < 4.0 * math.sqrt(0.95 * 0.05 / trials)


@pytest.mark.parametrize("values", [[], [math.nan, math.inf]])
def test_of_nothing_nothing_is_known(values: list[float]) -> None:
    found = mean_interval(np.array(values))
    assert found.count == 0 and math.isnan(found.mean)


def test_one_repeat_has_a_mean_but_no_interval() -> None:
    found = mean_interval(np.array([2.0, math.nan]))
    assert (found.mean, found.count) == (2.0, 1) and math.isnan(found.low)
