"""Why the project does not take a change, as the window tells it: in its own words, with the way out."""

from __future__ import annotations

import re

from render.base.errors import InputError

CALIBRATION = re.compile(r"(project: )?calibration(\.camera|\.motion)? (is|has) ")
OF_CAMERA = re.compile(r"calibration\.camera is of (.+?) px; allowed: (.+?) px, as the scene's camera")
OF_LASERS = re.compile(r"calibration has (\d+) (?:planes|covariances); allowed: none, or (\d+), one for each laser")
WAY_OUT = "Calibrate > Remove it from the project, or calibrate anew"


def refusal(error: InputError) -> str:
    """Of a change that does not go with the project's calibration, the menu that takes it out; others as they are."""
    text = str(error)
    if not CALIBRATION.match(text):
        return text
    text = OF_CAMERA.sub(r"the project's calibration is of a camera of \1 px, and the project's would have \2 px", text)
    text = OF_LASERS.sub(r"the number of lasers of the calibration is \1, and the project would have \2", text)
    return f"{text.replace('calibration.motion', 'the motion of the calibration')}: {WAY_OUT}"
