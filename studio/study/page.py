"""A study's page: one self-contained HTML file with its charts and what they say, and each chart as a PNG."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from analysis.report.colour import method_name
from analysis.report.page import page_of
from analysis.report.style import png_uri
from analysis.report.units import counted
from render.base.csv_file import write_csv
from render.base.files import atomic_write
from studio.project.project import Project
from studio.project.templates import DESCRIPTIONS
from studio.study.answers import Answer, Broken, answers
from studio.study.boundary_table import edge_rows, edge_sentences, write_edges
from studio.study.bounds import Bound
from studio.study.budget_table import HEADER, page_rows, sentences_of, write_budgets
from studio.study.charts import chart, field_label, shown
from studio.study.kept import KEPT
from studio.study.labels import as_read, interval_text, number_text
from studio.study.measures import measure_of
from studio.study.one_phase import one_phase_doubts
from studio.study.references import HEADER as BESIDE_HEADER
from studio.study.references import Beside, beside, write_references
from studio.study.references import page_rows as page_rows_beside
from studio.study.small_images import small_image_doubts
from studio.study.store import Row
from studio.study.study import Study, Sweep, told_laser

DPI = 160
"""Of a chart, in its file and in the page."""
SURE = 0.5
"""A knee that fewer resamples have is told as not known."""
FEW = 5
"""Repeats, of which there are 126 resamples; of three there are 10, whose shares are of little worth."""


def write_page(
    folder: Path, study: Study, bases: Mapping[str, Project], rows: Mapping[str, Row]
) -> tuple[Path, list[Answer]]:
    """Write `study.html` and one PNG a chart into a folder; the page's path, and what it says."""
    found = answers(study, bases, rows)
    parts = []
    for number, answer in enumerate(found):
        if not answer.spots or (answer.sweep.chart == "budget" and not answer.budgets):
            continue  # nothing is known of it yet
        if answer.sweep.chart in KEPT and not answer.kept:
            continue
        read, labels = as_read(answer, bases.values())
        picture = png_uri(chart(read, labels), DPI)
        with atomic_write(folder / f"chart_{number + 1}.png") as temporary:
            temporary.write_bytes(base64.b64decode(picture.partition(",")[2]))
        parts.append(
            {
                "name": answer.sweep.name,
                "question": answer.sweep.question,
                "picture": picture,
                "lines": sentences(read, labels),
                "header": _header(read, labels),
                "table": _page_table(read),
            }
        )
        write_budgets(folder, answer.budgets, number + 1)
        write_bounds(folder, answer, number + 1)
        write_edges(folder, answer, number + 1)
    theirs = beside(found)
    write_references(folder, theirs)
    content = {
        "study": study,
        "beside_header": BESIDE_HEADER,
        "beside": page_rows_beside(theirs),
        "parts": parts,
        "cells": len(rows),
        "repeats": study.repeats,
        "bases": " · ".join([", ".join(_called(bases)), *told_laser(study, bases)]),
        "doubts": (*small_image_doubts(study, bases), *one_phase_doubts(study, bases)),
    }
    page = page_of(Path(__file__).parent / "page.html", content)
    with atomic_write(folder / "study.html") as temporary:
        temporary.write_text(page, encoding="utf-8")
    return folder / "study.html", found


def _called(bases: Mapping[str, Project]) -> list[str]:
    """Templates by their names, projects beside the study by their own."""
    return sorted(name if name in DESCRIPTIONS else base.name for name, base in bases.items())


def sentences(answer: Answer, labels: dict[str, str]) -> list[str]:
    """What a sweep found, in words."""
    said = [_breakdown_sentence(one, answer, labels) for one in answer.broken] + sentences_of(answer.budgets)
    if answer.edges:
        said += edge_sentences(answer, _limit_words(answer.sweep))
    said += [_bound_sentence(one, answer, labels) for one in answer.bounds]
    if answer.little and not answer.broken and answer.sweep.measure.startswith(("position_", "depth_")):
        said.append(
            f"At {answer.little} of {counted(len(answer.spots), 'point')} less than half of the line is measured: "
            "errors there are of chance finds and wrong peaks, and say little of the scanner."
        )
    if answer.front is not None and answer.front.knee is not None:
        said.append(_knee_sentence(answer, labels))
    for reference, ours in answer.beside:
        ((label, theirs, mean, interval, count),) = page_rows_beside([Beside(answer.sweep.name, reference, ours)])
        said.append(f"{label}: {theirs}; here {mean} ({interval}, {count} repeats).")
    return said


