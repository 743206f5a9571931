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
