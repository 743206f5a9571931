"""The calibration file: what was found with its covariance, for projects to load and for later calibrations to hold."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from analysis.calibration.calibrate import Calibrated, Known
from analysis.calibration.estimate import unit_plane, unit_plane_jacobian
from render.base.arrays import Float
from render.base.errors import InputError
from render.base.files import atomic_write
from studio.calibration.motion_file import motion_data
from studio.project.calibration import (
    CALIBRATION_KIND,
    CALIBRATION_VERSION,
    CalibratedCamera,
    read_calibration_file,
)
from studio.project.covariance import check_covariance
from studio.project.strict_json import pretty, read_object
from studio.project.validation_messages import input_error

MOST = 1e24
"""What a covariance may hold."""


def file_data(result: Calibrated, size: tuple[int, int], board: str) -> dict[str, Any]:
    """The JSON object; lengths in m, pixels in px."""
    estimate, solution = result.estimate, result.adjusted.solution
    k = estimate.camera_count
    fx, fy, cx, cy = estimate.intrinsics.tolist()
    camera = {"width": size[0], "height": size[1], "fx": fx, "fy": fy, "cx": cx, "cy": cy}
    covariance = solution.covariance
    planes = [unit_plane(m) for m in estimate.planes]
    motion = motion_data(result)
    by_laser = {one.volume.laser: one.rms for one in result.depth}
    return {
        "kind": CALIBRATION_KIND,
        "version": CALIBRATION_VERSION,
        "board": board,
        "views": solution.estimate.rotation.shape[0],
        "camera": {**camera, "distortion": estimate.distortion.tolist()},
        "camera_covariance": _symmetric(covariance[:k, :k]).tolist(),
        "board_warp_m": estimate.warp.tolist(),
        "planes": [plane.tolist() for plane in planes],
        "covariances": [laser_covariance(result, i).tolist() for i in range(len(planes))],
        **({} if motion is None else {"motion": motion}),
        "checks": {
            "chi2_per_degree": solution.chi2 / max(solution.freedom, 1),
            "corner_sigma_factor": result.adjusted.corner_scale,
            "laser_sigma_factor": result.adjusted.laser_scale,
            "halves_p": None if result.halves is None else result.halves.p,
            "whiteness_p": result.whiteness.p,
            "faults": list(result.faults),
            "left_out": list(result.adjusted.left_out),
            "depth_rms_m": [by_laser.get(i) for i in range(len(planes))],
        },
    }


def laser_covariance(result: Calibrated, laser: int) -> Float:
    """(8 + terms, 8 + terms) of fx, fy, cx, cy, a, b, c, d and the distortion, as a project takes it."""
    estimate, covariance = result.estimate, result.adjusted.solution.covariance
    terms = len(estimate.distortion)
    jacobian = np.zeros((8 + terms, len(estimate.shared)))
    jacobian[:4, :4] = np.eye(4)
    jacobian[4:8, estimate.plane_slice(laser)] = unit_plane_jacobian(estimate.planes[laser])
    jacobian[8:, 4 : 4 + terms] = np.eye(terms)
    return _symmetric(jacobian @ covariance @ jacobian.T)


def write_calibration(path: Path, data: dict[str, Any]) -> None:
    """The file, whole or not at all. InputError: it cannot be written, or another file is in its way."""
    if path.exists() and not _is_calibration(path):
        raise InputError("another file is in the way", where=str(path), cure="choose another --out")
    with atomic_write(path) as temporary:
        temporary.write_text(pretty(data) + "\n", encoding="utf-8")


def read_calibration(path: Path) -> tuple[CalibratedCamera, Known, dict[str, Any]]:
    """Camera, what is known of it, and the whole object; a covariance of zeros tells a camera that was held as exact.

    InputError: no calibration file, or a damaged one.
    """
    data = read_calibration_file(path, str(path))
    if "camera" not in data:
        cure = "make one by main.py calibrate"
        raise InputError("the calibration has no camera", where=str(path), cure=cure)
    try:
        camera = CalibratedCamera.model_validate(data["camera"])
    except ValidationError as error:
        raise input_error(error, CalibratedCamera, data["camera"], str(path)) from None
    count, where = 4 + len(camera.distortion), f"{path}: camera_covariance"
    try:
        covariance = np.array(data.get("camera_covariance"), dtype=np.float64)
    except (ValueError, TypeError, OverflowError):
        covariance = np.empty(0)
    if covariance.shape != (count, count) or not np.all(np.abs(covariance) <= MOST):
        allowed = f"{count} rows of {count} numbers to {MOST:g}"
        raise InputError("not a covariance of the camera", where=where, allowed=allowed)
    try:
        check_covariance(covariance, "it")
    except ValueError as error:
        raise InputError("not a covariance of the camera", where=where, found=str(error)) from None
    intrinsics = np.array([camera.fx, camera.fy, camera.cx, camera.cy])
    if not np.any(covariance):
        return camera, Known(intrinsics, np.array(camera.distortion), None), data
    if not np.all(np.diag(covariance) > 0.0):
        raise InputError("not a covariance of the camera", where=where, found="a parameter without an error")
    return camera, Known(intrinsics, np.array(camera.distortion), covariance), data


def _is_calibration(path: Path) -> bool:
    try:
        return bool(read_object(path, "calibration file").get("kind") == CALIBRATION_KIND)
    except InputError:
        return False


def _symmetric(matrix: Float) -> Float:
    return np.asarray(0.5 * (matrix + matrix.T))
