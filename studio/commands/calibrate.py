"""What `main.py calibrate` does: photographs or virtual boards to a calibration file, and how good it is."""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from render.base.errors import InputError
from studio.runtime.console import print_table, stage_progress
from studio.runtime.streams import print_json

if TYPE_CHECKING:
    from analysis.calibration.calibrate import Calibrated, Known
    from analysis.calibration.motion import Held
    from studio.calibration.material import Material
    from studio.project.calibration import CalibratedCamera

PARTS = ("camera", "laser", "scanner")
BOARD = "checkerboard:13x9:25mm"
"""The founding paper's."""


@dataclass(frozen=True)
class CalibrateOptions:
    """As the command line has them; lengths in m, angles in degrees."""

    board: str
    out: Path | None
    camera: Path | None
    """Of a camera that is calibrated already."""
    lens: str
    axis: str
    channel: str
    nearest: float | None
    farthest: float | None
    most_tilt: float
    target_um: float | None
    views: int
    seed: int
    corner_sigma: float
    line_sigma: float
    export: tuple[str, ...]
    motion: Path | None
    """Table of what carried the board."""
    hand: str
    project: Path | None
    """That takes on what photographs tell."""


def calibrate_command(what: str, folder: Path | None, *, quiet: bool, as_json: bool, **given: Any) -> int:
    """`calibrate camera|laser|scanner FOLDER`, or `calibrate PROJECT`; returns how many files had faults.

    InputError: nothing is usable, or what there is does not determine what is asked for.
    """
    from analysis.calibration.calibrate import Request, calibrate
    from studio.calibration.board_text import board_text, parse_board
    from studio.calibration.calibration_file import file_data, write_calibration
    from studio.calibration.in_silico import other_ways, true_depth_error
    from studio.calibration.into_project import into_project
    from studio.calibration.known import check_size
    from studio.calibration.material import virtual, with_faults
    from studio.calibration.motion_file import motion_values
    from studio.calibration.words import other_rows
    from studio.commands.places import load_project

    if what == "check":
        from studio.commands.recheck import check_calibration

        heard = {name: given[name] for name in ("camera", "board", "axis", "channel")}
        return check_calibration(folder, **heard, quiet=quiet, as_json=as_json)
    options = CalibrateOptions(**given | {"board": given["board"] or BOARD})
    _check_options(what, options)
    board, truth = parse_board(options.board), None
    camera, known = _known(options) if what == "laser" else (None, None)
    with stage_progress(quiet or as_json) as progress:
        if what in PARTS and folder is not None:
            material = _photographed(what, folder, options, progress)
            out = options.out or folder / "calibration.json"
        elif folder is None and what not in PARTS:
            project, _ = load_project(Path(what))
            material, truth = virtual(
                project,
                board,
                options.nearest,
                options.farthest,
                count=options.views,
                seed=options.seed,
                most_tilt=float(np.radians(options.most_tilt)),
                sigmas=(options.corner_sigma, options.line_sigma),
            )
            out = options.out or Path("scan-output") / "calibration.json"
        else:
            allowed = "camera, laser, scanner or check with a FOLDER, or a project alone"
            raise InputError("not known what to calibrate", where="calibrate", found=what, allowed=allowed)
        if camera is not None:
            check_size(camera, material.size, "--camera")
        progress("adjustment", 0.0)
        request = Request(
            material.size,
            material.lasers,
            None if options.lens == "auto" else int(options.lens),
            nearest=options.nearest,
            farthest=options.farthest,
            most_tilt=float(np.radians(options.most_tilt)),
            known=known,
            told=material.told,
            circle=board.circle,
        )
        try:
            result = calibrate(material.views, board.target, request)
        except InputError as error:
            raise with_faults(error, material) from None
        progress("adjustment", 1.0)
    data = file_data(result, material.size, board_text(board))
    write_calibration(out, data)
    files = [str(out), *_exported(out, data, options.export)]
    if options.project is not None:
        files.append(str(into_project(options.project, data)))
    true = None if truth is None else true_depth_error(result, truth)
    others = {} if truth is None else other_ways(material.views, board, material.size, result, truth)
    if as_json:
        extra = {"errors": list(material.errors), "notes": list(material.notes), "files": files}
        print_json(
            {
                "ok": not material.errors,
                **data,
                **extra,
                "next_pose": _advice_data(result),
                "true_depth_rms_m": None if true is None else [one for one, _ in true],
                "true_depth_rms_m_by_other_ways": others,
                "true_motion": None if truth is None else motion_values(truth),
            }
        )
    else:
        _print(result, material, true, options, quiet)
        if others and true:
            print()
            header = ("way", *(f"laser {one.volume.laser} um" for one in result.depth))
            print_table("True depth error by the usual ways", other_rows(others, true), header=header)
        for file in files:
            print(f"wrote {file}")
    for fault in material.errors:
        print(f"error: {fault}", file=sys.stderr)
    return len(material.errors)


