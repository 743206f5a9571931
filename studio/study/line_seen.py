"""What a base project shows of its line before anything is rendered: how wide it is, and where it meets the pixels."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from studio.preview.preview import Preview
from studio.preview.readouts import readouts
from studio.project.project import Project


@dataclass(frozen=True)
class LineSeen:
    """width: median sigma over the line, px, with the lens's blur; None: no line is in the image. together: length of
    the mean of unit vectors, a turn for each pixel: 1 where all scan lines meet it at one place, about 0 at all."""

    width: float | None
    together: float


def line_seen(project: Project, laser: int) -> LineSeen:
    """At the image scale of the project. InputError: a mesh or texture cannot be read."""
    return _seen(project.to_text(), project.folder, laser)


@lru_cache(maxsize=64)
def _seen(text: str, folder: Path, laser: int) -> LineSeen:
    look = Preview().look(Project.from_text(text, "study").in_folder(folder), folder)
    position, told = look.lit_curve(laser).position, readouts(look, laser)
    together = float(np.abs(np.mean(np.exp(2j * np.pi * position)))) if len(position) else 0.0
    if told.width_px is None:
        return LineSeen(None, together)
    # the sigma of a disc along one direction is a quarter of its diameter
    blur = told.blur_px.middle / 4.0 if told.blurs_images and told.blur_px is not None else 0.0
    return LineSeen(math.hypot(told.width_px.middle, blur), together)
