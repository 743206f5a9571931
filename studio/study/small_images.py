"""What figures of a study at another image scale are worth, told before it runs."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress

from analysis.report.total import NARROW_PX
from render.base.errors import InputError
from studio.project.project import Project
from studio.scan.stages import scaled
from studio.study.draft import IMAGE_SCALE
from studio.study.line_seen import line_seen
from studio.study.study import Study, with_fields

SCALES = (IMAGE_SCALE, 0.5, 1.0)
"""Of a new study, the fastest first."""


def small_image_doubts(study: Study, bases: Mapping[str, Project]) -> tuple[str, ...]:
    """That the figures are not the scanner's, and that the line is too thin there; nothing at the scanner's own scale.

    Widths are of the base projects with what the study fixes, without what it varies.
    """
    scale = study.image_scale
    if scale == 1.0:
        return ()
    each = f"each pixel is {1.0 / scale:.3g} times as large, and " if scale < 1.0 else ""
    said = [f"At image scale {scale:.3g} {each}figures are not the scanner's: image scale 1 gives those."]
    widths = []
    for base in bases.values():
        with suppress(InputError):  # told where the cells are counted
            project = scaled(with_fields(base, study.set, "set"), scale)
            widths.append(line_seen(project.in_folder(base.folder), study.laser).width)
    known = [width for width in widths if width is not None]
    if known and min(known) < NARROW_PX:
        said.append(
            f"The line is {min(known):.2g} px wide there (sigma), too thin for its methods, which want "
            f"{NARROW_PX:g} px: errors are larger than by the scale alone."
        )
    return tuple(said)


def first_scale(base: Project, laser: int = 0) -> float:
    """The smallest image scale at which a new study of a project is not told that its line is too thin; else 1."""
    for scale in SCALES:
        try:
            width = line_seen(scaled(base, scale).in_folder(base.folder), laser).width
        except InputError:  # told where the cells are counted
            return IMAGE_SCALE
        if width is None:
            return IMAGE_SCALE
        if width >= NARROW_PX:
            return scale
    return 1.0
