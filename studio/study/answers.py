"""What a study found, as numbers: intervals for every chart, front and knee, breakdowns with their cause."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from analysis.report.summary import LITTLE
from analysis.study.breakdown import Breakdown, breakdown, next_values
from analysis.study.budget import Budget, budget
from analysis.study.cause import cause
from analysis.study.intervals import Interval, mean_interval, positive_interval
from analysis.study.pareto import Front, bootstrapped_front
from studio.project.project import Project
from studio.scan.stages import scaled
from studio.study.bounds import Bound, bounds
from studio.study.cells import Point, along, methods_of, search_of, searched
from studio.study.edges import Edge, edges_of
from studio.study.effects import NONE, OF_SIMULATION, ONLY, TOTAL, WITHOUT, effects_of
from studio.study.kept import ROW as KEPT_ROW
from studio.study.measures import MEASURES, measure_of
from studio.study.ray_units import RAY_SPEED, Throughput, throughput
from studio.study.store import Row
from studio.study.study import Reference, Study, Sweep, with_fields
from studio.study.tables import grouped, rays_of, seconds_of, values_of

Groups = dict[tuple[Point, str], list[Row]]


@dataclass(frozen=True)
class Spot:
    """One mark of a chart: a point of a sweep by one method, with what its repeats say."""

    point: Point
    method: str
    measure: Interval
    seconds: float
    """Median processor seconds of the frame, or of its line."""
    rays: float = float("nan")
    """Median of the same in million rays of the machine's own."""


@dataclass(frozen=True)
class Broken:
    """Where one method breaks along a bisected sweep."""

    method: str
    breakdown: Breakdown
    cause: str
    """In a word; empty: it does not break."""
    ended: bool = True
    """False: the search still has values to ask for, and knows no more than between which two it breaks."""


@dataclass(frozen=True)
class ErrorBudget:
    """What each effect makes of the depth error, by one method: of its bias, m, and of its variance, m^2.

    Of the rows that are measured right; the others are counted.
    """

    method: str
    bias: Budget
    variance: Budget
    wrong_rows: float = 0.0
    """Of those to be seen, with all effects."""


@dataclass(frozen=True)
class KeptCell:
    """The first repeat of a point by one method, and what was kept of it (`studio.study.kept`)."""

    point: Point
    method: str
    content: Any


@dataclass(frozen=True)
class Answer:
    """Of one sweep."""

    sweep: Sweep
    spots: tuple[Spot, ...]
    front: Front | None
    """Of a chart of speed, in the order of the spots."""
    broken: tuple[Broken, ...]
    """Of a bisection, by method."""
    budgets: tuple[ErrorBudget, ...] = ()
    """Of effects, by method."""
    bounds: tuple[Bound, ...] = ()
    """Of a chart of speed: what no method can beat."""
    throughput: Throughput | None = None
    """Of a chart of speed; None: of rows that were measured before it was."""
    edges: tuple[Edge, ...] = ()
    """Of a boundary, by method."""
    kept: tuple[KeptCell, ...] = ()
    """Of a chart of profiles or pictures."""
    beside: tuple[tuple[Reference, Interval], ...] = ()
    """Figures of others, and what is measured there."""
    image_scale: float = 1.0
    """At which the cells were measured."""
    little: int = 0
    """Spots at which less than half of the line is measured."""


def answers(study: Study, bases: Mapping[str, Project], rows: Mapping[str, Row]) -> list[Answer]:
    """One for each sweep, of the cells that are measured so far."""
    return [_answer(study, number, bases, rows) for number in range(len(study.sweeps))]


def _answer(study: Study, number: int, bases: Mapping[str, Project], rows: Mapping[str, Row]) -> Answer:
    sweep = study.sweeps[number]
    groups = grouped(study, bases, rows, number)
    errors = [values_of(found, sweep.measure) for found in groups.values()]
    times = [seconds_of(found, sweep.time) for found in groups.values()]
    units = [rays_of(found, sweep.time) for found in groups.values()]
    spots = tuple(
        Spot(
            point,
            method,
            _interval(sweep.measure, error),
            _median(time[np.isfinite(error)]),
            _median(unit[np.isfinite(error)]),
        )
        for (point, method), error, time, unit in zip(groups, errors, times, units, strict=True)
    )
    front = bootstrapped_front(times, errors) if sweep.chart == "speed" and spots else None
    return Answer(
        sweep,
        spots,
        front,
        _broken(study, number, bases, rows, groups),
        _budgets(sweep, study, bases, groups),
        bounds(study, sweep, bases, list(dict.fromkeys(spot.point for spot in spots))),
        _throughput(study, sweep, bases, groups),
        edges_of(study, number, bases, rows),
        tuple(KeptCell(*at, row[KEPT_ROW]) for at, found in groups.items() for row in found if row.get(KEPT_ROW)),
        _beside(sweep, methods_of(study, sweep)[0], groups),
        study.image_scale,
        sum(mean_interval(values_of(found, "completeness")).mean < LITTLE for found in groups.values()),
    )


