"""The result of a scan in a few numbers a laser and method, SI units, ready for JSON or a table."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from analysis.measures import Measures
from analysis.report.record import ScanRecord
from analysis.report.total import Total, total


def summarise(record: ScanRecord) -> list[dict[str, Any]]:
    """For each laser and each method: how many points, how complete, how wrong. None where nothing was measured.

    "sampled_scan_lines" are those that robust sigma and P95 come from; bias and RMSE are always of all.
    """
    rows = []
    for i, laser in enumerate(record.scene.lasers):
        for k in range(record.method_count(i)):
            found = total(record.chosen(i, k))
            rows.append({"laser": laser.name, "method": found.method, **_figures(found)})
    return rows


def profile_rate(record: ScanRecord, seconds: Mapping[str, float]) -> float | None:
    """Profiles, one of each laser in each frame, in a second of all that was done for them; None: nothing was timed.

    seconds: wall time by stage.
    """
    spent = sum(seconds.values())
    return len(record.steps) * len(record.scene.lasers) / spent if spent > 0.0 else None


def _figures(found: Total) -> dict[str, Any]:
    return {
        "points": found.points,
        "completeness": found.completeness if found.truth_rows else None,
        "false_scan_lines": found.false_alarms,
        "outliers": found.outliers,
        "scan_lines": found.lines,
        "sampled_scan_lines": found.lines_kept,
        "line_px": _error(found.u),
        "depth_m": _error(found.depth_z),
        "surface_error_m": _error(found.surface),
    }


def _error(found: Measures) -> dict[str, float | None]:
    names = ("bias", "rmse", "robust_sigma", "p95")
    return {name: getattr(found, name) if found.count else None for name in names}
