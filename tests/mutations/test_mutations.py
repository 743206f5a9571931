"""Broken input of every kind ends in exit 0 or 2: one message, no word of Python, no NaN, bounded memory and time."""

from __future__ import annotations

import os
from collections.abc import Iterator

import pytest

from tests.mutations.cases import WEIGHTS
from tests.mutations.runner import Runner, run_all, share

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="cases run in forks of one process")

FEW = 75
MANY = int(os.environ.get("MUTATIONS", 10_000))
"""Cases under `make validate`."""
SHOWN = 20
LONG = ("report", "option")
"""Kinds whose cases take seconds each."""


@pytest.fixture(scope="module")
def runner() -> Iterator[Runner]:
    runner = Runner()
    yield runner
    runner.close()


@pytest.mark.parametrize("kind", WEIGHTS)
def test_whole_input_is_accepted(runner: Runner, kind: str) -> None:
    """Or else the mutations of that kind show nothing."""
    verdict = runner.run(kind, 0)
    assert verdict.code == 0 and not verdict.faults, str(verdict)


@pytest.mark.parametrize(
    "kind", [pytest.param(kind, marks=pytest.mark.validation if kind in LONG else []) for kind in WEIGHTS]
)
def test_a_case_is_the_same_every_time(runner: Runner, kind: str) -> None:
    first, again = (runner.run(kind, 3) for _ in range(2))
    assert (first.command, first.code, first.faults) == (again.command, again.code, again.faults)


@pytest.mark.parametrize("kind", WEIGHTS)
def test_broken_input_ends_in_one_message(runner: Runner, kind: str) -> None:
    verdicts = [runner.run(*case) for case in share(FEW) if case[0] == kind]
    faulty = [str(verdict) for verdict in verdicts if verdict.faults]
    assert not faulty, f"{len(faulty)} of {len(verdicts)}\n" + "\n".join(faulty[:SHOWN])


@pytest.mark.validation
def test_ten_thousand_broken_inputs_end_in_one_message_each() -> None:
    """Other seeds than those of every test run; the environment variable MUTATIONS sets another number."""
    cases = share(MANY, first=FEW + 1)
    faulty = [str(verdict) for verdict in run_all(cases, len(os.sched_getaffinity(0))) if verdict.faults]
    assert not faulty, f"{len(faulty)} of {len(cases)}\n" + "\n".join(faulty[:SHOWN])
