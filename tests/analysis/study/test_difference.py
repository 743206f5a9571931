"""Two runs that err alike are told apart no more often than said, and two that do not are told apart."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.signal import lfilter

from analysis.study.difference import Errors, clear, correlation_length, differences

RNG = np.random.default_rng(5)
"""One seed in twenty finds a difference in bias where there is none, as `clear` says it would."""


@pytest.fixture(autouse=True)
def own_numbers() -> None:
    """The same for a test whatever ran before it."""
    RNG.bit_generator.state = np.random.default_rng(5).bit_generator.state


def alike(count: int, r: float) -> np.ndarray:
    """Unit normal errors whose neighbours correlate by r."""
    noise = RNG.normal(size=count + 200) * math.sqrt(1.0 - r * r)
    return lfilter([1.0], [1.0, -r], noise)[200:]


def run(error: np.ndarray) -> Errors:
    return Errors(np.zeros(len(error), np.int64), np.arange(len(error)), error)


@pytest.mark.parametrize(("r", "common", "paired"), [(0.0, 0.0, False), (0.7, 2.0, True)])
def test_intervals_hold_no_difference_as_often_as_told(r: float, common: float, paired: bool) -> None:
    cases, held = 150, {"bias": 0, "sigma": 0}
    for _ in range(cases):
        texture = common * alike(600, 0.9)
        found = differences(run(texture + alike(600, r)), run(texture + alike(600, r)), paired=paired)
        for name in held:
            held[name] += found[name].low <= 0.0 <= found[name].high
    # 95 % of 150 is 142.5 with a sigma of 2.7; the jackknife itself may be off by 2 %
    assert all(130 <= count <= 150 for count in held.values()), held


def test_what_both_runs_have_in_common_is_no_noise() -> None:
    texture = 5.0 * alike(1000, 0.9)
    a, b = run(texture + 0.1 * alike(1000, 0.0)), run(texture + 0.05 + 0.1 * alike(1000, 0.0))
    paired, apart = differences(a, b, paired=True)["bias"], differences(a, b, paired=False)["bias"]
    assert paired.difference == pytest.approx(apart.difference)
    assert paired.p < 1e-3 and paired.low < 0.05 < paired.high
    assert apart.high - apart.low > 10.0 * (paired.high - paired.low)


def test_more_noise_and_lost_rows_are_found() -> None:
    a, b = alike(1000, 0.3), 1.5 * alike(1000, 0.3)
    b[400:500] = np.nan
    found = differences(run(a), run(b), paired=True)
    assert found["sigma"].p < 1e-6 and found["sigma"].low < 0.5 < found["sigma"].high
    assert found["measured"].difference == -100.0 and found["false"].difference == 100.0
    told = clear({name: one.p for name, one in found.items()})
    assert told["sigma"] and told["rmse"] and not told["bias"]


def test_the_same_run_twice_differs_in_nothing() -> None:
    one = run(alike(500, 0.5))
    assert all(
        found.difference == 0.0 and found.p == 1.0 and found.low == found.high == 0.0
        for found in differences(one, one, paired=True).values()
    )


def test_too_few_rows_tell_nothing() -> None:
    few = run(alike(40, 0.0))
    assert all(math.isnan(found.p) for found in differences(few, few, paired=True).values())
    none = Errors(np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0))
    assert math.isnan(differences(none, few, paired=False)["bias"].a)


def test_correlation_length_is_that_of_the_series() -> None:
    assert correlation_length(run(alike(200_000, 0.6))) == pytest.approx(4.0, rel=0.05)


def test_of_several_figures_only_what_chance_does_not_explain_is_clear() -> None:
    assert clear({"a": 0.02, "b": 0.04, "c": 0.6, "d": math.nan}) == {"a": False, "b": False, "c": False, "d": False}
    assert clear({"a": 0.01, "b": 0.02, "c": 0.6}) == {"a": True, "b": True, "c": False}
