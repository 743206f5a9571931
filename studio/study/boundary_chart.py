"""A boundary in a map of two parameters: a line for each method with its interval, and the cells that it took."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from analysis.report.colour import GRID, INK, PAPER, method_colour, method_name
from analysis.study.breakdown import breaks
from studio.study.answers import Answer
from studio.study.edges import Edge
from studio.study.study import Sweep

DASHES = ("-", "--", "-.", ":")


def draw_edges(axes: Any, answer: Answer) -> None:
    """The cells and what lies beyond the limit are those of the first method."""
    sweep, edges = answer.sweep, answer.edges
    assert sweep.limit is not None
    first = edges[0]
    _beyond(axes, sweep, first)
    for number, edge in enumerate(edges):
        lines = np.array([_values(sweep, (one.row, one.low, one.high)) for one in edge.crossings]).reshape(-1, 3)
        x = [column_value(sweep, one.column) for one in edge.crossings]
        colour = method_colour(edge.method)
        axes.fill_between(x, lines[:, 1], lines[:, 2], color=colour, alpha=0.25, lw=0)
        style: dict[str, Any] = {"ls": DASHES[number % len(DASHES)], "lw": 1.4, "marker": ".", "ms": 3}
        axes.plot(x, lines[:, 0], color=colour, label=method_name(edge.method), **style)
    same = sweep.limit.measure == sweep.measure
    for spot in answer.spots:
        if spot.method == first.method:
            broken = same and breaks(sweep.limit.value, sweep.limit.above, np.array([spot.measure.mean]))
            style = {"marker": "o", "ms": 2.4, "mew": 0.6, "mec": INK, "mfc": PAPER if broken else INK, "zorder": 3}
            axes.plot(*spot.point, **style)
    axes.set_title("Shaded: beyond the limit", fontweight="normal")
    axes.legend()


def column_value(sweep: Sweep, column: int) -> float:
    return sweep.vary[0].at(column / (len(sweep.vary[0].grid()) - 1))


def row_value(sweep: Sweep, row: float) -> float:
    """NaN stays NaN."""
    return sweep.vary[1].at(row / (len(sweep.vary[1].grid()) - 1))


def _values(sweep: Sweep, rows: tuple[float, ...]) -> list[float]:
    return [row_value(sweep, row) for row in rows]


def _beyond(axes: Any, sweep: Sweep, edge: Edge) -> None:
    """From the boundary to the end of each column; all or nothing of a column without one."""
    whole = {
        "found": math.nan,
        "fails": row_value(sweep, 0.0),
        "holds": row_value(sweep, len(sweep.vary[1].grid()) - 1),
    }
    near = [row_value(sweep, one.row) if one.ending == "found" else whole[one.ending] for one in edge.crossings]
    x = [column_value(sweep, one.column) for one in edge.crossings]
    axes.fill_between(x, near, whole["holds"], color=GRID, lw=0, zorder=0)
