"""What figures of a study at another image scale are worth, told before it runs."""

from __future__ import annotations

import math
from collections.abc import Mapping
from contextlib import suppress
from functools import lru_cache
from pathlib import Path

from analysis.report.total import NARROW_PX
from render.base.errors import InputError
from studio.preview.preview import Preview
from studio.preview.readouts import readouts
from studio.project.project import Project
from studio.scan.stages import scaled
from studio.study.draft import IMAGE_SCALE
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
            widths.append(_width(project.to_text(), base.folder, study.laser))
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
            width = _width(scaled(base, scale).to_text(), base.folder, laser)
        except InputError:  # told where the cells are counted
            return IMAGE_SCALE
        if width is None:
            return IMAGE_SCALE
        if width >= NARROW_PX:
            return scale
    return 1.0


@lru_cache(maxsize=32)
def _width(text: str, folder: Path, laser: int) -> float | None:
    """Median sigma over the line, px, with the lens's blur; None: no line is in the image. text: of the project."""
    project = Project.from_text(text, "study").in_folder(folder)
    told = readouts(Preview().look(project, folder), laser)
    if told.width_px is None:
        return None
    # the sigma of a disc along one direction is a quarter of its diameter
    blur = told.blur_px.middle / 4.0 if told.blurs_images and told.blur_px is not None else 0.0
    return math.hypot(told.width_px.middle, blur)
