"""What a run is measured by: one row of numbers for each cell of a study, in SI units."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.error import Errors
from analysis.gauges.gauge import Gauge
from analysis.gauges.read import Reading
from analysis.line.result import Flag, Line, positioned
from analysis.triangulate import Points
from render.frame import LaserCurve

BROKEN = 8.0
"""px along the scan line, from one to the next: a line that goes on is not as steep but at the rim of a round part."""
APART = 1e6
"""px, that scan lines are laid end to end by."""


@dataclass(frozen=True)
class Measure:
    """label: on an axis; scale: from the stored number to the unit shown; signed: it may be negative."""

    label: str
    unit: str = ""
    scale: float = 1.0
    signed: bool = False


MEASURES: dict[str, Measure] = {
    "depth_rmse": Measure("depth error, RMS", "µm", 1e6),
    "depth_bias": Measure("depth bias", "µm", 1e6, signed=True),
    "depth_sigma": Measure("depth sigma", "µm", 1e6),
    "depth_robust_sigma": Measure("depth sigma, robust", "µm", 1e6),
    # of the rows that are measured right, but for the line's ends
    "depth_bias_right": Measure("depth bias where measured right", "µm", 1e6, signed=True),
    "depth_sigma_right": Measure("depth sigma where measured right", "µm", 1e6),
    "depth_p95": Measure("depth error, P95", "µm", 1e6),
    "depth_predicted_sigma": Measure("predicted depth sigma, median", "µm", 1e6),
    "depth_coverage": Measure("depth errors within 2 predicted sigma", "%", 100.0),
    "position_rmse": Measure("line error, RMS", "px"),
    "position_bias": Measure("line bias", "px", signed=True),
    "position_robust_sigma": Measure("line sigma, robust", "px"),
    "position_p95": Measure("line error, P95", "px"),
    "completeness": Measure("rows measured, of those to be seen", "%", 100.0),
    "wrong_rows": Measure("rows measured wrong, of those to be seen", "%", 100.0),
    "false_rows": Measure("rows found without a line", "%", 100.0),
    "autocorrelation": Measure("correlation of neighbouring rows", signed=True),
    "no_peak_rows": Measure("rows without a peak", "%", 100.0),
    "saturated_rows": Measure("rows saturated", "%", 100.0),
    "unmeasured_rows": Measure("rows with a peak that could not be measured", "%", 100.0),
    "visible_rows": Measure("rows on which the line can be seen", "%", 100.0),
    "signal": Measure("peak, median", "e-"),
    "background": Measure("light beneath the line, median", "e-"),
    "line_width": Measure("line width, median sigma", "px"),
    "depth_per_pixel": Measure("depth of one pixel, median", "µm/px", 1e6),
    "calibration_rmse": Measure("depth error by the calibration, RMS over its volume", "µm", 1e6),
    "calibration_predicted": Measure("the same, as the calibration tells it", "µm", 1e6),
    "plane_angle": Measure("angle of the laser plane to the true one", "mrad", 1e3),
    "focal_error": Measure("focal length off by", "px"),
    "principal_error": Measure("principal point off by", "px"),
    "reprojection_rmse": Measure("reprojection error, RMS", "px"),
    "facet_error": Measure("facets off the round body, RMS along the line", "µm", 1e6),
    "incidence": Measure("angle from the surface's normal, to light or camera, median", "°", 180.0 / np.pi),
}

PART_MEASURES: dict[str, Measure] = {
    "length_value": Measure("value", "mm", 1e3, signed=True),
    "length_error": Measure("error against the truth", "µm", 1e6, signed=True),
    "length_sigma": Measure("predicted sigma", "µm", 1e6),
    "angle_value": Measure("value", "°", 180.0 / np.pi, signed=True),
    "angle_error": Measure("error against the truth", "°", 180.0 / np.pi, signed=True),
    "angle_sigma": Measure("predicted sigma", "°", 180.0 / np.pi),
    "area_value": Measure("value", "mm²", 1e6, signed=True),
    "area_error": Measure("error against the truth", "mm²", 1e6, signed=True),
    "area_sigma": Measure("predicted sigma", "mm²", 1e6),
}
"""Of the project's own measures of the part: "length_error:NAME", "angle_error:NAME" or "area_error:NAME"."""
OF_UNIT = {"m": "length", "rad": "angle", "m2": "area"}


