"""A budget finds what effects were made of, alone and in pairs, and tells what is neither."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from analysis.study.budget import Budget, budget

REPEATS = 8
ALONE = {"a": 4.0, "b": 2.0, "c": -1.0}
PAIRS = {("a", "b"): 3.0, ("b", "c"): -0.5}


def made(three: float = 0.0, noise: float = 0.01) -> Budget:
    """Of effects that add up with interactions of pairs and of all three, measured with noise."""
    generator = np.random.default_rng(1)

    def value(on: set[str]) -> np.ndarray:
        total = 10.0 + sum(ALONE[name] for name in on)
        total += sum(PAIRS.get(pair, 0.0) for pair in itertools.combinations(sorted(on), 2))
        return total + three * (len(on) == 3) + noise * generator.normal(size=REPEATS)

    everything = set(ALONE)
    return budget(
        value(everything),
        value(set()),
        {name: value(everything - {name}) for name in ALONE},
        {name: value({name}) for name in ALONE},
        of_simulation=("b", "c"),
    )


def test_effects_and_pairs_are_found_and_add_up() -> None:
    found = made()
    for term in found.terms:
        of_pairs = sum(value for pair, value in PAIRS.items() if term.effect in pair)
        assert term.alone.mean == pytest.approx(ALONE[term.effect], abs=0.03)
        assert term.among.mean == pytest.approx(ALONE[term.effect] + of_pairs, abs=0.03)
        assert term.share.mean == pytest.approx(ALONE[term.effect] + of_pairs / 2.0, abs=0.03)
    assert found.interaction.mean == pytest.approx(sum(PAIRS.values()), abs=0.05)
    whole = found.floor.mean + sum(term.share.mean for term in found.terms) + found.rest.mean
    assert whole == pytest.approx(found.total.mean, abs=1e-9)
    assert found.adds_up and abs(found.rest.mean) < 0.05


def test_what_the_simulation_itself_makes_is_the_share_of_its_effects_repeat_by_repeat() -> None:
    found = made()
    b, c = (term.share for term in found.terms[1:])
    assert found.own.mean == pytest.approx(b.mean + c.mean, abs=1e-12)
    assert found.own.low < ALONE["b"] + ALONE["c"] + 3.0 / 2.0 - 0.5 < found.own.high
    assert found.own.high - found.own.low < 0.1


def test_what_three_make_at_once_is_no_ones_share() -> None:
    found = made(three=2.0)
    # it is in `among` of all three, so in half of each share: 2 - 3 / 2 * 2
    assert found.rest.mean == pytest.approx(2.0 - 3.0, abs=0.05) and not found.adds_up


def test_a_repeat_without_a_measure_counts_in_no_state() -> None:
    total = np.array([1.0, 2.0, np.nan])
    found = budget(total, np.zeros(3), {"a": np.array([0.0, 1.0, 2.0])}, {"a": np.ones(3)})
    assert found.total.count == 2 and found.total.mean == 1.5 and found.terms[0].among.mean == 1.0
