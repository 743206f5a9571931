"""Figures of others beside a study's own: what a paper or a data sheet says of a point, and what is measured there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from analysis.study.intervals import Interval
from render.base.csv_file import write_csv
from studio.study.answers import Answer
from studio.study.labels import interval_text, number_text
from studio.study.measures import measure_of
from studio.study.study import Reference

HEADER = ("what", "theirs", "ours", "95 % interval", "repeats")


@dataclass(frozen=True)
class Beside:
    """One line of the table, in the measure's SI unit."""

    sweep: str
    reference: Reference
    ours: Interval


def beside(answers: Sequence[Answer]) -> list[Beside]:
    """Of every reference whose point is measured, in order."""
    return [Beside(answer.sweep.name, reference, found) for answer in answers for reference, found in answer.beside]


def page_rows(found: Sequence[Beside]) -> list[list[str]]:
    """Below HEADER."""
    rows = []
    for one in found:
        measure = measure_of(one.reference.measure)
        scale = measure.scale
        theirs, mean = (number_text(value * scale, 3) for value in (one.reference.value, one.ours.mean))
        within = interval_text(one.ours.low * scale, one.ours.high * scale, 3)
        unit = f" {measure.unit}".rstrip()
        rows.append([one.reference.label, theirs + unit, mean + unit, within, str(one.ours.count)])
    return rows


def write_references(folder: Path, found: Sequence[Beside]) -> None:
    """`references.csv` in SI units, where there are any."""
    if not found:
        return
    rows = []
    for one in found:
        theirs, ours = one.reference, one.ours
        said = [one.sweep, theirs.label, theirs.measure, theirs.value, ours.mean, ours.low, ours.high, ours.count]
        rows.append(said)
    write_csv(
        folder / "references.csv", ["sweep", "label", "measure", "theirs", "ours", "low", "high", "repeats"], rows
    )
