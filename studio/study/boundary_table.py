"""A boundary in numbers: rows for the page, a CSV file in the project's units, and what it says in words."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from analysis.report.colour import method_name
from render.base.csv_file import write_csv
from studio.study.answers import Answer
from studio.study.boundary_chart import column_value, row_value
from studio.study.cells import lattice_of
from studio.study.edges import Edge
from studio.study.study import Sweep

Row = tuple[float, str, float, float, float, str]
"""First parameter, method, boundary in the second, its interval, ending."""


def edge_rows(sweep: Sweep, edges: Sequence[Edge]) -> list[Row]:
    """A row for each column of each method; NaN where the column has no boundary."""
    rows: list[Row] = []
    for edge in edges:
        for one in edge.crossings:
            low, high = sorted(row_value(sweep, row) for row in (one.low, one.high))
            rows.append(
                (column_value(sweep, one.column), edge.method, row_value(sweep, one.row), low, high, one.ending)
            )
    return rows


def write_edges(folder: Path, answer: Answer, number: int) -> None:
    """`boundary_N.csv`, of a chart that has some."""
    if not answer.edges:
        return
    fields = [one.field for one in answer.sweep.vary]
    header = [fields[0], "method", fields[1], "low", "high", "ending"]
    write_csv(folder / f"boundary_{number}.csv", header, edge_rows(answer.sweep, answer.edges))


def edge_sentences(answer: Answer, limit: str) -> list[str]:
    """limit: what is to hold, in words."""
    return [_sentence(answer.sweep, edge, limit) for edge in answer.edges]


def _sentence(sweep: Sweep, edge: Edge, limit: str) -> str:
    lattice = lattice_of(sweep)
    all_cells, known = lattice.columns * lattice.rows, len(edge.crossings)
    count = {ending: sum(one.ending == ending for one in edge.crossings) for ending in ("found", "holds", "fails")}
    others = [
        f"{count[ending]} {words}"
        for ending, words in (("holds", "keep it throughout"), ("fails", "break it throughout"))
        if count[ending]
    ]
    known_of = f"{known} columns" if known == lattice.columns else f"{known} of {lattice.columns} columns so far"
    return (
        f"{method_name(edge.method)}: {limit} has its boundary in {count['found']} of {known_of}"
        f"{'; ' if others else ''}{', '.join(others)}. It took {edge.cells} of the map's {all_cells} cells "
        f"({edge.cells / all_cells:.0%})."
    )
