"""The search finds a known boundary in few steps, and its interval holds it as often as it says."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable

import numpy as np
import pytest

from analysis.study.breakdown import Breakdown, Search, breakdown, next_values

REPEATS = 8


def searched(
    search: Search, measure: Callable[[float], np.ndarray], most: int = 60
) -> tuple[Breakdown, dict[float, np.ndarray]]:
    measured: dict[float, np.ndarray] = {}
    while values := next_values(search, measured):
        measured |= {value: measure(value) for value in values}
        assert len(measured) <= most
    return breakdown(search, measured), measured


SHAPES: dict[str, Callable[[float, float], float]] = {
    "exponential": lambda value, boundary: math.exp(3.0 * (value - boundary)),
    "linear": lambda value, boundary: 1.0 + 2.0 * (value - boundary),
    "logistic": lambda value, boundary: 2.0 / (1.0 + math.exp(-8.0 * (value - boundary))),
    "quadratic": lambda value, boundary: (value / boundary) ** 2,
}


def test_the_interval_holds_a_known_boundary_in_93_to_97_percent_of_cases() -> None:
    search, trials = Search(0.0, 1.0, 1.0, tolerance=0.002), 200
    coverages, cells = [], 0
    for shape, noise in itertools.product(SHAPES.values(), (0.02, 0.1)):
        random, held = np.random.default_rng(5), 0
        for _ in range(trials):
            boundary = random.uniform(0.15, 0.85)
            found, measured = searched(
                search,
                lambda v: shape(v, boundary) + noise * random.standard_normal(REPEATS),  # noqa: B023
            )
            held += found.low <= boundary <= found.high
            cells += len(measured)
        coverages.append(held / trials)
    # 3.5 standard deviations of a binomial about 95 %; 2 % are 3.7 of all 1600 cases
    assert all(abs(one - 0.95) < 3.5 * math.sqrt(0.95 * 0.05 / trials) for one in coverages)
    assert 0.93 <= np.mean(coverages) <= 0.97
    assert cells / trials / len(coverages) <= 1.0 / search.tolerance / 5.0


@pytest.mark.parametrize("logarithmic", [False, True])
@pytest.mark.parametrize(("good", "bad"), [(1.0, 100.0), (100.0, 1.0)])
def test_a_step_without_noise_is_found_to_the_tolerance(logarithmic: bool, good: float, bad: float) -> None:
    search = Search(good, bad, 0.5, logarithmic=logarithmic, tolerance=0.001)
    found, measured = searched(search, lambda v: np.full(3, float((v > 37.0) == (bad > good))))
    assert found.ending == "found" and found.low <= 37.0 <= found.high
    assert abs(search.place(found.high) - search.place(found.low)) <= 0.001
    assert len(measured) <= 13


def test_a_measure_that_is_to_stay_above_its_limit_is_searched_alike() -> None:
    found, _ = searched(Search(0.0, 1.0, 0.95, above=False), lambda v: np.full(4, 1.0 if v < 0.4 else 0.2))
    assert found.low <= 0.4 <= found.high


def test_a_limit_that_holds_throughout_or_never_says_so_after_two_values() -> None:
    holds, measured = searched(Search(0.0, 1.0, 2.0), lambda v: np.full(3, v))
    assert (holds.ending, holds.last_good, len(measured)) == ("holds", 1.0, 2)
    fails, measured = searched(Search(0.0, 1.0, -1.0), lambda v: np.full(3, v))
    assert (fails.ending, fails.first_bad, len(measured)) == ("fails", 0.0, 2)


def test_where_nothing_is_measured_the_limit_is_broken() -> None:
    found, _ = searched(Search(0.0, 1.0, 0.5), lambda v: np.full(3, 0.1 if v < 0.7 else math.nan))
    assert found.ending == "found" and found.low <= 0.7 <= found.high


def test_a_search_goes_on_where_it_stood() -> None:
    def measure(value: float) -> np.ndarray:
        return value + 0.05 * np.random.default_rng(round(1e6 * value)).standard_normal(REPEATS)

    search = Search(0.0, 1.0, 0.6)
    whole, measured = searched(search, measure)
    for kept in range(len(measured)):
        part = dict(list(measured.items())[:kept])
        while values := next_values(search, part):
            part |= {value: measure(value) for value in values}
        assert breakdown(search, part) == whole