def _photographed(what: str, folder: Path, options: CalibrateOptions, progress: Any) -> Material:
    from analysis.line.extract import settings_of
    from studio.calibration.image_views import shots
    from studio.calibration.material import need_a_line, photographed
    from studio.calibration.motion_file import told_of

    settings = settings_of(None, axis=options.axis, channel=options.channel)
    with_lasers, taken = what != "camera", shots(folder)
    told = None
    if options.motion is not None:
        hand: Held = "board" if options.hand == "board" else "camera"
        told = told_of(options.motion, hand, [shot.name for shot in taken])
    found = photographed(
        taken,
        _board(options),
        settings,
        lasers=with_lasers,
        progress=lambda done: progress("photographs", done),
    )
    if with_lasers:
        need_a_line(found, str(folder))
    return replace(found, told=told)


def _check_options(what: str, options: CalibrateOptions) -> None:
    """InputError: options that contradict each other, or that would go unheard."""
    if options.nearest is not None and options.farthest is not None and options.farthest <= options.nearest:
        allowed = f"beyond --nearest, {options.nearest:g} m"
        raise InputError(
            "not beyond the nearest distance", where="--farthest", found=f"{options.farthest:g} m", allowed=allowed
        )
    if what != "laser" and options.camera is not None:
        cure = "calibrate laser FOLDER --camera FILE holds a camera that is known"
        raise InputError(
            "a known camera is for the laser alone", where="--camera", found=f"calibrate {what}", cure=cure
        )
    if what not in PARTS and options.motion is not None:
        cure = "leave it out: a project's own motion carries a virtual board"
        raise InputError("a table of the motion is for photographs", where="--motion", found=what, cure=cure)
    if what not in PARTS and options.project is not None:
        cure = "leave it out: a project's points are not to be made with errors that were drawn for it"
        raise InputError("a project takes on what photographs tell", where="--project", found=what, cure=cure)
    if what == "laser" and options.lens != "auto":
        cure = "leave --lens out"
        raise InputError("the known camera has its lens", where="--lens", found=options.lens, cure=cure)


def _board(options: CalibrateOptions) -> Any:
    from studio.calibration.board_text import parse_board

    return parse_board(options.board)


def _known(options: CalibrateOptions) -> tuple[CalibratedCamera, Known]:
    from studio.calibration.known import known_camera

    if options.camera is None:
        allowed = "a file of calibrate camera, of OpenCV, ROS, Kalibr or mrcal"
        raise InputError("the laser alone needs a camera", where="--camera", allowed=allowed)
    return known_camera(options.camera)


def _exported(out: Path, data: dict[str, Any], forms: tuple[str, ...]) -> list[str]:
    from studio.calibration.exchange import ENDINGS, write_camera
    from studio.project.calibration import CalibratedCamera

    camera = CalibratedCamera.model_validate(data["camera"] | {"distortion": tuple(data["camera"]["distortion"])})
    files = []
    for form in forms:
        path = out.with_name(f"{out.stem}_{ENDINGS[form]}")
        write_camera(path, camera, form)
        files.append(str(path))
    return files


def _advice_data(result: Calibrated) -> dict[str, Any] | None:
    advice = result.advice
    if advice is None:
        return None
    return {
        "centre_m": advice.centre.tolist(),
        "rotation": advice.rotation.tolist(),
        "depth_rms_before_m": advice.before,
        "depth_rms_after_m": advice.after,
    }


def _print(
    result: Calibrated,
    material: Material,
    true: list[tuple[float, float]] | None,
    options: CalibrateOptions,
    quiet: bool,
) -> None:
    from studio.calibration.words import check_rows, depth_rows, next_sentence, parameter_rows

    print_table("Calibration", parameter_rows(result, material.names), header=("parameter", "value", "sigma"))
    if result.depth:
        print()
        header = ("depth error", "calibration um", "worst um", "line um", *(("true um",) if true else ()))
        print_table("Depth over the working volume (rms)", depth_rows(result, true, material.names), header=header)
    print()
    print_table("Checks", check_rows(result, len(material.views)))
    for fault in result.faults:
        print(f"caution: {fault}")
    if not quiet:
        for note in (*material.notes, *result.adjusted.left_out):
            print(note)
    if result.advice is not None:
        print(next_sentence(result.advice, options.target_um))