def _interval(measure: str, values: np.ndarray) -> Interval:
    return (mean_interval if measure_of(measure).signed else positive_interval)(values)


def _beside(sweep: Sweep, first: str, groups: Groups) -> tuple[tuple[Reference, Interval], ...]:
    found = []
    for one in sweep.references:
        rows = groups.get((one.point, one.method or first))
        if rows:
            found.append((one, _interval(one.measure, values_of(rows, one.measure))))
    return tuple(found)


def _throughput(study: Study, sweep: Sweep, bases: Mapping[str, Project], groups: Groups) -> Throughput | None:
    if sweep.chart != "speed":
        return None
    base, least = bases[sweep.base or study.base], math.inf
    for point in dict.fromkeys(point for point, _ in groups):
        values = dict(zip((one.field for one in sweep.vary), point, strict=True))
        camera = scaled(with_fields(base, {**study.set, **sweep.set, **values}, sweep.name), study.image_scale).scene
        least = min(least, camera.rig.camera.width * camera.rig.camera.height)
    return throughput([row.get(RAY_SPEED, math.nan) for rows in groups.values() for row in rows], least)


def _median(values: np.ndarray) -> float:
    known = values[np.isfinite(values)]
    return float(np.median(known)) if len(known) else float("nan")


def _budgets(sweep: Sweep, study: Study, bases: Mapping[str, Project], groups: Groups) -> tuple[ErrorBudget, ...]:
    """Of the methods that are measured in all states."""
    if sweep.sampling != "effects":
        return ()
    base = with_fields(bases[sweep.base or study.base], {**study.set, **sweep.set}, sweep.name)
    effects, found = effects_of(base.in_folder(bases[sweep.base or study.base].folder)), []
    for method in methods_of(study, sweep):
        states = {str(point[0]): rows for (point, of), rows in groups.items() if of == method}
        needed = (TOTAL, NONE, *(WITHOUT + name for name in effects), *(ONLY + name for name in effects))
        if any(len(states.get(state, ())) < study.repeats for state in needed):
            continue

        # one row that takes a ghost for the line would make more of the variance than all effects together
        bias = {state: values_of(states[state], "depth_bias_right") for state in needed}
        variance = {state: values_of(states[state], "depth_sigma_right") ** 2 for state in needed}
        wrong = mean_interval(values_of(states[TOTAL], "wrong_rows")).mean
        found.append(ErrorBudget(method, _made(bias, effects), _made(variance, effects), wrong))
    return tuple(found)


def _made(values: Mapping[str, np.ndarray], effects: list[str]) -> Budget:
    return budget(
        values[TOTAL],
        values[NONE],
        {name: values[WITHOUT + name] for name in effects},
        {name: values[ONLY + name] for name in effects},
        OF_SIMULATION,
    )


def _broken(
    study: Study, number: int, bases: Mapping[str, Project], rows: Mapping[str, Row], groups: Groups
) -> tuple[Broken, ...]:
    sweep = study.sweeps[number]
    if sweep.sampling != "bisection":
        return ()
    search, found = search_of(sweep), []
    for method in methods_of(study, sweep):
        known = along(searched(study, number, method, bases, rows))
        if not {search.good, search.bad} <= known.keys():
            continue
        ended = breakdown(search, known)
        why = ""
        if ended.ending == "found":
            good, bad = (groups[(value,), method] for value in (search.good, ended.first_bad))
            why = cause(_means(good), _means(bad))
        found.append(Broken(method, ended, why, not next_values(search, known)))
    return tuple(found)


def _means(rows: list[Row]) -> dict[str, float]:
    names = [name for name in MEASURES if name in rows[0]]
    return {name: mean_interval(values_of(rows, name)).mean for name in names}
