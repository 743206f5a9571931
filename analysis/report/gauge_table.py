"""The table of the part's measures, for page and console: value, sigma, tolerance, verdict, error against the truth."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from analysis.gauges.gauge import LEFT_OUT, MISSES, REGIONS, TITLES, Gauge, Kind
from analysis.report.units import NONE, digits

if TYPE_CHECKING:
    from analysis.gauges.read import Reading

COLUMNS = ("kind", "value", "sigma", "nominal", "tolerance", "verdict", "error", "error / sigma")
MARKS = {"pass": "✓\u00a0pass", "fail": "✗\u00a0fail", "undecided": "?\u00a0undecided"}
"""Never by colour alone."""
UNPROVED = "what does not fit proves neither a pass nor a fail"
"""Told with the remark of a misfit that has a tolerance."""
PUT = "ends are the middles of its regions"
"""What remarks hold whose value is for the most part where the regions were put."""
COUNTED = ("pass", "undecided", "fail", "no tolerance", "none")
"""Verdicts in the order in which their counts are told; the last: not measured."""
PLAIN = str.maketrans({"µ": "u", "²": "2", "°": " deg", "–": "-", "✓": "", "✗": "", "?": "", "\u00a0": " "})  # noqa: RUF001
DEFINITIONS: dict[Kind, str] = {
    "straightness": "Straightness here is the bow: how far the middle of the parabola that is fitted to the region "
    "stands over the line between its ends, signed; waves and roughness do not count, as they do by ISO 1101.",
    "flatness": "Flatness here is the form of second degree (bow and twist) that is fitted to the surface, from peak "
    "to valley over its least-squares plane; waves, dents and roughness do not count, as they do by ISO 1101.",
    "edge_to_edge": "Edge to edge: each edge lies midway between the last scan line on the surface that ends there and "
    "the next, and unsure by half their distance either way, as its sigma says; the truth is where the part's own "
    "surface ends, whatever scan lines meet it. Scan lines that are closer tell it better.",
}
"""Of kinds whose name a drawing means otherwise, or whose error does not tell all, in a few words each."""
OPPOSITE = 0.02
"""Of a nominal, by which a value may differ that is taken for it with the other sign."""
FEWEST, MOST = 2, 6
"""Digits after the point, of mm, mm² or degrees."""
UNITS = {"m": (1e3, "\u00a0mm"), "rad": (math.degrees(1.0), "°"), "m2": (1e6, "\u00a0mm²")}


def scale_and_unit(unit: str) -> tuple[float, str]:
    """Factor from SI, and what follows the number that people read: mm, mm² or degrees."""
    return UNITS[unit]


def value_text(value: float | None, sigma: float | None, unit: str) -> str:
    """With as many digits as its sigma allows: two of it."""
    if value is None or not math.isfinite(value):
        return NONE
    scale, name = scale_and_unit(unit)
    return f"{scale * value:.{decimals(sigma, unit)}f}{name}"


def decimals(sigma: float | None, unit: str) -> int:
    """Digits after the point, in `scale_and_unit`'s unit, of a value of that sigma."""
    if sigma is None or not sigma > 0.0:
        return 4
    return min(max(FEWEST, 1 - math.floor(math.log10(scale_and_unit(unit)[0] * sigma))), MOST)


def small_text(value: float | None, unit: str) -> str:
    """A sigma or an error: um, or small parts of a degree or mm² as such."""
    if value is None or not math.isfinite(value):
        return NONE
    scale, name = (1e6, "\u00a0µm") if unit == "m" else scale_and_unit(unit)
    return f"{digits(scale * value)}{name}"


def tolerance_text(lower: float | None, upper: float | None, unit: str) -> str:
    """ "-0.1 / +0.1 mm"."""
    if lower is None and upper is None:
        return NONE
    scale, name = scale_and_unit(unit)
    ends = [NONE if end is None else f"{scale * end:+.4g}" for end in (lower, upper)]
    return f"{' / '.join(ends)}{name}"


