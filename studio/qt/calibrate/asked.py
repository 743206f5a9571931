"""What the adjustment is given of what a person asked for."""

from __future__ import annotations

from typing import TYPE_CHECKING

from studio.qt.calibrate.calibration_work import CalibrationWork

if TYPE_CHECKING:
    from analysis.calibration.board import Board
    from analysis.calibration.calibrate import Request
    from studio.calibration.material import Material


def asked_of(work: CalibrationWork, material: Material, board: Board) -> tuple[Material, Request]:
    """The views with what is looked at of them, and the request.

    InputError: what is asked for cannot be done with these views.
    """
    from analysis.calibration.calibrate import Request
    from studio.calibration.known import held_camera
    from studio.calibration.material import need_a_line
    from studio.calibration.motion_file import told_of

    if work.what == "camera":
        material = material.without_lasers()
    elif not work.virtual:
        need_a_line(material, work.source)
    told = material.told
    if work.motion_file is not None and not work.virtual:
        told = told_of(work.motion_file, work.holds, [shot.name for shot in work.shots])
    known = held_camera(work.camera_file, material.size) if work.what == "laser" else None
    return material, Request(
        material.size,
        material.lasers,
        work.terms if known is None else None,
        nearest=work.nearest,
        farthest=work.farthest,
        known=known,
        told=told,
        circle=board.circle,
    )
