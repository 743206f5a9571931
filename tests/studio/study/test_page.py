"""What a study's page says of a chart in words."""

from __future__ import annotations

import numpy as np

from analysis.study.breakdown import Breakdown
from analysis.study.intervals import Interval
from analysis.study.pareto import Front
from studio.study.answers import Answer, Broken, Spot
from studio.study.page import sentences
from studio.study.study import Limit, Parameter, Sweep

EXPOSURES = (0.001, 0.002, 0.004)


def test_errors_of_chance_finds_are_told_as_such() -> None:
    """A tidy curve of metres stood without a word, of a line of which an eighth was found."""
    sweep = Sweep(name="light", vary=(Parameter(field="sensor.exposure_time", values=EXPOSURES),), measure="depth_p95")
    spots = tuple(Spot((value,), "likelihood", Interval(7.0, 6.0, 8.0, 8), 1.0) for value in EXPOSURES)
    (told,) = sentences(Answer(sweep, spots, None, (), little=2), {})
    assert told.startswith("At 2 of 3 points less than half of the line is measured")
    assert not sentences(Answer(sweep, spots, None, ()), {})
    of_share = sweep.model_copy(update={"measure": "completeness"})
    assert not sentences(Answer(of_share, spots, None, (), little=2), {})


def told_of(search: tuple[float, float], found: Breakdown, *, ended: bool) -> str:
    parameter = Parameter(field="sensor.exposure_time", low=search[0], high=search[1], label="Exposure (ms)")
    limit = Limit(measure="completeness", value=0.9, above=False)
    sweep = Sweep(name="s", vary=(parameter,), sampling="bisection", measure="completeness", limit=limit)
    (told,) = sentences(Answer(sweep, (), None, (Broken("likelihood", found, "starved", ended),)), {})
    return told


def test_a_limit_is_told_by_the_side_on_which_it_is_kept() -> None:
    """A search from 2 down to 0.001 ms said that the limit holds "up to" 0.0219, and is broken "beyond"."""
    down = Breakdown("found", 0.0219, 0.0201, 0.0242, 0.0278, 0.0173)
    told = told_of((2.0, 0.001), down, ended=True)
    assert "needs at least Exposure (ms) 0.0219 (95 % interval 0.0201 to 0.0242); below that, starved." in told
    up = Breakdown("found", 0.0219, 0.0201, 0.0242, 0.0173, 0.0278)
    told = told_of((0.001, 2.0), up, ended=True)
    assert "holds up to Exposure (ms) 0.0219 (95 % interval 0.0201 to 0.0242); above that, starved." in told


def test_a_search_under_way_tells_its_bracket_as_such() -> None:
    found = Breakdown("found", 0.0219, 0.0173, 0.0278, 0.0278, 0.0173)
    told = told_of((2.0, 0.001), found, ended=False)
    assert "(so far between 0.0173 and 0.0278)" in told and "95 %" not in told


def knee_told(repeats: int, chance: float) -> str:
    points = (1.0, 2.0, 4.0)
    sweep = Sweep(
        name="speed",
        vary=(Parameter(field="sensor.exposure_time", values=points, label="Exposure time (ms)"),),
        chart="speed",
        measure="depth_p95",
    )
    spots = tuple(Spot((value,), "likelihood", Interval(1.0, 0.9, 1.1, repeats), 1.0) for value in points)
    of_all = np.array([0.0, chance, 1.0 - chance])
    front = Front(np.ones(3, np.bool_), np.ones(3), 1, of_all)
    (told,) = sentences(Answer(sweep, spots, front, ()), {})
    return told


def test_a_knee_says_of_how_many_repeats_it_is_and_that_time_is_the_processors() -> None:
    """ "More time pays up to Exposure time 2" read as if the exposure were meant."""
    told = knee_told(8, 0.91)
    assert told.startswith("More processor time pays most up to the knee of the front, at ")
    assert "Exposure time (ms) 2, in 91% of the resamples of 8 repeats." in told


def test_a_knee_of_few_repeats_is_doubted() -> None:
    """With 3 repeats one method was named by 91 % of the resamples, and another one with 8."""
    assert "seems to pay" in knee_told(3, 0.91) and "resamples of 3 repeats" in knee_told(3, 0.91)
    assert "seems" not in knee_told(5, 0.91)
    assert "is not known" in knee_told(3, 0.4) and "is not known" in knee_told(8, 0.4)