def beside_nominal(gauge: Gauge, value: float | None = None) -> str:
    """What to say of a tolerance that no part meets, or none that is as large as its nominal, and of a value that is
    the nominal but for its sign; empty: of any other."""
    lower, upper, nominal = gauge.lower, gauge.upper, gauge.nominal
    if nominal is not None and value is not None and abs(value + nominal) < OPPOSITE * abs(nominal):
        sides = f"from the {REGIONS[gauge.kind][0]} to the {REGIONS[gauge.kind][-1]}"
        counted = f": it counts {sides}" if len(REGIONS[gauge.kind]) > 1 else ""
        return f"The value is the nominal with the other sign{counted}. Change the nominal's sign, or draw them anew."
    if nominal is not None and lower == upper == 0.0:
        return "Both limits are zero: no part passes, as none is known without any uncertainty."
    if nominal is None or not ((lower or 0.0) > 0.0 or (upper or 0.0) < 0.0):
        return ""
    scale, name = scale_and_unit(gauge.unit)
    ends = ["any" if end is None else f"{scale * (nominal + end):.6g}{name}" for end in (lower, upper)]
    return f"Allowed is {ends[0]} to {ends[1]}, without the nominal itself. A limit below the nominal has a minus sign."


def cells(row: Mapping[str, Any]) -> list[str]:
    """Of COLUMNS, from an entry of the scan's record of measures."""
    unit, ratio = row["unit"], row["error_in_sigmas"]
    verdict, worst = verdict_of(row), worst_of(row)
    return [
        TITLES[row["kind"]],
        value_text(row["value"], row["sigma"], unit),
        small_text(row["sigma"], unit),
        value_text(row["nominal"], row["sigma"], unit),
        tolerance_text(row["lower"], row["upper"], unit),
        f"{verdict}, {worst}" if worst else verdict,
        small_text(row["error"], unit),
        NONE if ratio is None else f"{ratio:+.2f}",
    ]


def verdict_of(row: Mapping[str, Any]) -> str:
    """Of such an entry, with how many of its steps came to what."""
    steps, counts = row["readings"], row.get("verdicts") or {}
    if row["reason"]:
        return f"not measured in any of {steps} steps" if steps > 1 else "not measured"
    if steps <= 1:
        return marked_verdict(row)
    told = MARKS[row["verdict"]] if row["verdict"] else NONE
    if not set(counts) - {"no tolerance"}:
        return told
    return counts_text(counts) if told == NONE else f"{told}: {counts_text(counts)}"


def worst_of(row: Mapping[str, Any]) -> str:
    """Which of its steps such an entry has its value of, and what is amiss there; empty: one step, or no value."""
    if row["reason"] or row["readings"] <= 1:
        return ""
    some = "none" in (row.get("verdicts") or {})
    if row["lower"] is not None or row["upper"] is not None:
        what = "worst measured" if some else "worst"
    else:
        what = f"farthest off the {'truth' if row['nominal'] is None else 'nominal'}{' of those measured' * some}"
    amiss = verdict_text(None, row.get("oblique"), row.get("remark") or "")
    return f"{what}: step {row['step'] + 1} of {row['readings']}{f' ({amiss})' if amiss != NONE else ''}"


def over_steps_of(row: Mapping[str, Any]) -> str:
    """What the measured steps of such an entry come to, of which the worst says nothing; empty: one at most."""
    found = row.get("over_steps")
    if not found:
        return ""
    some, every = found["measured"], row["readings"]
    scale, name = scale_and_unit(row["unit"])
    places = decimals(found["sigma"], row["unit"])
    median, least, largest = (f"{scale * found[key]:.{places}f}" for key in ("median", "least", "largest"))
    steps = f"{every} steps" if some == every else f"{some} of {every} steps that were measured"
    return f"median {median}{name}, from {least} to {largest}{name}, over the {steps}"


def marked_verdict(row: Mapping[str, Any]) -> str:
    """Of such an entry that has a value, with what is amiss with it."""
    return verdict_text(row["verdict"], row.get("oblique"), row.get("remark") or "")


