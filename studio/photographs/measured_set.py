"""A set of photographs measured by what is wished of it, for whoever shows more than tables."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from analysis.line.extract import settings_of
from analysis.line.result import Flag
from render.base.errors import InputError
from studio.photographs.evidence_words import CONTROLS
from studio.photographs.photograph_set import NEARBY, Look, Wishes, look_at
from studio.photographs.photographs import Measured, extract_photograph

OPTIONS_AS_CONTROLS = {"--off": "laser-off images", "--roi": "rectangle"}
"""Where an error is, in the words of the window."""
THINNEST = 0.3
"""px, sigma of the image of a line; a lens and a colour mosaic alone make it wider."""


@dataclass(frozen=True)
class MeasuredSet:
    """What was chosen for all, the line of each, and why one has none."""

    look: Look
    lines: dict[Path, Measured] = field(default_factory=dict)
    problems: dict[Path, str] = field(default_factory=dict)

    @property
    def chosen(self) -> list[str]:
        """What was chosen for all of them, and doubts; without what is said of lines where none is found."""
        some = any(one.line.valid.any() for one in self.lines.values())
        told = [f"{what}: {how}" for what, how in self.look.told if some or what != "lines"]
        of_all = [f"Of all {len(self.look.offs)} photographs together:"] if len(self.look.offs) > 1 else []
        return [*of_all, *told, *(f"warning: {text}" for text in self.look.warnings)]

    def told_of(self, path: Path) -> str:
        """One line of text on a photograph."""
        if path not in self.lines:
            return self.problems.get(path, "not measured yet: press Measure")
        line = self.lines[path].line
        found = line.valid[:, 0]
        count = self.look.region.scan_lines(len(found), line.axis)
        if not found.any():
            return f"no line found on {count} {line.axis}; {line.note}"
        sigma = float(np.nanmedian(line.sigma_u[found, 0]))
        width = float(np.median(line.width[found, 0]))
        told = f"{found.sum()} of {count} {line.axis}, line {width:.2f} px wide (sigma)"
        told += f", position known to {sigma:.3f} px (1 sigma)"
        clipped = int((line.flag[:, 0] == Flag.SATURATED).sum())
        if clipped:
            told += f", {clipped} of them saturated"
        if width < THINNEST:
            told += ", thinner than a lens draws a line: is it an edge?"
        return f"{told}; {line.note}" if line.note else told


def measured_set(
    paths: Sequence[Path], wishes: Wishes, go_on: Callable[[float], bool] = lambda share: True
) -> MeasuredSet | None:
    """Image files of one set -> their lines; as `main.py extract` without options finds them, but for the wishes.

    go_on: told which share is done; False ends it (None). InputError: laser-off images that do not go with the images.
    """
    settings = settings_of(None, select="continuous", smooth_along=True)
    try:
        found = MeasuredSet(look_at(paths, settings, replace(wishes, count_lines=True, longest=NEARBY, words=CONTROLS)))
    except InputError as error:
        raise _in_controls(error) from None
    for number, path in enumerate(paths):
        if not go_on(number / len(paths)):
            return None
        try:
            found.lines[path] = extract_photograph(path, found.look)
        except InputError as error:
            found.problems[path] = str(_in_controls(error))
    return found


def _in_controls(error: InputError) -> InputError:
    where = OPTIONS_AS_CONTROLS.get(error.where, error.where)
    return InputError(error.what, where=where, found=error.found, allowed=error.allowed, cure=error.cure)
