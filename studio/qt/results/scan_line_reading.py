"""What is told of the scan line under the mouse: each method's depth there, and its error."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from analysis.report.colour import method_colour
from analysis.report.units import digits
from analysis.triangulate import PointFlag
from studio.scan.result_series import ErrorView, error_values, readable_unit
from studio.scan.stages import Measurement

NO_DEPTH = {
    PointFlag.NO_RAY: "no depth: the lens has no ray there",
    PointFlag.NEAR_PARALLEL: "no depth: the ray runs along the laser's plane",
    PointFlag.BEHIND: "no depth: the ray does not meet the laser's plane",
}
NOTHING, UNMEASURED = "no point", "not measured yet"


def reading(
    scan_line: int | None, shown: Mapping[str, Measurement], view: ErrorView, axis: str, nothing: str = NOTHING
) -> tuple[str, float | None]:
    """Rich text, and the first method's error in the view's unit; shown: by method. Of None: nothing.

    nothing: what is said where no method has a peak.
    """
    if scan_line is None:
        return "", None
    parts, first = [], None
    for method, one in shown.items():
        for i in np.flatnonzero(one.points.index == scan_line)[:1]:
            error, depth = float(error_values(one.errors, view)[i]), 1e3 * float(one.points.depth_z[i])
            known = math.isfinite(error)
            unit, factor = readable_unit(view.unit, abs(error))
            said = f"{'+' if error > 0 else ''}{digits(factor * error)} {unit}" if known else "no truth here"
            told = NO_DEPTH.get(PointFlag(one.points.flag[i]), f"{depth:.3f} mm ({said})")
            parts.append(f"<span style='color:{method_colour(method)}'>●</span> {told}")
            first = error if first is None and known else first
    name = "Column" if axis == "columns" else "Row"
    return f"<b>{name} {scan_line}</b>&nbsp;&nbsp; {'&nbsp;&nbsp; '.join(parts) or nothing}", first
