"""What a row of the table of the part's measures says where the mouse rests: all that the report has of it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from analysis.gauges.gauge import TITLES, Gauge
from analysis.report.gauge_table import DEFINITIONS, cells, over_steps_of, remark_of, value_text
from analysis.report.units import NONE


def measure_tip(gauge: Gauge, entry: Mapping[str, Any] | None, of: str) -> str:
    """As paragraphs; entry: its row, None: nothing is known of it; of: whose steps its figures are, or nothing."""
    told = [TITLES[gauge.kind] + (f". {text}" if (text := DEFINITIONS.get(gauge.kind)) else "")]
    if entry is not None:
        verdict, ratio = cells(entry)[5], cells(entry)[7]
        told += [f"{verdict}{of}", first_upper(over_steps_of(entry))]
        if entry["reason"]:
            told.append(first_upper(entry["reason"]))
        else:
            truth = value_text(entry["truth"], entry["sigma"], gauge.unit)
            in_sigmas = "" if ratio == NONE else f" ({ratio} sigma)"
            told += [f"truth {truth}; {entry['points']} points{in_sigmas}", first_upper(remark_of(entry))]
    return "".join(f"<p>{text}</p>" for text in told if text)


def first_upper(text: str) -> str:
    """With a capital letter."""
    return text[:1].upper() + text[1:]
