"""What a study found, as numbers: intervals for every chart, front and knee, breakdowns with their cause."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from analysis.study.breakdown import Breakdown, breakdown
from analysis.study.cause import cause
from analysis.study.intervals import Interval, mean_interval
from analysis.study.pareto import Front, bootstrapped_front
from studio.project.project import Project
from studio.study.cells import Point, measured_along, methods_of, search_of
from studio.study.store import Row
from studio.study.study import Study, Sweep
from studio.study.tables import grouped, seconds_of, values_of

Groups = dict[tuple[Point, str], list[Row]]


@dataclass(frozen=True)
class Spot:
    """One mark of a chart: a point of a sweep by one method, with what its repeats say."""

    point: Point
    method: str
    measure: Interval
    seconds: float
    """Median processor seconds of the frame, or of its line."""


@dataclass(frozen=True)
class Broken:
    """Where one method breaks along a bisected sweep."""

    method: str
    breakdown: Breakdown
    cause: str
    """In a word; empty: it does not break."""


@dataclass(frozen=True)
class Answer:
    """Of one sweep."""

    sweep: Sweep
    spots: tuple[Spot, ...]
    front: Front | None
    """Of a chart of speed, in the order of the spots."""
    broken: tuple[Broken, ...]
    """Of a bisection, by method."""


def answers(study: Study, bases: Mapping[str, Project], rows: Mapping[str, Row]) -> list[Answer]:
    """One for each sweep, of the cells that are measured so far."""
    return [_answer(study, number, bases, rows) for number in range(len(study.sweeps))]


def _answer(study: Study, number: int, bases: Mapping[str, Project], rows: Mapping[str, Row]) -> Answer:
    sweep = study.sweeps[number]
    groups = grouped(study, bases, rows, number)
    errors = [values_of(found, sweep.measure) for found in groups.values()]
    times = [seconds_of(found, sweep.time) for found in groups.values()]
    spots = tuple(
        Spot(point, method, mean_interval(error), float(np.median(time)))
        for (point, method), error, time in zip(groups, errors, times, strict=True)
    )
    front = bootstrapped_front(times, errors) if sweep.chart == "speed" and spots else None
    return Answer(sweep, spots, front, _broken(study, number, bases, rows, groups))


def _broken(
    study: Study, number: int, bases: Mapping[str, Project], rows: Mapping[str, Row], groups: Groups
) -> tuple[Broken, ...]:
    sweep = study.sweeps[number]
    if sweep.sampling != "bisection":
        return ()
    search, found = search_of(sweep), []
    for method in methods_of(study, sweep):
        known = measured_along(study, number, method, bases, rows)
        if not {search.good, search.bad} <= known.keys():
            continue
        ended = breakdown(search, known)
        why = ""
        if ended.ending == "found":
            good, bad = (groups[(value,), method] for value in (search.good, ended.first_bad))
            why = cause(_means(good), _means(bad))
        found.append(Broken(method, ended, why))
    return tuple(found)


def _means(rows: list[Row]) -> dict[str, float]:
    names = [name for name, value in rows[0].items() if not isinstance(value, str)]
    return {name: mean_interval(values_of(rows, name)).mean for name in names}
