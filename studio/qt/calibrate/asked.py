"""What the adjustment is given of what a person asked for."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from render.base.errors import Cancelled, InputError
from studio.qt.calibrate.calibration_work import CalibrationWork

if TYPE_CHECKING:
    from analysis.calibration.board import Board
    from analysis.calibration.calibrate import Request
    from analysis.calibration.recheck import Recheck
    from render.base.threads import Cancel
    from studio.calibration.material import Material
    from studio.calibration.solving import Solved
    from studio.runtime.jobs import Progress

    Found = Solved | Recheck
    Task = Callable[[], Found]


def task_of(work: CalibrationWork, material: Material, board: Board) -> Callable[[Progress, Cancel], Found | str]:
    """What is done in the background; it returns why it could not be. InputError: as `asked_of`."""
    task = (_checked if work.what == "check" else _solved)(work, material, board)

    def look(progress: Progress, cancelled: Cancel) -> Found | str:
        progress("check" if work.what == "check" else "adjustment", 0.0)
        try:
            found = task()
        except InputError as error:
            return str(error)
        if cancelled():
            raise Cancelled
        return found

    return look


def _solved(work: CalibrationWork, material: Material, board: Board) -> Task:
    """The calibration by the views that count."""
    from studio.calibration.solving import solve

    dropped, truth = frozenset(work.dropped), work.truth
    material, request = asked_of(work, material, board)
    return lambda: solve(material, dropped, board, request, truth)


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


def _checked(work: CalibrationWork, material: Material, board: Board) -> Task:
    """Whether the calibration of a file still holds. InputError: no such file, or one of images of another size."""
    from analysis.calibration.recheck import recheck
    from studio.calibration.known import check_size, known_scanner

    if work.camera_file is None:
        raise InputError("no calibration to check", allowed="a calibration file with errors")
    camera, known, _ = known_scanner(work.camera_file)
    check_size(camera, material.size, str(work.camera_file))
    kept = material.without(frozenset(work.dropped))
    return lambda: recheck(kept.views, board.target, known, board.circle)
