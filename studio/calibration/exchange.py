"""A camera in the formats of others: OpenCV YAML, ROS camera_info, Kalibr YAML, mrcal cameramodel.

All keep a pixel's centre at integers, as here. Numbers are written with 17 digits, so that they come back to the bit.
Sources: OpenCV, FileStorage; ROS, sensor_msgs/CameraInfo; Kalibr, yaml formats; mrcal, cameramodel file format.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from render.base.errors import InputError
from render.base.files import atomic_write, read_bytes
from render.camera.camera import MAX_SIDE
from studio.project.calibration import CalibratedCamera
from studio.project.validation_messages import input_error

MAX_BYTES = 2**22
NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
MRCAL = {0: "LENSMODEL_PINHOLE", 4: "LENSMODEL_OPENCV4", 5: "LENSMODEL_OPENCV5", 8: "LENSMODEL_OPENCV8"}
MRCAL |= {12: "LENSMODEL_OPENCV12"}


def opencv_text(camera: CalibratedCamera) -> str:
    """As cv::FileStorage writes it: camera_matrix and distortion_coefficients."""
    k = camera.distortion or (0.0,) * 4
    return (
        "%YAML:1.0\n---\n"
        f"image_width: {camera.width}\nimage_height: {camera.height}\n"
        f"camera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: {_list(_matrix(camera))}\n"
        f"distortion_coefficients: !!opencv-matrix\n   rows: 1\n   cols: {len(k)}\n   dt: d\n   data: {_list(k)}\n"
    )


def ros_text(camera: CalibratedCamera) -> str:
    """camera_info of camera_calibration_parsers. InputError: 12 or 14 distortion terms, which ROS does not have."""
    if len(camera.distortion) > 8:
        raise _cannot("ROS camera_info", camera, "0, 4, 5 or 8")
    rational = len(camera.distortion) == 8
    k = (camera.distortion + (0.0,) * 5)[: 8 if rational else 5]
    projection = [camera.fx, 0.0, camera.cx, 0.0, 0.0, camera.fy, camera.cy, 0.0, 0.0, 0.0, 1.0, 0.0]
    return (
        f"image_width: {camera.width}\nimage_height: {camera.height}\ncamera_name: camera\n"
        f"camera_matrix:\n  rows: 3\n  cols: 3\n  data: {_list(_matrix(camera))}\n"
        f"distortion_model: {'rational_polynomial' if rational else 'plumb_bob'}\n"
        f"distortion_coefficients:\n  rows: 1\n  cols: {len(k)}\n  data: {_list(k)}\n"
        f"rectification_matrix:\n  rows: 3\n  cols: 3\n  data: {_list(np.eye(3).ravel())}\n"
        f"projection_matrix:\n  rows: 3\n  cols: 4\n  data: {_list(projection)}\n"
    )


def kalibr_text(camera: CalibratedCamera) -> str:
    """camchain.yaml of one pinhole camera with radtan distortion. InputError: more than four distortion terms."""
    if len(camera.distortion) > 4:
        raise _cannot("Kalibr", camera, "0 or 4")
    model = "radtan" if camera.distortion else "none"
    return (
        f"cam0:\n  camera_model: pinhole\n  intrinsics: {_list((camera.fx, camera.fy, camera.cx, camera.cy))}\n"
        f"  distortion_model: {model}\n  distortion_coeffs: {_list(camera.distortion)}\n"
        f"  resolution: [{camera.width}, {camera.height}]\n  rostopic: /cam0/image_raw\n"
    )


def mrcal_text(camera: CalibratedCamera) -> str:
    """A cameramodel at the origin. InputError: a tilted sensor, which mrcal does not have."""
    if len(camera.distortion) not in MRCAL:
        raise _cannot("mrcal", camera, "0, 4, 5, 8 or 12")
    values = (camera.fx, camera.fy, camera.cx, camera.cy, *camera.distortion)
    return (
        "{\n"
        f"    'lensmodel': '{MRCAL[len(camera.distortion)]}',\n"
        f"    'intrinsics': {_list(values)},\n"
        "    'extrinsics': [0, 0, 0, 0, 0, 0],\n"
        f"    'imagersize': [{camera.width}, {camera.height}],\n"
        "}\n"
    )


WRITERS: dict[str, Callable[[CalibratedCamera], str]] = {
    "opencv": opencv_text,
    "ros": ros_text,
    "kalibr": kalibr_text,
    "mrcal": mrcal_text,
}
ENDINGS = {"opencv": "opencv.yaml", "ros": "camera_info.yaml", "kalibr": "kalibr.yaml", "mrcal": "camera.cameramodel"}


def write_camera(path: Path, camera: CalibratedCamera, form: str) -> None:
    """One of `WRITERS`. InputError: the format has no such lens, or the file cannot be written."""
    text = WRITERS[form](camera)
    with atomic_write(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def read_camera(path: Path) -> CalibratedCamera:
    """A camera of any of the formats, told apart by what is in the file. InputError: none of them, or damaged."""
    text = read_bytes(path, MAX_BYTES, "camera file").decode("utf-8", errors="replace")
    if "'lensmodel'" in text or '"lensmodel"' in text:
        data = _from_mrcal(text, path)
    elif re.search(r"^\s*camera_model\s*:", text, re.MULTILINE):
        data = _from_kalibr(text, path)
    elif re.search(r"^\s*camera_matrix\s*:", text, re.MULTILINE):
        data = _from_matrices(text, path)
    else:
        allowed = "OpenCV YAML, ROS camera_info, Kalibr YAML, or mrcal cameramodel"
        raise InputError("no camera is in the file", where=str(path), allowed=allowed)
    try:
        return CalibratedCamera.model_validate(data)
    except ValidationError as error:
        raise input_error(error, CalibratedCamera, data, str(path)) from None


def _from_mrcal(text: str, path: Path) -> dict[str, Any]:
    try:
        model = ast.literal_eval("\n".join(line for line in text.splitlines() if not line.strip().startswith("#")))
        lens, values = model["lensmodel"], [float(v) for v in model["intrinsics"]]
        size = [float(side) for side in model["imagersize"]]
    except (ValueError, SyntaxError, KeyError, TypeError, OverflowError, RecursionError, MemoryError):
        raise InputError("a damaged cameramodel", where=str(path), allowed="as mrcal writes it") from None
    if lens not in MRCAL.values():
        raise InputError(
            "a lens model that is not known here", where=str(path), found=lens, allowed=", ".join(MRCAL.values())
        )
    terms = next(number for number, name in MRCAL.items() if name == lens)
    _check_count("intrinsics", values, (4 + terms,), path)
    return _data(size, values, path)


def _from_kalibr(text: str, path: Path) -> dict[str, Any]:
    cameras = re.findall(r"^\s*camera_model\s*:\s*(\S+)", text, re.MULTILINE)
    if len(cameras) != 1:
        found, cure = f"{len(cameras)} of them", "keep the one that is meant"
        raise InputError("not one camera", where=str(path), found=found, allowed="1", cure=cure)
    if cameras[0] != "pinhole":  # others have other intrinsics, in another order
        raise InputError("a camera model that is not known here", where=str(path), found=cameras[0], allowed="pinhole")
    kind = _distortion_model(text, ("radtan", "none"), path)
    intrinsics, size = _numbers(text, "intrinsics", path), _numbers(text, "resolution", path)
    named = kind == "radtan" or "distortion_coeffs" in text
    coefficients = _numbers(text, "distortion_coeffs", path) if named else []
    _check_count("intrinsics", intrinsics, (4,), path)
    _check_count("distortion_coeffs", coefficients, (4 if kind == "radtan" else 0,), path)
    return _data(size, intrinsics + coefficients, path)


def _from_matrices(text: str, path: Path) -> dict[str, Any]:
    """OpenCV and ROS: matrices as rows, cols and data."""
    matrix = _matrix_of(text, "camera_matrix", path)
    k = _matrix_of(text, "distortion_coefficients", path)
    sides = [re.search(rf"^\s*image_{side}\s*:\s*(\d+)\s*$", text, re.MULTILINE) for side in ("width", "height")]
    if len(matrix) != 9 or sides[0] is None or sides[1] is None:
        allowed = "image_width, image_height, and camera_matrix of nine numbers"
        raise InputError("a damaged camera file", where=str(path), allowed=allowed)
    if re.search(r"^\s*fisheye_model\s*:\s*[^0\s]", text, re.MULTILINE):
        cure = "its coefficients mean something else; calibrate without fisheye"
        raise InputError("a fisheye lens", where=f"{path}: fisheye_model", allowed="0", cure=cure)
    if re.search(r"^\s*distortion_model\s*:", text, re.MULTILINE):  # ROS, which names its model
        kind = _distortion_model(text, ("plumb_bob", "rational_polynomial"), path)
        _check_count("distortion_coefficients", k, (4, 5) if kind == "plumb_bob" else (8,), path)
    else:
        _check_count("distortion_coefficients", k, (4, 5, 8, 12, 14), path)
    if matrix[1] != 0.0:
        raise InputError("a camera with skew", where=f"{path}: camera_matrix", found=matrix[1], allowed="0")
    if matrix[3] != 0.0 or matrix[6:] != [0.0, 0.0, 1.0]:
        where, allowed = f"{path}: camera_matrix", "[fx, 0, cx, 0, fy, cy, 0, 0, 1]"
        raise InputError("not a camera matrix, or one by columns", where=where, found=matrix, allowed=allowed)
    k = [] if not any(k) else k
    return _data([float(side[1]) for side in sides if side], [matrix[0], matrix[4], matrix[2], matrix[5], *k], path)


def _data(size: list[float], values: list[float], path: Path) -> dict[str, Any]:
    if len(size) != 2 or not all(1.0 <= side <= MAX_SIDE and side == int(side) for side in size):
        raise InputError("not an image size", where=str(path), found=size, allowed="width and height, whole pixels")
    fx, fy, cx, cy, *k = values
    width, height = (int(side) for side in size)
    return {"width": width, "height": height, "fx": fx, "fy": fy, "cx": cx, "cy": cy, "distortion": tuple(k)}


def _distortion_model(text: str, known: tuple[str, ...], path: Path) -> str:
    model = re.search(r"^\s*distortion_model\s*:\s*(\S+)", text, re.MULTILINE)
    name = model[1].strip("'\"") if model else "none named"
    if name not in known:
        where, allowed = str(path), " or ".join(known)
        raise InputError("a distortion model that is not known here", where=where, found=name, allowed=allowed)
    return name


def _check_count(name: str, values: list[float], allowed: tuple[int, ...], path: Path) -> None:
    """A lens with other coefficients than its model has is another lens."""
    if len(values) not in allowed:
        counts = " or ".join(str(count) for count in allowed)
        found = f"{len(values)} numbers"
        raise InputError("not as many numbers as the model has", where=f"{path}: {name}", found=found, allowed=counts)


def _matrix_of(text: str, name: str, path: Path) -> list[float]:
    block = re.search(rf"^\s*{name}\s*:(.*?)(?=^\S|\Z)", text, re.MULTILINE | re.DOTALL)
    if block is None:
        raise InputError("numbers are missing", where=f"{path}: {name}", allowed="a matrix with rows, cols and data")
    values = _numbers(block[1], "data", path)
    rows, cols = (re.search(rf"^\s*{side}\s*:\s*(\d{{1,6}})\s*$", block[1], re.MULTILINE) for side in ("rows", "cols"))
    if rows is None or cols is None or int(rows[1]) * int(cols[1]) != len(values):
        found = f"{len(values)} numbers"
        raise InputError("not as many numbers as rows and cols say", where=f"{path}: {name}", found=found)
    return values


def _numbers(text: str, name: str, path: Path) -> list[float]:
    """The list after a name, in brackets over any number of lines, or one item a line."""
    inline = re.search(rf"^\s*{name}\s*:\s*\[([^\]]*)\]", text, re.MULTILINE)
    items = re.search(rf"^\s*{name}\s*:\s*\n((?:\s*-\s*{NUMBER}\s*\n)+)", text, re.MULTILINE)
    if inline is None and items is None:
        raise InputError("numbers are missing", where=f"{path}: {name}", allowed="a list of numbers")
    found = inline[1].split(",") if inline else re.findall(rf"-\s+({NUMBER})", items[1] if items else "")
    try:
        return [float(one) for one in found if one.strip()]
    except ValueError:
        raise InputError("not numbers", where=f"{path}: {name}", allowed="a list of numbers") from None


def _matrix(camera: CalibratedCamera) -> list[float]:
    return [camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0]


def _list(values: Any) -> str:
    return "[" + ", ".join(repr(float(value)) for value in values) + "]"


def _cannot(form: str, camera: CalibratedCamera, allowed: str) -> InputError:
    found = f"{len(camera.distortion)} distortion terms"
    return InputError(f"{form} has no such lens", found=found, allowed=allowed, cure="calibrate with --lens so many")
