"""A boundary in a map of two parameters: a line for each method with its interval, and the cells that it took."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from analysis.report.colour import GRID, INK, PAPER, method_colour, method_name
from analysis.study.breakdown import breaks
from studio.study.answers import Answer
from studio.study.edges import Edge
from studio.study.measures import measure_of
from studio.study.study import Sweep

DASHES = ("-", "--", "-.", ":")


def draw_edges(axes: Any, answer: Answer) -> None:
    """The cells and what lies beyond the limit are those of the first method.

    Where one column keeps the limit throughout and the next breaks it, the boundary runs between the two.
    """
    sweep, edges = answer.sweep, answer.edges
    assert sweep.limit is not None
    first = edges[0]
    _beyond(axes, sweep, first)
    for number, edge in enumerate(edges):
        lines = np.array([_values(sweep, (one.row, one.low, one.high)) for one in edge.crossings]).reshape(-1, 3)
        x = [column_value(sweep, one.column) for one in edge.crossings]
        colour = method_colour(edge.method)
        axes.fill_between(x, lines[:, 1], lines[:, 2], color=colour, alpha=0.25, lw=0)
        style: dict[str, Any] = {"ls": DASHES[number % len(DASHES)], "lw": 1.4, "color": colour}
        axes.plot(*outline(sweep, edge), label=method_name(edge.method), **style)
        axes.plot(x, lines[:, 0], ".", ms=3, color=colour)
    _cells(axes, answer, first.method)
    measure = measure_of(sweep.limit.measure)
    limit = f"{measure.label} {'above' if sweep.limit.above else 'below'} {sweep.limit.value * measure.scale:.4g}"
    axes.set_title(f"Shaded: {limit} {measure.unit}".rstrip() + f", {method_name(first.method)}", fontweight="normal")
    axes.legend()


def _cells(axes: Any, answer: Answer, method: str) -> None:
    """What was measured; apart by whether the limit is kept there, where the chart's measure is the limit's."""
    sweep, limit = answer.sweep, answer.sweep.limit
    assert limit is not None
    spots = [spot for spot in answer.spots if spot.method == method]
    broken = [breaks(limit.value, limit.above, np.array([spot.measure.mean])) for spot in spots]
    kinds: tuple[tuple[bool, str, str], ...] = ((False, INK, "kept"), (True, PAPER, "broken"))
    if limit.measure != sweep.measure:
        broken, kinds = [False] * len(spots), ((False, INK, "measured"),)
    for kind, face, label in kinds:
        places = [spot.point for spot, one in zip(spots, broken, strict=True) if one == kind]
        if places:
            style: dict[str, Any] = {"marker": "o", "ms": 2.4, "mew": 0.6, "mec": INK, "mfc": face, "zorder": 3}
            axes.plot(*zip(*places, strict=True), ls="none", label=label, **style)


def outline(sweep: Sweep, edge: Edge) -> tuple[list[float], list[float]]:
    """Where the boundary is drawn, in the chart's units; NaN where it leaves the window, as at its upper end."""
    near = _nearest(sweep, edge)
    known = [one.ending == "found" for one in edge.crossings]
    x = [column_value(sweep, one.column) for one in edge.crossings]
    across: list[float] = []
    along: list[float] = []
    for k in range(len(x)):
        if k and not known[k - 1] and not known[k] and near[k - 1] == near[k]:
            across, along = [*across, x[k]], [*along, math.nan]  # it would run along the frame
        across, along = [*across, x[k]], [*along, near[k]]
    return across, along


def column_value(sweep: Sweep, column: int) -> float:
    return sweep.vary[0].at(column / (len(sweep.vary[0].grid()) - 1))


def row_value(sweep: Sweep, row: float) -> float:
    """NaN stays NaN."""
    return sweep.vary[1].at(row / (len(sweep.vary[1].grid()) - 1))


def _values(sweep: Sweep, rows: tuple[float, ...]) -> list[float]:
    return [row_value(sweep, row) for row in rows]


def _beyond(axes: Any, sweep: Sweep, edge: Edge) -> None:
    """From the boundary to the end of each column; all or nothing of a column without one."""
    x = [column_value(sweep, one.column) for one in edge.crossings]
    axes.fill_between(x, _nearest(sweep, edge), row_value(sweep, _last(sweep)), color=GRID, lw=0, zorder=0)


def _nearest(sweep: Sweep, edge: Edge) -> list[float]:
    """By column the first value that breaks the limit: the end of the window where none does."""
    whole = {"fails": 0.0, "holds": _last(sweep)}
    return [row_value(sweep, whole.get(one.ending, one.row)) for one in edge.crossings]


def _last(sweep: Sweep) -> float:
    return len(sweep.vary[1].grid()) - 1.0
