"""What was found is kept: as a calibration file, and in the open project, as a step of its history.

What cannot be done is told in the work's `problem`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from PySide6.QtWidgets import QFileDialog, QWidget

from render.base.errors import InputError
from studio.qt.calibrate.calibration_work import CalibrationWork
from studio.qt.core.dialogs import ask_to_keep

FORMS = {
    "Calibration (*.json)": "",
    "Camera for OpenCV (*.yaml)": "opencv",
    "Camera for ROS (*.yaml)": "ros",
    "Camera for Kalibr (*.yaml)": "kalibr",
    "Camera for mrcal (*.cameramodel)": "mrcal",
}
"""As a file dialog offers them, and which of `exchange.WRITERS` writes it; "": the calibration file."""
_NOT_USED = "is neither saved nor used in the project: camera, laser planes and their uncertainty are lost."
OF_PHOTOGRAPHS = f"What was calibrated from photographs {_NOT_USED}"
OF_BOARDS = f"What was calibrated from virtual boards {_NOT_USED}"


def may_go(work: CalibrationWork, parent: QWidget, *, quits: bool) -> bool:
    """Whether the open project may be closed; asks where a calibration goes with it. quits: the window closes.

    Photographs and what was found of them stay when another project is opened; virtual boards are of this one.
    """
    if work.solved is None or work.solved is work.kept or not (quits or work.virtual):
        return True
    what = OF_BOARDS if work.virtual else OF_PHOTOGRAPHS
    answer = ask_to_keep(parent, "unsaved-calibration", "Save the calibration?", what, "Save…")
    return answer == "discard" or (answer == "save" and ask_and_save(work, parent))


def ask_and_save(work: CalibrationWork, parent: QWidget) -> bool:
    """Ask where, and save there; False: the calibration is in no file."""
    if work.solved is None:
        return False
    place = work.source if work.shots else str(work.session.place)
    suggestion = str(Path(place) / "calibration.json")
    chosen, kind = QFileDialog.getSaveFileName(parent, "Save the calibration", suggestion, ";;".join(FORMS))
    if chosen:
        path, ending = Path(chosen), kind.rpartition("*")[2].rstrip(")")
        save(work, path if path.suffix else path.with_suffix(ending or ".json"), FORMS.get(kind, ""))
    return work.solved is work.kept


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