def measure_of(name: str) -> Measure:
    """One of MEASURES, or of the part. KeyError: it is neither."""
    kind, colon, gauge = name.partition(":")
    if not (colon and gauge):
        return MEASURES[name]
    found = PART_MEASURES[kind]
    return replace(found, label=f"{gauge}, {found.label}")


def part_names(gauges: Sequence[Gauge]) -> list[str]:
    """What a study may ask of a project's measures of the part, in their order; its cells are frames, not scans."""
    kinds = ("value", "error", "sigma")
    return [f"{OF_UNIT[one.unit]}_{kind}:{one.name}" for one in gauges if not one.of_scan for kind in kinds]


def of_the_part(found: Sequence[Reading]) -> dict[str, float]:
    """The numbers by those names; NaN where there is none."""
    numbers = [number for one in found for number in (one.value, one.error, one.sigma)]
    return dict(zip(part_names([one.gauge for one in found]), numbers, strict=True))


CALIBRATION_MEASURES = (
    *("calibration_rmse", "calibration_predicted", "plane_angle"),
    *("focal_error", "principal_error", "reprojection_rmse"),
)
"""Of cells that calibrate; NaN of others."""


def measures(line: Line, points: Points, errors: Errors, curve: LaserCurve) -> dict[str, float]:
    """One number for each of MEASURES, NaN where there is none, or the scene or calibration would have to be known.

    curve: the exact line of the same laser.
    """
    rows = len(line.u)
    first = line.flag[:, 0]
    visible = max(errors.truth_rows, 1)
    wrong = np.unique(points.index[errors.outlier]).size
    found = line.valid
    whole = ~np.append(at_end(curve), False)[errors.truth]  # the last is of points without truth
    right = errors.depth[np.isfinite(errors.depth) & ~errors.outlier & whole]
    return {
        "depth_rmse": errors.depth_z.rmse,
        "depth_bias": errors.depth_z.bias,
        "depth_sigma": errors.depth_z.sigma,
        "depth_robust_sigma": errors.depth_z.robust_sigma,
        "depth_bias_right": float(right.mean()) if len(right) else float("nan"),
        "depth_sigma_right": float(right.std()) if len(right) else float("nan"),
        "depth_p95": errors.depth_z.p95,
        "depth_predicted_sigma": _median(points.sigma_depth[points.valid]),
        "depth_coverage": errors.depth_z.coverage,
        "position_rmse": errors.u.rmse,
        "position_bias": errors.u.bias,
        "position_robust_sigma": errors.u.robust_sigma,
        "position_p95": errors.u.p95,
        "completeness": errors.completeness,
        "wrong_rows": wrong / visible,
        "false_rows": errors.false_alarms / rows,
        "autocorrelation": errors.depth_z.autocorrelation,
        "no_peak_rows": float(np.mean(first == Flag.NO_PEAK)),
        "saturated_rows": float(np.mean(first == Flag.SATURATED)),
        "unmeasured_rows": float(np.mean(~positioned(first) & (first != Flag.NO_PEAK))),
        "visible_rows": errors.truth_rows / rows,
        "signal": _median(line.amplitude[found]),
        "background": _median(line.background[found]),
        "line_width": _median(line.width[found]),
        **dict.fromkeys((*CALIBRATION_MEASURES, "facet_error"), float("nan")),
        "depth_per_pixel": _median(np.abs(points.gradient[points.valid, 2])),
        "incidence": _median(np.maximum(curve.laser_angle, curve.camera_angle)),
    }


def at_end(curve: LaserCurve) -> np.ndarray:
    """(n,) of the exact line's crossings: whether the line ends or breaks there, by more than BROKEN.

    Its light covers such a scan line in part, and is measured where that part is: of a sphere the two rows at its rim
    make more of the variance than all others.
    """
    key, ends = curve.index * APART + curve.position, np.zeros(len(curve.index), np.bool_)
    ordered = np.concatenate([[-np.inf], np.sort(key), [np.inf]])
    for beside in (key - APART, key + APART):
        after = np.searchsorted(ordered, beside)
        ends |= np.minimum(ordered[after] - beside, beside - ordered[after - 1]) > BROKEN
    return ends


def _median(values: np.ndarray) -> float:
    finite = values[np.isfinite(values)]
    return float(np.median(finite)) if len(finite) else float("nan")
