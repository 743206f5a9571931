"""A camera goes out in every format and comes back with every pixel where it was."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from analysis.calibration.lens import project
from render.base.errors import InputError
from studio.calibration.exchange import WRITERS, read_camera, write_camera
from studio.project.calibration import CalibratedCamera
from tests.analysis.calibration.boards import LENS

TERMS = {"opencv": (4, 5, 8, 12, 14), "ros": (0, 5, 8), "kalibr": (0, 4), "mrcal": (0, 4, 5, 8, 12)}


def camera(terms: int) -> CalibratedCamera:
    return CalibratedCamera(
        width=2448, height=2048, fx=3478.26 / 3, fy=3477.1 / 3, cx=1223.123456789012, cy=1 / 3, distortion=LENS[:terms]
    )


def pixels(one: CalibratedCamera) -> np.ndarray:
    q = np.random.default_rng(0).uniform(-0.3, 0.3, (100, 2))
    return project(q, np.array([one.fx, one.fy, one.cx, one.cy]), np.array(one.distortion))[0]


@pytest.mark.parametrize(("form", "terms"), [(form, n) for form, all_of_it in TERMS.items() for n in all_of_it])
def test_there_and_back_within_a_nanopixel(form: str, terms: int, tmp_path: Path) -> None:
    write_camera(tmp_path / "camera", camera(terms), form)
    back = read_camera(tmp_path / "camera")
    assert (back.width, back.height) == (2448, 2048)
    np.testing.assert_allclose(pixels(back), pixels(camera(terms)), atol=1e-9, rtol=0.0)


def test_opencv_reads_what_is_written_for_it(tmp_path: Path) -> None:
    path = tmp_path / "camera.yaml"
    write_camera(path, camera(5), "opencv")
    file = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
    np.testing.assert_array_equal(file.getNode("camera_matrix").mat()[0], [3478.26 / 3, 0.0, 1223.123456789012])
    np.testing.assert_array_equal(file.getNode("distortion_coefficients").mat().ravel(), LENS[:5])


def test_files_written_by_opencv_are_read(tmp_path: Path) -> None:
    path = tmp_path / "theirs.yml"
    file = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    file.write("image_width", 640)
    file.write("image_height", 480)
    file.write("camera_matrix", np.array([[500.5, 0.0, 320.25], [0.0, 501.0, 240.0], [0.0, 0.0, 1.0]]))
    file.write("distortion_coefficients", np.array([LENS[:14]]))
    file.release()
    back = read_camera(path)
    assert (back.fx, back.fy, back.cx) == (500.5, 501.0, 320.25)
    np.testing.assert_allclose(back.distortion, LENS, rtol=1e-15)


def test_a_lens_that_a_format_does_not_have_is_refused(tmp_path: Path) -> None:
    for form, terms in (("ros", 12), ("kalibr", 5), ("mrcal", 14)):
        with pytest.raises(InputError, match="no such lens"):
            write_camera(tmp_path / form, camera(terms), form)
    assert set(TERMS) == set(WRITERS)


OPENCV = (
    "%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\n"
    "camera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n"
    "   data: [500., 0., 320., 0., 501., 240., 0., 0., 1.]\n"
    "distortion_coefficients: !!opencv-matrix\n   rows: 1\n   cols: 4\n   dt: d\n   data: [-0.1, 0.1, 0., 0.]\n"
)
ROS = OPENCV.replace("%YAML:1.0\n---\n", "distortion_model: plumb_bob\n")
KALIBR = (
    "cam0:\n  camera_model: pinhole\n  intrinsics: [500.0, 501.0, 320.0, 240.0]\n  distortion_model: radtan\n"
    "  distortion_coeffs: [-0.1, 0.1, 0.0, 0.0]\n  resolution: [640, 480]\n"
)
MRCAL = (
    "{'lensmodel': 'LENSMODEL_OPENCV4', 'intrinsics': [500.0, 501.0, 320.0, 240.0, -0.1, 0.1, 0.0, 0.0],"
    " 'imagersize': [640, 480]}"
)


@pytest.mark.parametrize(
    ("text", "old", "new"),
    [
        (KALIBR, "pinhole", "omni"),  # its intrinsics begin with xi
        (KALIBR, "[500.0,", "[0.9, 500.0,"),
        (KALIBR, "radtan", "none"),
        (KALIBR, "  distortion_model: radtan\n", ""),
        (KALIBR, "0.1, 0.0, 0.0]", "0.1]"),
        (KALIBR, "640", "nan"),
        (KALIBR, "640", "inf"),
        (KALIBR, "640", "640.5"),
        (KALIBR, "500.0", "nan"),
        (KALIBR, "cam0:", "cam0:\n  camera_model: pinhole\ncam1:"),
        (MRCAL, "OPENCV4", "OPENCV8"),
        (MRCAL, "LENSMODEL_OPENCV4", "LENSMODEL_PINHOLE"),
        (MRCAL, "640", "1e999"),
        (MRCAL, "640", "640.5"),
        (MRCAL, "500.0", "1" + 400 * "0"),
        (OPENCV, "distortion_coefficients", "distortion"),
        (OPENCV, "[-0.1, 0.1, 0., 0.]", "[-0.1, 0.1, 0.]"),
        (OPENCV, "cols: 4", "cols: 5"),
        (OPENCV, "320., 0., 501., 240., 0., 0.", "0., 0., 501., 0., 320., 240."),
        (OPENCV, "---\n", "---\nfisheye_model: 1\n"),
        (OPENCV, "image_width: 640", "image_width: 640.5"),
        (ROS, "plumb_bob", "rational_polynomial"),
        (ROS, "plumb_bob", "equidistant"),
    ],
)
def test_a_camera_of_another_kind_is_not_read_as_ours(text: str, old: str, new: str, tmp_path: Path) -> None:
    path = tmp_path / "camera"
    path.write_text(text)
    assert read_camera(path).fy == 501.0
    assert old in text
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(InputError, match=str(path)):
        read_camera(path)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "hello: 1",
        "{'lensmodel': 'LENSMODEL_CAHVOR', 'intrinsics': [1], 'imagersize': [1, 1]}",
        "{'lensmodel': ",
        "camera_matrix:\n  data: [1, 2, x]\n",
        "cam0:\n  camera_model: pinhole\n  distortion_model: equidistant\n",
    ],
)
def test_what_is_no_camera_is_told(text: str, tmp_path: Path) -> None:
    (tmp_path / "camera").write_text(text)
    with pytest.raises(InputError, match="camera"):
        read_camera(tmp_path / "camera")
