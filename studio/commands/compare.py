"""What `main.py compare A B` does: a table of what changed in the set-up, one of what changed in the results."""

from __future__ import annotations

import math
from pathlib import Path

from studio.runtime.console import print_table
from studio.runtime.streams import print_json
from studio.study.comparison import Comparison, Figure, compare_runs, read_side


def compare_paths(a: Path, b: Path, *, quiet: bool, as_json: bool) -> None:
    """InputError: one of them is no finished run."""
    found = compare_runs(read_side(a), read_side(b))
    if as_json:
        print_json({"ok": True, "a": str(a), "b": str(b), **_as_data(found)})
        return
    if found.setup:
        rows = [(one.label, one.a, one.b) for one in found.setup]
        print_table("Set-up", rows, header=("changed", "A", "B"))
    else:
        print("Set-up: nothing differs")
    if found.figures:
        print()
        header = ("laser", "figure", "A", "B", "B - A", "95 % interval", "p", "differs")
        print_table("Results", [_row(one) for one in found.figures], header=header)
        if not quiet:
            print(f"Test: {found.test}; differs: at 5 % for all figures together (Holm).")
    for note in found.notes:
        print(note)


def _row(one: Figure) -> tuple[str, ...]:
    values = [_number(value * one.scale) for value in (one.found.a, one.found.b, one.found.difference)]
    low, high = (_number(value * one.scale) for value in (one.found.low, one.found.high))
    interval = f"{low} to {high}" if math.isfinite(one.found.p) else "-"
    p = "-" if math.isnan(one.found.p) else "< 0.0001" if one.found.p < 1e-4 else f"{one.found.p:.4f}"
    label = f"{one.label} ({one.unit})" if one.unit else one.label
    return one.laser, label, *values, interval, p, "yes" if one.clear else "no"


def _number(value: float) -> str:
    if not math.isfinite(value):
        return "-"
    return f"{value:.0f}" if value == round(value) and abs(value) < 1e7 else f"{value:.4g}"


def _as_data(found: Comparison) -> dict[str, object]:
    """In SI units; None: not known."""
    figures = [
        {
            "laser": one.laser,
            "figure": one.label,
            "unit": "m" if one.unit == "um" else "",
            "a": _known(one.found.a),
            "b": _known(one.found.b),
            "difference": _known(one.found.difference),
            "low": _known(one.found.low),
            "high": _known(one.found.high),
            "p": _known(one.found.p),
            "differs": one.clear,
            "blocks": one.found.blocks,
        }
        for one in found.figures
    ]
    setup = [{"field": one.field, "label": one.label, "a": one.a, "b": one.b} for one in found.setup]
    return {"setup": setup, "results": figures, "test": found.test, "paired": found.paired, "notes": list(found.notes)}


def _known(value: float) -> float | None:
    return value if math.isfinite(value) else None
