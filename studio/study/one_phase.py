"""Whether all scan lines of a study see the line at one place between two pixels, told before it runs.

A method's error depends on that place where a line is thin or saturates; one place is no sample of it.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from functools import lru_cache
from pathlib import Path

import numpy as np

from render.base.errors import InputError
from studio.preview.preview import Preview
from studio.project.project import Project
from studio.scan.stages import scaled
from studio.study.study import Study, Sweep, with_fields

TOGETHER = 0.99
"""Length of the mean of unit vectors, a turn for each pixel: 1 at one place, about 0 where all places are met alike."""


def one_phase_doubts(study: Study, bases: Mapping[str, Project]) -> tuple[str, ...]:
    """Of base projects as they stand with what the study fixes; none: the line meets the pixels at many places."""
    alike = []
    for name, base in bases.items():
        of_line = [one for one in study.sweeps if (one.base or study.base) == name and _is_of_line(one)]
        fixed = [{**study.set, **sweep.set} for sweep in of_line]
        with suppress(InputError):  # told where the cells are counted
            projects = [scaled(with_fields(base, each, "set"), study.image_scale) for each in fixed]
            if any(_together(one.to_text(), base.folder, study.laser) > TOGETHER for one in projects):
                alike.append(base.name)
    if not alike:
        return ()
    return (
        f"In {', '.join(alike)} every scan line sees the line at one place between two pixels, and errors are of that "
        "place alone: roll the camera a little (its rotation about z, 0.03 rad) to meet all of them.",
    )


def _is_of_line(sweep: Sweep) -> bool:
    return sweep.chart != "pictures" and any(name.startswith(("position_", "depth_")) for name in sweep.asked)


@lru_cache(maxsize=64)
def _together(text: str, folder: Path, laser: int) -> float:
    """0 where no line is in the image. text: of the project."""
    project = Project.from_text(text, "study").in_folder(folder)
    position = Preview().look(project, folder).lit_curve(laser).position
    return float(np.abs(np.mean(np.exp(2j * np.pi * position)))) if len(position) else 0.0
