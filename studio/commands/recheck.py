"""What `main.py calibrate check` does: one to three new photographs tell whether a calibration still holds."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from render.base.errors import InputError
from studio.runtime.console import print_table, stage_progress
from studio.runtime.streams import print_json

if TYPE_CHECKING:
    from analysis.calibration.recheck import Part


def check_calibration(
    folder: Path | None, *, camera: Path | None, board: str | None, axis: str, channel: str, quiet: bool, as_json: bool
) -> int:
    """Photographs of the board, named as for a calibration; returns how many files had faults.

    board: None takes that of the calibration. InputError: no photograph is usable; no calibration file with errors.
    """
    from analysis.calibration.recheck import recheck
    from analysis.line.extract import settings_of
    from studio.calibration.board_text import parse_board
    from studio.calibration.image_views import shots
    from studio.calibration.known import check_size, known_scanner
    from studio.calibration.material import photographed
    from studio.calibration.words import recheck_sentence, recheck_verdict

    if folder is None:
        raise InputError(
            "no folder of new photographs", where="calibrate check", allowed="a folder with 1 to 3 of them"
        )
    if camera is None:
        raise InputError("no calibration to check", where="--camera", allowed="a file of calibrate scanner")
    held, known, told = known_scanner(camera)
    target = parse_board(board or told or "")
    with stage_progress(quiet or as_json) as progress:
        found = photographed(
            shots(folder),
            target,
            settings_of(None, axis=axis, channel=channel),
            lasers=bool(known.lasers),
            progress=lambda done: progress("photographs", done),
        )
    check_size(held, found.size, "--camera")
    result = recheck(found.views, target.target, known, target.circle)
    verdict = recheck_verdict(result)
    notes = [*found.notes, *result.left_out]
    unseen = [f"laser {i}" for i in range(len(known.lasers)) if all(part.laser != i for part in result.parts)]
    notes += [f"{name} is in no photograph and was not checked" for name in unseen]
    if all(part.laser is not None for part in result.parts):
        notes.append("the camera came without its errors and was not checked")
    if as_json:
        print_json(
            {
                "ok": not found.errors,
                "holds": not result.changed,
                "verdict": verdict,
                "parts": [_data(part) for part in result.parts],
                "errors": list(found.errors),
                "notes": notes,
            }
        )
    else:
        rows = [(part.name, recheck_sentence(part)) for part in result.parts]
        print_table(f"{camera.name} by {len(found.views)} new photographs", rows)
        for note in () if quiet else notes:
            print(note)
        print(verdict)
    for fault in found.errors:
        print(f"error: {fault}", file=sys.stderr)
    return len(found.errors)


def _data(part: Part) -> dict[str, Any]:
    unit = "px" if part.laser is None else "m"
    return {"part": part.name, f"off_rms_{unit}": part.off, f"noise_rms_{unit}": part.noise, "p": part.p}
