"""How far a project's calibration puts the lit line off where the scene has it, beside what it tells of itself."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.line.result import exact_line
from analysis.triangulate import triangulate
from render.base.arrays import Float
from studio.project.project import Project

SURELY = 6.0
"""Sigmas of itself: a calibration that is farther off is of another set-up."""


@dataclass(frozen=True)
class CalibrationFit:
    """Of depth along the line, m, root mean square."""

    off: float
    told: float
    """One sigma; 0: it tells nothing."""

    def is_of_another(self, noise: float) -> bool:
        """It errs by more than it can by chance, and by more than the line's noise does, m."""
        return self.off > max(SURELY * self.told, noise)


def calibration_fit(
    project: Project, laser: int, scan_line: NDArray[np.integer[Any]], position: Float
) -> CalibrationFit | None:
    """Of a line at (n,) scan lines and exact positions on them, px. None: the project has no calibration for it, or its
    rays do not meet the plane that was found.
    """
    given, scene = project.calibration, project.scene
    if given.camera is None and given.laser_count == 0:
        return None
    index, first = np.unique(scan_line, return_index=True)
    rows = project.extraction.axis == "rows"
    place = np.full((scene.camera.height if rows else scene.camera.width, 1), np.nan)
    place[index, 0] = position[first]
    line = exact_line(project.extraction.axis, place)
    exact, camera = scene.laser_plane(laser), scene.camera
    ways = (
        (given.camera_of(camera), given.plane(laser, exact), given.covariance(laser)),
        (camera, exact, None),
    )
    found, true = (
        triangulate(line, lens, plane, T_rig_camera=np.eye(4), T_world_camera=np.eye(4), calibration_covariance=matrix)
        for lens, plane, matrix in ways
    )
    both = found.valid & true.valid
    if not both.any():
        return None
    off, told = (found.depth_z - true.depth_z)[both], found.sigma_depth_systematic[both]
    return CalibrationFit(math.sqrt(float(np.mean(off**2))), math.sqrt(float(np.mean(told**2))))
