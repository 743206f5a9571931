"""What is told of the scan line under the mouse: each method's depth there, and its error."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from analysis.report.colour import method_colour
from analysis.report.units import digits
from studio.scan.result_series import ErrorView, error_values
from studio.scan.stages import Measurement


def reading(
    scan_line: int | None, shown: Mapping[str, Measurement], view: ErrorView, axis: str
) -> tuple[str, float | None]:
    """Rich text, and the first method's error in the view's unit; shown: by method. Of None: nothing."""
    if scan_line is None:
        return "", None
    parts, first = [], None
    for method, one in shown.items():
        for i in np.flatnonzero(one.points.index == scan_line)[:1]:
            error, depth = float(error_values(one.errors, view)[i]), 1e3 * float(one.points.depth_z[i])
            known = math.isfinite(error)
            said = f"{'+' if error > 0 else ''}{digits(error)} {view.unit}" if known else "no truth here"
            parts.append(f"<span style='color:{method_colour(method)}'>●</span> {depth:.3f} mm ({said})")
            first = error if first is None and known else first
    name = "Column" if axis == "columns" else "Row"
    return f"<b>{name} {scan_line}</b>&nbsp;&nbsp; {'&nbsp;&nbsp; '.join(parts) or 'no point'}", first
