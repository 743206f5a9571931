"""A project calibrated on virtual boards, for one cell of a study: what its points are made with, and how good that is.

Numbers are rounded far below what they mean: the last bits of sums hang on where arrays lie in memory, and a study's
table is the same to the bit on every run.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from analysis.calibration.calibrate import Calibrated, Request, calibrate
from analysis.calibration.estimate import Estimate, unit_plane
from analysis.line.settings import ExtractionSettings
from render.base.errors import InputError
from render.sensor.sensor import Sensor
from studio.calibration.board_text import parse_board
from studio.calibration.in_silico import true_depth_error, virtual_views
from studio.calibration.material import board_distances
from studio.project.calibration import CalibratedCamera, Calibration
from studio.project.project import Project
from studio.study.boards import Boards

PIXEL_DIGITS, TERM_DIGITS, PLANE_DIGITS = 5, 10, 10
"""After the point, of px, of distortion terms, and of a plane's normal and m."""
FIGURES = 6
"""Of a measure."""


@dataclass(frozen=True)
class Found:
    """calibration: for the project's points; measures: of `CALIBRATION_MEASURES`; seconds: processor time."""

    calibration: Calibration
    measures: dict[str, float]
    seconds: float


def calibrated(project: Project, boards: Boards, laser: int) -> Found:
    """By the project's seed. InputError: the views do not determine it, or the camera sees no such board."""
    # of the methods of a point, which share it, each asks anew
    plain = project.model_copy(update={"extraction": ExtractionSettings(), "sensor": Sensor()})
    found = _found(plain.to_text(), project.folder, boards.model_dump_json(), laser)
    if isinstance(found, InputError):
        raise found
    return found


@lru_cache(maxsize=4)
def _found(text: str, folder: Path, boards_text: str, laser: int) -> Found | InputError:
    project, boards = Project.from_text(text).in_folder(folder), Boards.model_validate_json(boards_text)
    before = time.process_time()
    board, camera = parse_board(boards.board), project.scene.camera
    size = (camera.width, camera.height)
    try:
        views, truth = virtual_views(
            project,
            board,
            boards.views,
            seed=project.seed,
            depth=board_distances(project, boards.nearest, boards.farthest),
            most_tilt=boards.most_tilt,
            sigmas=(boards.corner_sigma, boards.line_sigma),
        )
        request = Request(size, len(project.scene.lasers), boards.lens, most_tilt=boards.most_tilt)
        result = calibrate(views, board.target, request)
    except InputError as error:
        return error
    seconds = time.process_time() - before
    return Found(_kept(result.estimate, size), _measures(result, truth, laser, boards.corner_sigma), seconds)


def _kept(estimate: Estimate, size: tuple[int, int]) -> Calibration:
    fx, fy, cx, cy = np.round(estimate.intrinsics, PIXEL_DIGITS).tolist()
    terms = tuple(np.round(estimate.distortion, TERM_DIGITS).tolist())
    camera = CalibratedCamera(width=size[0], height=size[1], fx=fx, fy=fy, cx=cx, cy=cy, distortion=terms)
    planes = [np.round(unit_plane(m), PLANE_DIGITS).tolist() for m in estimate.planes]
    return Calibration(camera=camera, planes=tuple((a, b, c, d) for a, b, c, d in planes))


def _measures(result: Calibrated, truth: Estimate, laser: int, corner_sigma: float) -> dict[str, float]:
    estimate, off = result.estimate, result.estimate.intrinsics - truth.intrinsics
    normal, exact = (unit_plane(each.planes[laser])[:3] for each in (estimate, truth))
    by_laser = dict(zip([one.volume.laser for one in result.depth], true_depth_error(result, truth), strict=True))
    depth = by_laser.get(laser, (math.nan, math.nan))
    residual = result.adjusted.solution.corner_residual * corner_sigma * result.adjusted.corner_scale
    found = {
        "calibration_rmse": depth[0],
        "calibration_predicted": depth[1],
        "plane_angle": float(np.arctan2(np.linalg.norm(np.cross(normal, exact)), normal @ exact)),
        "focal_error": float(np.max(np.abs(off[:2]))),
        "principal_error": float(np.hypot(off[2], off[3])),
        "reprojection_rmse": float(np.sqrt(np.mean(np.sum(residual**2, axis=1)))),
    }
    return {name: float(f"{value:.{FIGURES}g}") for name, value in found.items()}
