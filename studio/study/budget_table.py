"""An error budget in numbers: rows for the page, a CSV and a JSON file in SI units, and what it says in words."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path

from analysis.report.colour import method_name
from analysis.study.budget import Budget
from analysis.study.intervals import NOTHING, Interval
from render.base.csv_file import write_csv
from render.base.files import atomic_write
from studio.project.strict_json import pretty
from studio.study.answers import ErrorBudget
from studio.study.labels import interval_text, number_text

HEADER = ("effect", "bias (µm)", "95 % interval", "alone", "variance (%)", "95 % interval", "alone", "among others")
COLUMNS = (
    *("method", "measure", "unit", "effect", "share", "share_low", "share_high"),
    *("alone", "alone_low", "alone_high", "among", "among_low", "among_high"),
)
LARGEST = 0.1
"""Of the variance, that the simulation itself may add."""


def write_budgets(folder: Path, budgets: Sequence[ErrorBudget], number: int) -> list[Path]:
    """`budget_N.csv` and `budget_N.json` in m and m^2; their paths. None: nothing is known yet."""
    if not budgets:
        return []
    rows = [row for one in budgets for row in _rows(one)]
    data = {"budget": [dict(zip(COLUMNS, row, strict=True)) for row in rows], "says": sentences_of(budgets)}
    paths = [folder / f"budget_{number}.csv", folder / f"budget_{number}.json"]
    write_csv(paths[0], COLUMNS, rows)
    with atomic_write(paths[1]) as temporary:
        temporary.write_text(pretty(data) + "\n", encoding="utf-8")
    return paths


def page_rows(found: ErrorBudget) -> list[list[str]]:
    """Below HEADER."""
    of_all = 100.0 / found.variance.total.mean if found.variance.total.mean > 0.0 else math.nan
    rows = []
    for bias, variance in zip(_named(found.bias), _named(found.variance), strict=True):
        (name, one, bias_alone, _), (_, other, alone, among) = bias, variance
        cells = [name, _number(one.mean, 1e6), _interval(one, 1e6), _number(bias_alone, 1e6)]
        cells += [_number(other.mean, of_all), _interval(other, of_all), _number(alone, of_all), _number(among, of_all)]
        rows.append(cells)
    return rows


def sentences_of(budgets: Sequence[ErrorBudget]) -> list[str]:
    """What budgets say, a few sentences for each method."""
    return [sentence for one in budgets for sentence in _sentences(one)]


def simulation_share(found: ErrorBudget) -> Interval:
    """Of the variance, what no real scanner would have."""
    own, total = found.variance.own, found.variance.total.mean
    return Interval(own.mean / total, own.low / total, own.high / total, own.count) if total > 0.0 else NOTHING


def _sentences(found: ErrorBudget) -> Iterator[str]:
    total, name = found.variance.total.mean, method_name(found.method)
    largest = sorted(found.variance.terms, key=lambda term: -term.share.mean)[:3]
    made = ", ".join(f"{term.effect} {term.share.mean / total:.0%}" for term in largest if term.share.mean > 0.0)
    bias = found.bias.total
    yield (
        f"{name}: sigma {math.sqrt(total) * 1e6:.3g} µm; most of its variance is made by {made}. "
        f"Bias {bias.mean * 1e6:+.3g} µm ({_interval(bias, 1e6)})."
    )
    if found.wrong_rows > 0.0:
        yield f"{found.wrong_rows:.2%} of the rows are measured wrong, by more than a pixel, and left out of all this."
    yield "Rows at the ends of the line, which light covers in part, are left out of it too."
    yield (
        f"Effects that meet make {found.variance.interaction.mean / total:+.0%} of the variance, "
        f"half of which counts for each."
    )
    own = simulation_share(found)
    if own.high < LARGEST:
        verdict = "below a tenth."
    elif own.low > LARGEST:
        verdict = "more than a tenth; ask the render for smaller errors."
    else:
        verdict = "too few repeats to tell whether that is below a tenth."
    yield (
        f"The simulation itself (render noise, facets) adds {own.mean:+.1%} of the variance "
        f"({_interval(own, 100.0)} %): {verdict}"
    )
    for what, one in (("bias", found.bias), ("variance", found.variance)):
        if not one.adds_up:
            scale, unit = (1e6, "µm") if what == "bias" else (100.0 / total, "%")
            yield f"Three or more effects at once make {one.rest.mean * scale:+.2g} {unit} of the {what}."


def _named(found: Budget) -> Iterator[tuple[str, Interval, float, float]]:
    """Name, share, and the means alone and among the others of every line of a budget, in order."""
    yield "without any effect", found.floor, math.nan, math.nan
    for term in found.terms:
        yield term.effect, term.share, term.alone.mean, term.among.mean
    yield "three or more at once", found.rest, math.nan, math.nan
    yield "total", found.total, math.nan, math.nan
    yield "of which interaction of pairs", found.interaction, math.nan, math.nan
    yield "of which the simulation itself", found.own, math.nan, math.nan


def _rows(found: ErrorBudget) -> Iterator[list[str | float | None]]:
    for measure, unit, one in (("bias", "m", found.bias), ("variance", "m^2", found.variance)):
        terms = {term.effect: term for term in one.terms}
        for name, share, _, _ in _named(one):
            row: list[str | float | None] = [found.method, measure, unit, name, *_three(share)]
            term = terms.get(name)
            row += [*_three(term.alone), *_three(term.among)] if term is not None else [None] * 6
            yield row


def _three(one: Interval) -> list[float | None]:
    return [value if math.isfinite(value) else None for value in (one.mean, one.low, one.high)]


def _number(value: float, scale: float) -> str:
    return number_text(value * scale, 3)


def _interval(one: Interval, scale: float) -> str:
    return interval_text(one.low * scale, one.high * scale, 3)
