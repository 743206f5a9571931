"""The arrays behind the result views, in the units they are shown in: px, mm, um. Qt-free."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from analysis.error import Errors
from analysis.measures import FEWEST, Measures, error_statistics, median_length
from render.base.arrays import Float
from render.base.pose import transform_points
from render.frame import LaserCurve
from render.scene.scene import Scene
from studio.project.project import ProfileSection
from studio.scan.sheet_lean import T_section_camera
from studio.scan.stages import Measurement

ErrorKind = Literal["depth", "surface", "position"]

GAP = 4.0
"""Neighbouring crossings of the true line farther apart than this many px are not joined."""
MOST_BINS = 81
MOST_UM = 1e4
"""From which on lengths are told in mm."""


@dataclass(frozen=True)
class Series:
    """(n,) a sample of the line: where it is on the image and in a section of the part. NaN breaks a curve."""

    index: Float
    """Scan line."""
    position: Float
    """px along the scan line."""
    depth: Float
    """mm, `depth_z`."""
    across: Float
    """mm along the fan, in the section's frame."""
    distance: Float
    """mm from the laser along its axis, or below it."""


@dataclass(frozen=True)
class ErrorView:
    """One way to look at the error."""

    kind: ErrorKind
    title: str
    unit: str
    scale: float
    """Stored value times this is shown."""


ERROR_VIEWS = (
    ErrorView("depth", "Depth error", "µm", 1e6),
    ErrorView("surface", "Surface error", "µm", 1e6),
    ErrorView("position", "Line position error", "px", 1.0),
)


UNCERTAINTY = "Bias known to"
COVERED = "Within 2 sigma"
OUTLIERS: dict[ErrorKind, str] = {
    "depth": "Outliers of depth",
    "surface": "Outliers of the surface",
    "position": "Outliers in the image",
}
"""By the error that is looked at; those in the image are what completeness leaves out."""
MEASURED = (
    ("RMSE", "rmse"),
    ("Bias", "bias"),
    ("Sigma", "sigma"),
    ("Robust sigma", "robust_sigma"),
    ("95 % within", "p95"),
)
"""Rows of the table of measures in the view's unit, and what each is called elsewhere."""


def true_series(
    curve: LaserCurve, scene: Scene, laser: int, step: int = 0, section: ProfileSection = "laser_plane"
) -> Series:
    """The exact line, broken where it is interrupted."""
    T = T_section_camera(scene, laser, step, section)
    made = _series(curve.index.astype(np.float64), curve.position, curve.depth_z, curve.point, T)
    jump = (np.abs(np.diff(curve.index)) > 1) | (np.abs(np.diff(curve.position)) > GAP)
    at = np.flatnonzero(jump) + 1
    return Series(
        *(
            np.insert(values, at, np.nan)
            for values in (made.index, made.position, made.depth, made.across, made.distance)
        )
    )


def measured_series(measurement: Measurement, scene: Scene, section: ProfileSection = "laser_plane") -> Series:
    """The points of a measurement, in their order; NaN where a peak gave no point."""
    points = measurement.points
    along = points.pixel[:, 0 if points.axis == "rows" else 1]
    index = points.index.astype(np.float64)
    T = T_section_camera(scene, measurement.laser, measurement.step, section)
    return _series(index, along, points.depth_z, points.camera, T)


def error_values(errors: Errors, view: ErrorView) -> Float:
    """(m,) measured minus true, in the view's unit."""
    values = {"depth": errors.depth, "surface": errors.off_surface, "position": errors.position}[view.kind]
    return np.asarray(values * view.scale)


def measures(errors: Errors, kind: ErrorKind) -> Measures:
    """The measures of a kind of error, stored units."""
    return {"depth": errors.depth_z, "surface": errors.surface, "position": errors.u}[kind]


