"""What a study will take before it runs: cells, renders, time and disk."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from studio.project.project import Project
from studio.study.begin import study_bytes
from studio.study.cells import (
    Cell,
    Point,
    cells_at,
    check_size,
    light_key,
    methods_of,
    next_cells,
    next_points,
    points,
    searched,
)
from studio.study.left_over import left_over
from studio.study.one_phase import one_phase_doubts
from studio.study.searching import most_to_come
from studio.study.small_images import small_image_doubts
from studio.study.store import Row
from studio.study.study import SEARCHES, Study
from studio.study.tables import CALIBRATING, LOAD, SECONDS, measured_cells
from studio.study.tasks import tasks

NOISE_APART = (
    "Each value takes a render of its own, as well as its noise asks for (goal in depth). With the goal “errors of the "
    "image”, in Render, values of sensor, laser power or extraction share one, and the study is sooner done."
)
"""Said of values that would share one, had they no goal."""

Costs = tuple[float, float]
"""Seconds that a worker takes for a render, and for developing and measuring one cell of it."""


@dataclass(frozen=True)
class Estimate:
    """Of what is still to be measured."""

    cells: int
    renders: int
    searched: int
    """Cells that the searches may ask for beside those."""
    seconds: float | None
    """Of one worker; None: no cell of some sweep was timed yet."""
    bytes: int
    """Of the whole folder in the end."""
    steps: int = 1
    """Of the longest motion of its projects, of which every cell measures the first."""
    doubts: tuple[str, ...] = ()
    """What figures at its image scale are worth."""
    left_over: int = 0
    """Cells of the folder with values that are no longer asked for."""
    start_up: float = 0.0
    """s until the workers begin, whatever there is to do."""

    def wall(self, workers: int) -> float | None:
        """s from the run's begin to its end, on so many workers."""
        return None if self.seconds is None else self.start_up + self.seconds / workers


def estimate(
    study: Study, bases: Mapping[str, Project], rows: Mapping[str, Row], timed: Mapping[str, Costs]
) -> Estimate:
    """timed: `costs` by the sweep's name, for sweeps without rows. InputError: a field or value that does not fit."""
    check_size(study)
    missing = next_cells(study, bases, rows)
    cells, renders, to_come, seconds = 0, 0, 0, 0.0
    for number, sweep in enumerate(study.sweeps):
        mine = [cell for cell in missing if cell.sweep == number]
        frames = len(tasks(mine, study.image_scale, study.laser))
        more = _searched(study, number, bases, rows) if sweep.sampling in SEARCHES and mine else 0
        cells, renders, to_come = cells + len(mine), renders + frames, to_come + more
        cost = _known(study, number, bases, rows) or timed.get(sweep.name)
        if mine:
            # what a search asks for comes one value at a time, so each cell may take a render
            taken = math.nan if cost is None else (frames + more) * cost[0] + (len(mine) + more) * cost[1]
            seconds += taken
    size = study_bytes(study, len(rows) + cells + to_come)
    steps = max(base.scene.frame_count for base in bases.values())
    known = None if math.isnan(seconds) else seconds
    doubts = (
        *small_image_doubts(study, bases),
        *one_phase_doubts(study, bases),
        *_not_shared(missing),
        *_noise_apart(study, missing),
    )
    return Estimate(cells, renders, to_come, known, size, steps, doubts, left_over(study, bases, rows))


def _searched(study: Study, number: int, bases: Mapping[str, Project], rows: Mapping[str, Row]) -> int:
    """Cells that the searches of a sweep may ask for beside those that they ask for now."""
    sweep, points = study.sweeps[number], 0
    for method in methods_of(study, sweep):
        known = searched(study, number, method, bases, rows)
        if now := next_points(sweep, known):
            points += most_to_come(sweep, len(known) + len(now))
    return points * study.repeats


def _not_shared(cells: Sequence[Cell]) -> tuple[str, ...]:
    """Why cells that differ in their method alone do not share a render."""
    methods = {cell.project.extraction.method for cell in cells if cell.project.render.goal is not None}
    if len(methods) < 2:
        return ()
    return (
        "Each method has renders of its own, as each is rendered for its own depth (goal in depth); with the goal "
        "“errors of the image” one serves all.",
    )


def _noise_apart(study: Study, cells: Sequence[Cell]) -> tuple[str, ...]:
    """Why points of a sweep that would share a render without a goal in depth have renders of their own."""
    # one of each point, as its methods and repeats are not told apart by its values
    of_points: dict[tuple[int, Point], Cell] = {(cell.sweep, cell.point): cell for cell in cells}
    light: set[tuple[int, str]] = set()
    for cell in of_points.values():
        if cell.varied.render.goal is None:
            continue
        key = cell.sweep, light_key(cell, study.image_scale)
        if key in light:
            return (NOISE_APART,)
        light.add(key)
    return ()


def costs(study: Study, bases: Mapping[str, Project], number: int) -> Costs:
    """What a cell of a sweep takes, by measuring its first point by every method.

    InputError: a field or value that does not fit.
    """
    from studio.study.measuring import measure_task, warm_up  # takes a while: not before a cell is measured

    sweep = study.sweeps[number]
    wanted = [(sweep.vary[0].low,)] if sweep.sampling == "bisection" else points(sweep)[:1]
    cells = [cell for cell in cells_at(study, number, bases, wanted) if cell.repeat == 0]
    warm_up(cells[0].project)
    # a second time, as the first one loads what each method takes
    (task,) = tasks([*cells, *cells], study.image_scale, study.laser)
    began, busy = time.monotonic(), time.process_time()
    found = [_split({**dict.fromkeys(SECONDS, 0.0), **seconds}) for _, _, seconds in measure_task(task)]
    load = (time.monotonic() - began) / max(time.process_time() - busy, 1e-9)
    render, measure = max(load, 1.0) * np.mean(found[len(cells) :], axis=0)
    return float(render), float(measure)


def _known(study: Study, number: int, bases: Mapping[str, Project], rows: Mapping[str, Row]) -> Costs | None:
    """By the cells of the sweep that are measured: the median of each method, as methods differ by far.

    On a machine as busy with others as it was then.
    """
    found: dict[str, list[Costs]] = {}
    loads: list[float] = []
    for cell, row in measured_cells(study, number, bases, rows):
        if SECONDS[-1] in row:
            found.setdefault(cell.method, []).append(_split(row))
            loads.append(row.get(LOAD, 1.0))
    if not found:
        return None
    # less than 1: the render was there already
    load = max(float(np.median(loads)), 1.0)
    render, measure = load * np.mean([np.median(one, axis=0) for one in found.values()], axis=0)
    return float(render), float(measure)


def _split(seconds: Mapping[str, float]) -> Costs:
    return seconds[SECONDS[0]], sum(seconds[name] for name in SECONDS[1:]) + seconds.get(CALIBRATING, 0.0)
