"""Intervals hold as often as they say."""

from __future__ import annotations

import math

import numpy as np
import pytest

from analysis.study.intervals import mean_interval, positive_interval


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


def held(interval, draws: np.ndarray, mean: float) -> float:
    return float(np.mean([one.low <= mean <= one.high for one in map(interval, draws)]))


def test_of_sigmas_the_positive_interval_holds_as_often_as_told() -> None:
    draws = np.sqrt(np.random.default_rng(2).chisquare(20, (4000, 8)) / 20)
    mean = math.sqrt(2 / 20) * math.exp(math.lgamma(10.5) - math.lgamma(10))
    assert abs(held(positive_interval, draws, mean) - 0.95) < 4.0 * math.sqrt(0.95 * 0.05 / 4000)


def test_where_a_few_repeats_are_far_off_it_stays_above_zero_and_holds_more_often() -> None:
    """Student's own reach below 0 in one of five, and hold 83 %."""
    draws = np.exp(np.random.default_rng(3).normal(0.0, 1.0, (4000, 8)))
    assert all(one.low > 0.0 for one in map(positive_interval, draws))
    assert held(positive_interval, draws, math.exp(0.5)) > held(mean_interval, draws, math.exp(0.5)) + 0.03


def test_of_nothing_but_zeros_the_positive_interval_is_zero() -> None:
    found = positive_interval(np.zeros(5))
    assert (found.low, found.mean, found.high) == (0.0, 0.0, 0.0)