def readable_unit(unit: str, largest: float) -> tuple[str, float]:
    """In which unit errors are told, and the factor to it; largest: of them, in `unit`."""
    return ("mm", 1e-3) if unit == "µm" and largest >= MOST_UM * (1.0 - 1e-9) else (unit, 1.0)


def symmetric_limit(error: Float, share: float = 98.0) -> float:
    """A round limit for an axis or colour bar centred on zero that holds so many percent of the errors."""
    size = np.abs(error[np.isfinite(error)])
    top = float(np.percentile(size, share)) if len(size) else 0.0
    if not top > 0.0:
        return 1.0
    power = 10.0 ** math.floor(math.log10(top))
    return float(
        next(step * power for step in (1.0, 1.5, 2.0, 3.0, 5.0, 7.0, 10.0) if step * power >= top * (1 - 1e-9))
    )


def histogram(error: Float, limit: float) -> tuple[Float, Float]:
    """Edges (n + 1,) within +-limit and counts (n,); what lies beyond is in the outermost bins.

    The number of bins, odd so that zero has one, grows with the cube root of the count (Rice's rule, with room).
    """
    finite = np.clip(error[np.isfinite(error)], -limit, limit)
    bins = min(2 * math.ceil(2.5 * max(len(finite), 8) ** (1 / 3)) + 1, MOST_BINS)
    counts, edges = np.histogram(finite, bins=bins, range=(-limit, limit))
    return edges, counts.astype(np.float64)


def table(found: list[Measurement], view: ErrorView) -> list[tuple[str, str, list[float]]]:
    """Rows of the table of measures: name, unit, a value for each measurement (NaN: there is none).

    Errors first: on a low screen the rest is scrolled.
    """
    rows: list[tuple[str, str, list[float]]] = []
    of = [measures(one.errors, view.kind) for one in found]
    for name, attribute in MEASURED:
        rows.append((name, view.unit, [view.scale * getattr(one, attribute) for one in of]))
        if attribute == "bias":
            rows.append((UNCERTAINTY, view.unit, [bias_uncertainty(one, view) for one in found]))
    rows += [
        ("Points", "", [float(one.points.valid.sum()) for one in found]),
        ("Completeness", "%", [100.0 * one.errors.completeness for one in found]),
        ("False scan lines", "", [float(one.errors.false_alarms) for one in found]),
    ]
    rows.append((OUTLIERS[view.kind], "%", [100.0 * one.outlier_rate for one in of]))
    rows.append((COVERED, "%", [100.0 * _covered(one, view) for one in found]))
    return rows


def _covered(found: Measurement, view: ErrorView) -> float:
    """Share of the errors within twice their sigma, which holds noise and, of points, the calibration."""
    points, errors = found.points, found.errors
    if view.kind == "position" or points.calibration is None:
        return measures(errors, view.kind).coverage
    noise = points.sigma_depth if view.kind == "depth" else errors.sigma_off_surface
    common = points.sigma_depth_systematic if view.kind == "depth" else errors.systematic_off_surface
    error, sigma = error_values(errors, view) / view.scale, np.hypot(noise, common)
    known = np.isfinite(error) & np.isfinite(sigma)
    return float(np.mean(np.abs(error[known]) <= 2.0 * sigma[known])) if known.any() else math.nan


def bias_uncertainty(found: Measurement, view: ErrorView) -> float:
    """Twice the standard deviation of the mean error, in the view's unit, as neighbouring scan lines err alike; NaN: of
    too few errors."""
    error, points = error_values(found.errors, view), found.points
    known = np.isfinite(error)
    if np.count_nonzero(known) < FEWEST:
        return math.nan
    length = median_length(points.correlation_length[known])
    return 2.0 * error_statistics(error[known], points.index[known], length)[0][1]


def _series(index: Float, position: Float, depth: Float, points: Float, T_section_camera: Float) -> Series:
    there = transform_points(T_section_camera, points)
    return Series(index, position, 1e3 * depth, 1e3 * there[:, 1], 1e3 * there[:, 2])
