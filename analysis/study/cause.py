"""The cause of a breakdown in a word, from what a run that holds and one that does not say of themselves."""

from __future__ import annotations

from collections.abc import Mapping

WIDER = 1.5
"""A line so many times as wide as before is out of focus, or grazed."""
DIMMER = 0.5


def cause(good: Mapping[str, float], bad: Mapping[str, float]) -> str:
    """Names what changed most between two runs' measures.

    Each symptom is the fraction of rows that it takes, more than before; the largest names the cause. Where no row is
    lost, the line itself says why it is measured worse: it is wider, or dimmer.
    """
    symptoms = {
        "occluded": good["visible_rows"] - bad["visible_rows"],
        "starved": bad["no_peak_rows"] - good["no_peak_rows"],
        "saturated": bad["saturated_rows"] - good["saturated_rows"],
        "wrong peak": bad["wrong_rows"] - good["wrong_rows"] + bad["false_rows"] - good["false_rows"],
        "not measurable": bad["unmeasured_rows"] - good["unmeasured_rows"],
    }
    worst = max(symptoms, key=lambda name: symptoms[name] if symptoms[name] == symptoms[name] else -1.0)
    if symptoms[worst] > 0.02:
        return worst
    if bad["line_width"] > WIDER * good["line_width"]:
        return "out of focus or grazing"
    if bad["signal"] < DIMMER * good["signal"]:
        return "starved"
    return "less precise"