def _knee_sentence(answer: Answer, labels: dict[str, str]) -> str:
    front = answer.front
    assert front is not None and front.knee is not None
    spot, chance = answer.spots[front.knee], front.knee_probability[front.knee]
    pairs = zip(answer.sweep.vary, spot.point, strict=True)
    where = ", ".join(f"{field_label(one, labels)} {shown(value)}" for one, value in pairs)
    at = f"{method_name(spot.method)}, {where}"
    repeats = min(one.measure.count for one in answer.spots if one.measure.count)
    of = f"{chance:.0%} of the resamples of {counted(repeats, 'repeat')}"
    if chance < SURE:
        return (
            f"Where more processor time stops paying is not known: the knee of the front is at {at}, in {of} only; "
            "more repeats, or values further apart, would tell."
        )
    if repeats < FEW:
        return (
            f"More processor time seems to pay most up to the knee of the front, at {at}, in {of}: so few repeats have "
            "hardly any others, and more of them may name another knee."
        )
    return f"More processor time pays most up to the knee of the front, at {at}, in {of}."


def _limit_words(sweep: Sweep) -> str:
    assert sweep.limit is not None
    measure = measure_of(sweep.limit.measure)
    limit = f"{measure.label} {'below' if sweep.limit.above else 'above'} {sweep.limit.value * measure.scale:.4g}"
    return f"{limit} {measure.unit}".rstrip()


def _breakdown_sentence(found: Broken, answer: Answer, labels: dict[str, str]) -> str:
    sweep, ended = answer.sweep, found.breakdown
    limit, parameter = _limit_words(sweep), field_label(sweep.vary[0], labels)
    name = method_name(found.method)
    if ended.ending == "holds":
        return f"{name}: {limit} holds as far as {parameter} {shown(ended.last_good)}."
    if ended.ending == "fails":
        return f"{name}: {limit} is not kept even at {parameter} {shown(ended.first_bad)}."
    low, high = sorted((ended.last_good, ended.first_bad))
    interval = f"95 % interval {shown(ended.low)} to {shown(ended.high)}"
    if not found.ended:
        interval = f"so far between {shown(low)} and {shown(high)}"
    downwards = ended.first_bad < ended.last_good
    holds, past = ("needs at least", "below that") if downwards else ("holds up to", "above that")
    return f"{name}: {limit} {holds} {parameter} {shown(ended.value)} ({interval}); {past}, {found.cause}."


def _bound_sentence(found: Bound, answer: Answer, labels: dict[str, str]) -> str:
    pairs = zip(answer.sweep.vary, found.point, strict=True)
    where = ", ".join(f"{field_label(one, labels)} {shown(value)}" for one, value in pairs)
    at = f" at {where}" if len(answer.bounds) > 1 else ""
    measure = measure_of(answer.sweep.measure)
    photons = f"{found.photons * measure.scale:.3g} {measure.unit}"
    speckle = "" if found.speckle is None else f", and speckle {found.speckle * measure.scale:.3g} {measure.unit}"
    return (
        f"No method that takes each scan line by itself does better{at}: photon and read noise alone leave a depth "
        f"sigma of {photons}{speckle}."
    )


def write_bounds(folder: Path, answer: Answer, number: int) -> None:
    """`bounds_N.csv`, in m, of a chart that has some."""
    if not answer.bounds:
        return
    header = [*(one.field for one in answer.sweep.vary), "photons_m", "speckle_m"]
    rows = ([*one.point, one.photons, one.speckle] for one in answer.bounds)
    write_csv(folder / f"bounds_{number}.csv", header, rows)


def _header(answer: Answer, labels: dict[str, str]) -> list[str]:
    if answer.budgets:
        return list(HEADER)
    if answer.edges:
        first, second = (field_label(one, labels) for one in answer.sweep.vary)
        return [first, "method", second, "95 % interval", "limit"]
    return [*(field_label(one, labels) for one in answer.sweep.vary), "method", *columns(answer)]


def _page_table(answer: Answer) -> list[list[str]]:
    if answer.budgets:
        return page_rows(answer.budgets[0])
    if not answer.edges:
        return table(answer)
    rows = edge_rows(answer.sweep, answer.edges)
    return [
        [shown(x), method_name(method), number_text(y), interval_text(low, high), ending]
        for x, method, y, low, high, ending in rows
    ]


def columns(answer: Answer) -> list[str]:
    """Headings of `table`, after those of the fields and the method."""
    measure = measure_of(answer.sweep.measure)
    unit = f" ({measure.unit})" if measure.unit else ""
    columns = [f"{measure.label}{unit}", "95 % interval", "repeats", "processor time (s)", "time in rays (million)"]
    return [*columns, "on the front"] if answer.front is not None else columns


def table(answer: Answer) -> list[list[str]]:
    """A row for each spot of a chart, as text: its values, method, mean, interval, repeats and seconds."""
    scale, rows = measure_of(answer.sweep.measure).scale, []
    for number, spot in enumerate(answer.spots):
        one = spot.measure
        row: list[Any] = [*map(shown, spot.point), method_name(spot.method), number_text(one.mean * scale)]
        row += [
            interval_text(one.low * scale, one.high * scale),
            one.count,
            number_text(spot.seconds),
            number_text(spot.rays),
        ]
        if answer.front is not None:
            row.append(f"{answer.front.member_probability[number]:.0%}")
        rows.append([str(cell) for cell in row])
    return rows
