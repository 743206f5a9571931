"""What was found is kept: as a calibration file, and in the open project, as a step of its history.

What cannot be done is told in the work's `problem`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from render.base.errors import InputError
from studio.qt.calibrate.calibration_work import CalibrationWork

FORMS = {
    "Calibration (*.json)": "",
    "Camera for OpenCV (*.yaml)": "opencv",
    "Camera for ROS (*.yaml)": "ros",
    "Camera for Kalibr (*.yaml)": "kalibr",
    "Camera for mrcal (*.cameramodel)": "mrcal",
}
"""As a file dialog offers them, and which of `exchange.WRITERS` writes it; "": the calibration file."""


def save(work: CalibrationWork, file: Path, form: str = "") -> None:
    """Write the calibration file, or the camera in a format of others, whole or not at all."""
    from studio.calibration.calibration_file import write_calibration
    from studio.calibration.exchange import write_camera
    from studio.calibration.solving import in_window, of_project

    if work.solved is None:
        return
    data = _data(work)
    try:
        if form:
            camera = of_project(data).camera
            assert camera is not None
            write_camera(file, camera, form)
        else:
            write_calibration(file, data)
    except InputError as error:
        work.tell(in_window(error))
        return
    if not form:  # formats of others hold the camera alone
        work.kept = work.solved
    work.session.message.emit("info", f"Saved the {'camera' if form else 'calibration'}: {file}")
    work.tell("")


def use(work: CalibrationWork) -> None:
    """Points of the project are made with what was found."""
    if work.solved is not None and _use(work, _data(work)):
        work.kept = work.solved


def use_file(work: CalibrationWork, file: Path) -> None:
    """Points of the project are made with a calibration file."""
    from studio.project.calibration import read_calibration_file

    try:
        data = read_calibration_file(file, str(file))
    except InputError as error:
        work.tell(str(error))
        return
    _use(work, data)


def remove(work: CalibrationWork) -> None:
    """Points of the project are made with its scene's camera and planes, as if they were exact."""
    from studio.project.calibration import Calibration

    work.session.set(("calibration",), Calibration(), "remove the calibration")


def _use(work: CalibrationWork, data: dict[str, Any]) -> bool:
    """False: the project does not take it, which is told."""
    from studio.calibration.solving import of_project

    try:
        work.session.document.set(("calibration",), of_project(data), "use the calibration")
    except InputError as error:
        work.tell(f"The project does not take the calibration: {error}")
        return False
    work.session.message.emit("info", "Points of the project are made with the calibration")
    work.tell("")
    return True


def _data(work: CalibrationWork) -> dict[str, Any]:
    from studio.calibration.board_text import board_text
    from studio.calibration.calibration_file import file_data

    solved = work.solved
    assert solved is not None
    return file_data(solved.result, solved.size, board_text(solved.board))
