"""An error budget as a waterfall: from nothing to the total, a bar for what each effect makes of bias and of spread."""

from __future__ import annotations

import math
from typing import Any

from analysis.report.colour import ACCENT, INK, MUTED, PAPER, STEEL, method_name
from analysis.report.style import figure
from analysis.study.budget import Budget
from analysis.study.intervals import Interval
from studio.study.answers import ErrorBudget
from studio.study.effects import OF_SIMULATION

ROW = 0.27
"""inch."""
FLOOR, REST, TOTAL = "without any effect", "three or more at once", "total"


def budget_figure(found: ErrorBudget) -> Any:
    """A matplotlib figure: bias left, variance right, a row for each effect; rows of both in one order."""
    order = sorted(found.variance.terms, key=lambda term: (term.effect in OF_SIMULATION, -abs(term.share.mean)))
    effects = [term.effect for term in order]
    with figure(1.1 + ROW * (len(effects) + 3)) as made:
        bias, variance = made.subplots(1, 2, sharey=True)
        _waterfall(bias, found.bias, effects, 1e6, "{:+.2g}")
        scale = 100.0 / found.variance.total.mean if found.variance.total.mean > 0.0 else math.nan
        _waterfall(variance, found.variance, effects, scale, "{:+.0f} %")
        bias.set(xlabel="depth bias (µm)", title="Bias")
        sigma = math.sqrt(max(found.variance.total.mean, 0.0)) * 1e6
        variance.set(xlabel=f"share of the variance (%); sigma in all {sigma:.3g} µm", xticks=range(0, 101, 25))
        variance.set_title(f"Spread, by {method_name(found.method)}")
        rows = [FLOOR, *effects, REST, TOTAL]
        words = [f"{name} (simulation)" if name in OF_SIMULATION else name for name in rows]
        bias.set_yticks(range(len(rows)), words, color=INK)
        bias.invert_yaxis()
        return made


def _waterfall(axes: Any, found: Budget, effects: list[str], scale: float, form: str) -> None:
    """Each bar begins where the one above ends; what makes less is hatched, what is of the simulation alone grey."""
    by_name = {term.effect: term for term in found.terms}
    at, parts = 0.0, [(FLOOR, found.floor), *((name, by_name[name].share) for name in effects), (REST, found.rest)]
    ends = [0.0]
    for row, (name, part) in enumerate(parts):
        end = at + part.mean * scale
        _bar(axes, row, at, end, part, scale, grey=name in (*OF_SIMULATION, FLOOR, REST))
        label = form.format(part.mean * scale)
        if name in by_name:
            label += f"  ({form.format(by_name[name].alone.mean * scale)} alone)"
        _label(axes, row, max(at, end, end + (part.high - part.mean) * scale), label)
        axes.plot([end, end], [row + 0.32, row + 0.68], color=MUTED, lw=0.6)
        at = end
        ends.append(end)
    row, total = len(parts), found.total
    axes.barh(row, total.mean * scale, height=0.62, color=INK)
    _whisker(axes, row, total.mean * scale, total, scale, MUTED)
    _label(axes, row, max(total.high * scale, 0.0), form.format(total.mean * scale))
    axes.axvline(0.0, color=INK, lw=0.6)
    axes.grid(axis="y", visible=False)
    low, high = min(*ends, total.low * scale), max(*ends, total.high * scale)
    axes.set_xlim(low - 0.06 * (high - low), high + 0.55 * (high - low))


def _bar(axes: Any, row: int, start: float, end: float, part: Interval, scale: float, *, grey: bool) -> None:
    less = end < start
    colour = STEEL if grey else ACCENT
    axes.barh(row, end - start, left=start, height=0.62, color=PAPER if less else colour, edgecolor=colour, lw=0.8,
              hatch="////" if less else None)  # fmt: skip
    _whisker(axes, row, end, part, scale, INK)


def _whisker(axes: Any, row: int, x: float, part: Interval, scale: float, colour: str) -> None:
    """The 95 % interval, about the end of a bar."""
    if math.isfinite(part.low):
        reach = [[(part.mean - part.low) * scale], [(part.high - part.mean) * scale]]
        axes.errorbar(x, row, xerr=reach, color=colour, lw=0.8, capsize=1.5)


def _label(axes: Any, row: int, x: float, text: str) -> None:
    paper = {"facecolor": PAPER, "edgecolor": "none", "pad": 0.6}
    axes.annotate(text, (x, row), xytext=(4, 0), textcoords="offset points", va="center", fontsize=6.3, bbox=paper)
