"""The cause of a breakdown in a word, from what a run that holds and one that does not say of themselves."""

from __future__ import annotations

import math
from collections.abc import Mapping

LOST = 0.02
"""Of the rows, lost to one symptom more than before."""
STEEPER = 2.0
"""Times that the cosine of the angle of incidence has shrunk where a surface is grazed."""
COARSER = 1.5
"""Times that the depth of one pixel has grown where camera and laser hardly see from two sides, or that the depth error
by the calibration has, whose boards then tell too little."""
WIDER = 1.5
"""A line so many times as wide as before is out of focus, or too wide."""
NARROWER, NARROW = 1.5, 1.0
"""Times as narrow as before, and then how many pixels (sigma), where a line is too thin for the pixels: its place locks
to their grid."""
DIMMER = 2.0
BRIGHTER, LEAST, KEPT = 4.0, 0.05, 0.5
"""Times that the light beneath a line has grown, and grown more than the line itself, where other light drowns it, the
share of the line that it is then at least, and the least that is then left of both together: a line that spreads beyond
its window leaves light beneath it as well, but that is its own, and both together grow far fainter."""


def cause(good: Mapping[str, float], bad: Mapping[str, float]) -> str:
    """Names what changed most between two runs' measures.

    Each symptom is the fraction of rows that it takes, more than before; the largest names the cause. A surface seen or
    lit at grazing angles loses its rows to that, whatever their symptom, unless they are hidden. Where no row is lost,
    depth may be coarse though the line is exact; else the line itself says why it is measured worse: what lies beneath
    it is brighter, or it is wider, which also loses rows or tears the peak, or dimmer, or thinner than the pixels. A
    measure that is not known has not changed.
    """
    symptoms = {
        "occluded": _less(good, bad, "visible_rows"),
        "starved": _less(bad, good, "no_peak_rows"),
        "saturated": _less(bad, good, "saturated_rows"),
        "wrong peak": _less(bad, good, "wrong_rows") + _less(bad, good, "false_rows"),
        "not measurable": _less(bad, good, "unmeasured_rows"),
    }
    worst = max(symptoms, key=lambda name: symptoms[name])
    if symptoms[worst] <= LOST:
        worst = "less precise"
    if worst == "starved" and symptoms["saturated"] > LOST:
        worst = "saturated"  # too little light saturates no row: here it is the surroundings that drown the line
    if worst == "occluded":
        return worst
    if math.cos(good.get("incidence", 0.0)) > STEEPER * math.cos(bad.get("incidence", 0.0)):
        return "grazing"
    wider = _times(good, bad, "line_width") > WIDER
    beneath = bad.get("background", 0.0) > LEAST * bad.get("signal", 0.0)  # else the noise of what a fit takes for it
    brighter = beneath and _times(good, bad, "background") > BRIGHTER * max(_times(good, bad, "signal"), 1.0)
    if worst != "saturated" and brighter and not wider and _both(bad) > KEPT * _both(good):
        return "too much other light"
    if worst in ("starved", "saturated"):
        return worst
    coarser = max(_times(good, bad, name) for name in ("depth_per_pixel", "calibration_rmse"))
    if worst == "less precise" and coarser > max(COARSER, _times(good, bad, "position_rmse")):
        return "degenerate"
    if wider or brighter:
        return "out of focus or too wide"
    if worst != "wrong peak" and _times(bad, good, "signal") > DIMMER:
        return "starved"
    narrower = _times(bad, good, "line_width") > NARROWER and bad.get("line_width", NARROW) < NARROW
    if worst in ("less precise", "not measurable") and narrower:
        return "too thin for the pixels"
    return worst


def _both(run: Mapping[str, float]) -> float:
    """Line and the light beneath it."""
    return run["background"] + run.get("signal", 0.0)


def _less(a: Mapping[str, float], b: Mapping[str, float], name: str) -> float:
    """a - b."""
    difference = a.get(name, math.nan) - b.get(name, math.nan)
    return difference if math.isfinite(difference) else 0.0


def _times(before: Mapping[str, float], after: Mapping[str, float], name: str) -> float:
    """How much it has grown, as a factor."""
    first, second = before.get(name, math.nan), after.get(name, math.nan)
    return second / first if first > 0.0 and math.isfinite(second) else 1.0
