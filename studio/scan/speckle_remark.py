"""What a laser's speckle would make of a measurement whose sensor has none: most of the error of many a scanner."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from analysis.error import Errors
from analysis.line.result import Line
from analysis.report.units import micrometres
from analysis.triangulate import Points
from studio.preview.estimates import read_variance
from studio.preview.scintillation import speckle_px
from studio.project.project import Project

MOST = 200
"""Points whose speckle is worked out."""
FEWEST = 30
"""Points from which anything is said."""


class Measured(Protocol):
    """One laser's line, its points and their errors."""

    @property
    def line(self) -> Line: ...
    @property
    def points(self) -> Points: ...
    @property
    def errors(self) -> Errors: ...


def speckle_remark(project: Project, measured: Sequence[Measured], of: str = "") -> str:
    """By the first laser that drew a line; empty where the sensor has speckle, or it would change little.

    of: which of several frames they are of, in words.
    Fully developed and polarised, as of a laser on a rough surface (`speckle_px`), times the depth of a pixel.
    """
    if project.sensor.speckle != "off":
        return ""
    for i, one in enumerate(measured):
        sigma = _depth_sigma(project, i, one)
        robust = one.errors.depth_z.robust_sigma
        if sigma > robust:
            which = f" of {project.scene.lasers[i].name}" if len(measured) > 1 else ""
            return (
                f"Laser speckle is switched off in the sensor: the errors{which} (robust sigma "
                f"{micrometres(robust)}{of}) have none of it, where a laser on a rough surface scatters depth by about "
                f"{micrometres(sigma)}. "
                "Switch it on (sensor, Laser speckle) for what a real scanner of this kind meets."
            )
    return ""


def _depth_sigma(project: Project, laser: int, one: Measured) -> float:
    """m; NaN where too few points tell."""
    line, points, camera = one.line, one.points, project.scene.camera
    there = np.flatnonzero(points.valid & np.isfinite(one.errors.depth) & ~one.errors.outlier)
    if len(there) < FEWEST:
        return float("nan")
    some = there[np.unique(np.linspace(0, len(there) - 1, MOST).astype(int))]
    at = points.index[some], points.rank[some]
    along = points.pixel[some, 0 if points.axis == "rows" else 1]
    shown = line.width[at], along, line.amplitude[at], np.maximum(line.background[at], 0.0)
    wavelength = project.scene.lasers[laser].wavelength_nm
    moved = speckle_px(camera, wavelength, *shown, read_variance(project.sensor))
    return float(np.nanmedian(moved * np.abs(points.gradient[some, 2]))) if np.isfinite(moved).any() else float("nan")
