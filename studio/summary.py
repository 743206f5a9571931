"""The result of a scan in a few numbers a laser and method, SI units, ready for JSON or a table."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.measures import robust_sigma
from analysis.report.model import Extraction, FrameResult
from render.scene import Scene

Float = NDArray[np.float64]


def summarise(frames: Sequence[FrameResult], scene: Scene) -> list[dict[str, Any]]:
    """For each laser and each method: how many points, how complete, how wrong. None where nothing was measured."""
    rows = []
    for i, laser in enumerate(scene.lasers):
        for k in range(len(frames[0].lasers[i].extractions) if frames else 0):
            found = [frame.lasers[i].extractions[k] for frame in frames]
            rows.append({"laser": laser.name, "method": found[0].line.method, **_figures(found)})
    return rows


def _figures(found: Sequence[Extraction]) -> dict[str, Any]:
    truth = sum(one.errors.truth_rows for one in found)
    return {
        "points": sum(int(one.points.valid.sum()) for one in found),
        "completeness": sum(one.errors.measured_rows for one in found) / truth if truth else None,
        "false_scan_lines": sum(one.errors.false_rows for one in found),
        "outliers": sum(int(one.errors.outlier.sum()) for one in found),
        "line_px": _error(np.concatenate([one.errors.position for one in found])),
        "depth_m": _error(np.concatenate([one.errors.depth for one in found])),
        "surface_m": _error(np.concatenate([one.errors.distance for one in found])),
    }


def _error(error: Float) -> dict[str, float | None]:
    finite = error[np.isfinite(error)]
    if len(finite) == 0:
        return {"bias": None, "rmse": None, "robust_sigma": None, "p95": None}
    return {
        "bias": float(np.mean(finite)),
        "rmse": math.sqrt(float(np.mean(finite**2))),
        "robust_sigma": robust_sigma(finite),
        "p95": float(np.percentile(np.abs(finite), 95)),
    }