def remark_of(row: Mapping[str, Any]) -> str:
    """Of such an entry, with the step that it is of and why a misfit is undecided whatever its value is."""
    remark = str(row.get("remark") or "")
    if MISSES in remark and row["verdict"] == "undecided":
        remark = f"{remark}; {UNPROVED}"
    return f"in step {row['step'] + 1}, whose value this is, {remark}" if remark and row["readings"] > 1 else remark


def label_of(one: Reading, step: str = "") -> str:
    """Of a reading that has a value, for where it is drawn: its name, value and verdict, with what is amiss with it.

    step: which it is of, where that is to be told; of a measure of all steps together it is not.
    """
    told = verdict_text(one.verdict, one.oblique, one.remark)
    name = f"{one.gauge.name}, {step}" if step and not one.gauge.of_scan else one.gauge.name
    value = f"{name}: {value_text(one.value, one.sigma, one.gauge.unit)}"
    return value if told == NONE else f"{value}, {told}"


def verdict_text(verdict: str | None, oblique: float | None = None, remark: str = "") -> str:
    """With its mark, by how much its section is not square to its faces (rad, None or NaN for nothing), and what its
    remark says: that its points miss the fitted curve, or some are left out, or its regions were put where it ends."""
    told = [MARKS[verdict]] if verdict else []
    if oblique is not None and math.isfinite(oblique):
        told.append(f"{math.degrees(oblique):.1f}° oblique")
    if MISSES in remark:
        told.append("misfit")
    elif LEFT_OUT in remark:
        told.append("points left out")
    if PUT in remark:
        told.append("as dragged")
    return ", ".join(told) or NONE


def counts_text(counts: Mapping[str, int]) -> str:
    """ "12 pass, 6 undecided, 2 not measured", of how many readings came to which verdict."""
    names = {"none": "not measured", "no tolerance": "without a tolerance"}
    return ", ".join(f"{counts[name]} {names.get(name, name)}" for name in COUNTED if counts.get(name))


def missing_of(row: Mapping[str, Any]) -> str:
    """Why such an entry has no value, or why one of its steps has none, and which; empty: all have one."""
    first = row.get("first_missing")
    if row["reason"] or first is None or row["readings"] <= 1:
        return str(row["reason"] or row.get("first_reason") or "")
    return f"in step {first + 1}: {row['first_reason']}"


def _first_of(row: Mapping[str, Any]) -> str:
    """Which of the steps without a value their reason is told of, where there are several; empty: records of former
    versions do not say."""
    first = row.get("first_missing")
    return f", first in step {first + 1}" if first is not None and row["verdicts"]["none"] > 1 else ""


def plain_cells(row: Mapping[str, Any]) -> list[str]:
    """The same for a terminal, which may know ASCII alone."""
    return [cell.translate(PLAIN).strip() for cell in cells(row)]


def definitions(rows: list[dict[str, Any]]) -> list[str]:
    """Of the kinds among the measures that need one, each once."""
    kinds = {row["kind"] for row in rows}
    return [text for kind, text in DEFINITIONS.items() if kind in kinds]


def over_steps(rows: list[dict[str, Any]]) -> list[str]:
    """The same of all of them, a sentence each."""
    return [f"{row['name']}: {text}" for row in rows if (text := over_steps_of(row))]


def reasons(rows: list[dict[str, Any]]) -> list[str]:
    """Why measures have no value, and what their sigmas do not know of, a sentence each."""
    told = [f"{row['name']} is not measured: {row['reason']}" for row in rows if row["reason"]]
    told += [
        f"{row['name']} is not measured in {row['verdicts']['none']} of {row['readings']} steps"
        f"{_first_of(row)}: {row['first_reason']}"
        for row in rows
        if row.get("first_reason") and not row["reason"]
    ]
    return told + [f"{row['name']}: {text}" for row in rows if (text := remark_of(row)) and not row["reason"]]
