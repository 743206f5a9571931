"""The front is what nothing beats in both; the knee is where more cost stops paying."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.study.intervals import mean_interval
from analysis.study.pareto import bootstrapped_front, front, knee

INF = float("inf")


@pytest.mark.parametrize(
    ("cost", "error", "expected"),
    [
        ([1, 2, 3], [3, 2, 1], [1, 1, 1]),
        ([1, 2, 3], [1, 2, 3], [1, 0, 0]),
        ([1, 1, 2], [2, 1, 1], [0, 1, 0]),
        ([1, 1], [1, 1], [1, 1]),
        ([1, float("nan"), 2], [2, 0, INF], [1, 0, 0]),
        ([], [], []),
    ],
)
def test_the_front_is_what_nothing_beats(cost: list[float], error: list[float], expected: list[int]) -> None:
    assert front(np.array(cost, float), np.array(error, float)).tolist() == [bool(one) for one in expected]


def test_the_front_agrees_with_its_definition_on_random_ways() -> None:
    random = np.random.default_rng(2)
    for _ in range(50):
        cost, error = random.integers(0, 6, (2, 12)).astype(float)
        beaten = [
            any((cost[j] <= cost[i] and error[j] <= error[i]) and (cost[j], error[j]) != (cost[i], error[i])
                for j in range(12))
            for i in range(12)
        ]  # fmt: skip
        assert front(cost, error).tolist() == [not one for one in beaten]


def test_the_knee_is_where_a_broken_power_law_bends() -> None:
    cost = np.logspace(0, 4, 9)
    error = np.where(cost <= 100.0, 1.0 / cost, 1.0 / 100.0 * (cost / 100.0) ** -0.05)
    assert knee(cost, error) == 4
    assert knee(1000.0 * cost, 1e-6 * error) == 4


@pytest.mark.parametrize("count", [0, 1, 2])
def test_fewer_than_three_ways_have_no_knee(count: int) -> None:
    assert knee(np.arange(1.0, count + 1), np.arange(count, 0.0, -1)) is None


def test_a_straight_front_has_no_knee() -> None:
    cost = np.logspace(0, 3, 5)
    assert knee(cost, 1.0 / cost) is None


def test_membership_of_two_equal_ways_is_decided_by_chance_and_of_a_clear_one_is_sure() -> None:
    random = np.random.default_rng(3)
    costs = [np.full(16, 1.0), np.full(16, 1.0), np.full(16, 5.0)]
    errors = [random.normal(2.0, 0.1, 16), random.normal(2.0, 0.1, 16), random.normal(1.0, 0.1, 16)]
    found = bootstrapped_front(costs, errors)
    assert found.member_probability[2] == 1.0
    assert found.member_probability[:2].sum() == pytest.approx(1.0, abs=0.02)
    assert np.array_equal(found.member_probability, bootstrapped_front(costs, errors).member_probability)


def test_a_repeat_that_measured_nothing_is_left_out_as_it_is_of_the_interval() -> None:
    costs = [np.array([1.0, 1.0, 90.0]), np.full(3, 2.0), np.full(3, 3.0)]
    errors = [np.array([5.0, 5.0, np.nan]), np.full(3, 4.0), np.full(3, np.nan)]
    found = bootstrapped_front(costs, errors)
    without = bootstrapped_front([costs[0][:2], costs[1], np.empty(0)], [errors[0][:2], errors[1], np.empty(0)])
    assert found.member.tolist() == without.member.tolist() == [True, True, False]
    assert found.member_probability.tolist() == [1.0, 1.0, 0.0]
    assert mean_interval(errors[0]).mean == 5.0
