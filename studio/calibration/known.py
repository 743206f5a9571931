"""What is known before the photographs: a calibrated camera, of ours or of another program, or a whole scanner."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from analysis.calibration.calibrate import Known
from analysis.calibration.estimate import plane_vector
from analysis.calibration.recheck import KnownLaser, KnownScanner
from render.base.arrays import Float
from render.base.errors import InputError
from render.base.files import read_bytes
from studio.calibration.calibration_file import read_calibration
from studio.calibration.exchange import MAX_BYTES, read_camera
from studio.calibration.solving import of_project
from studio.project.calibration import CALIBRATION_KIND, CalibratedCamera


def known_camera(path: Path) -> tuple[CalibratedCamera, Known]:
    """Of a calibration file, or of OpenCV, ROS, Kalibr or mrcal, whose files tell no errors: they are taken as exact.

    InputError: none of these, or a damaged one.
    """
    if _is_ours(path):
        camera, known, _ = read_calibration(path)
        return camera, known
    camera = read_camera(path)
    return camera, Known(_intrinsics(camera), np.array(camera.distortion), None)


def known_scanner(path: Path) -> tuple[CalibratedCamera, KnownScanner, str | None]:
    """Of a calibration file: camera, all that it tells with its errors, and the board that it was made with.

    InputError: no such file, one without errors, or a damaged one.
    """
    if not _is_ours(path):
        allowed = "calibration.json of calibrate scanner, laser or camera"
        raise InputError("a file of another program tells no errors", where=str(path), allowed=allowed)
    camera, known, data = read_calibration(path)
    found = of_project(data)
    if found.planes and not found.covariances:
        cure = "calibrate again by main.py calibrate scanner"
        raise InputError("the calibration tells no errors of its planes", where=str(path), cure=cure)
    lasers = tuple(
        known_laser(np.array(plane), np.array(rows))
        for plane, rows in zip(found.planes, found.covariances, strict=True)
    )
    count = 4 + len(camera.distortion)
    covariance = np.zeros((count, count)) if known.covariance is None else known.covariance
    board = data.get("board")
    told = board if isinstance(board, str) else None
    return camera, KnownScanner(known.intrinsics, known.distortion, covariance, lasers), told


def held_camera(file: Path | None, size: tuple[int, int]) -> Known:
    """The camera that lasers alone are calibrated with. InputError: none, or one of images of another size, px."""
    if file is None:
        raise InputError("lasers alone need a camera", allowed="a file that has one")
    camera, known = known_camera(file)
    check_size(camera, size, str(file))
    return known


def check_size(camera: CalibratedCamera, size: tuple[int, int], where: str) -> None:
    """size (width, height) px of the photographs. InputError: they are not of that camera."""
    if (camera.width, camera.height) != size:
        found, allowed = "{} x {} px".format(*size), f"{camera.width} x {camera.height} px"
        raise InputError("the photographs are not of that camera", where=where, found=found, allowed=allowed)


def known_laser(plane: Float, covariance: Float) -> KnownLaser:
    """From a file's order, fx, fy, cx, cy, a, b, c, d and distortion, to the camera and then m = -n / d."""
    count = len(covariance)
    a_d = slice(4, 8)
    to_m = np.column_stack([-np.eye(3) / plane[3], plane[:3] / plane[3] ** 2])
    jacobian = np.zeros((count - 1, count))
    jacobian[:4, :4] = np.eye(4)
    jacobian[4 : count - 4, 8:] = np.eye(count - 8)
    jacobian[count - 4 :, a_d] = to_m
    return KnownLaser(plane_vector(plane), jacobian @ covariance @ jacobian.T)


def _intrinsics(camera: CalibratedCamera) -> Float:
    return np.array([camera.fx, camera.fy, camera.cx, camera.cy])


def _is_ours(path: Path) -> bool:
    text: Any = read_bytes(path, MAX_BYTES, "camera file")
    return CALIBRATION_KIND.encode() in text or (text.lstrip()[:1] == b"{" and b"lensmodel" not in text)
