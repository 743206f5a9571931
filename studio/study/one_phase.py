"""Whether all scan lines of a study see the line at one place between two pixels, told before it runs.

A method's error depends on that place where a line is thin or saturates; one place is no sample of it.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress

from render.base.errors import InputError
from studio.project.project import Project
from studio.scan.stages import scaled
from studio.study.line_seen import line_seen
from studio.study.study import Study, Sweep, with_fields

TOGETHER = 0.99
"""Of `LineSeen.together`: the line is at one place, but for a hundredth."""


def one_phase_doubts(study: Study, bases: Mapping[str, Project]) -> tuple[str, ...]:
    """Of base projects as they stand with what the study fixes; none: the line meets the pixels at many places."""
    alike = []
    for name, base in bases.items():
        of_line = [one for one in study.sweeps if (one.base or study.base) == name and _is_of_line(one)]
        fixed = [{**study.set, **sweep.set} for sweep in of_line]
        with suppress(InputError):  # told where the cells are counted
            projects = [scaled(with_fields(base, each, "set"), study.image_scale) for each in fixed]
            if any(line_seen(one.in_folder(base.folder), study.laser).together > TOGETHER for one in projects):
                alike.append(base.name)
    if not alike:
        return ()
    return (
        f"In {', '.join(alike)} every scan line sees the line at one place between two pixels, and errors are of that "
        "place alone: roll the camera a little (its rotation about z, 0.03 rad) to meet all of them.",
    )


def _is_of_line(sweep: Sweep) -> bool:
    return sweep.chart != "pictures" and any(name.startswith(("position_", "depth_")) for name in sweep.asked)
