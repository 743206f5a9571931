"""From an image to the laser line: read scan lines, detect peaks, measure each by the method asked for."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from analysis.line.along.smooth import smooth_along
from analysis.line.choose import choose_method
from analysis.line.detection.channel import check_image, scan_lines
from analysis.line.detection.noise import NoiseModel
from analysis.line.estimate import estimate_noise
from analysis.line.hidden_peaks import with_hidden
from analysis.line.measure import measure
from analysis.line.mosaic import seen_only
from analysis.line.result import Line
from analysis.line.selection.continuity import pick, select_chain
from analysis.line.selection.geometry import WorkingVolume, consistent
from analysis.line.selection.learned import READY_MADE, choose_learned, load_chooser
from analysis.line.settings import ExtractionSettings, Select
from analysis.line.shared_noise import with_shared_noise
from analysis.line.texture import with_texture
from render.base.errors import InputError
from render.base.finite import check_finite

CANDIDATES = 5
"""Peaks that one is selected from, unless the settings ask for more."""


def extract(
    image: NDArray[Any],
    *,
    settings: ExtractionSettings | None = None,
    noise: NoiseModel | None = None,
    variance: NDArray[Any] | None = None,
    volume: WorkingVolume | None = None,
    threads: int | None = None,
    shared: bool = True,
    judged: bool = True,
    **changes: Any,
) -> Line:
    """Image (h, w) or (h, w, 3), uint8, uint16, float32 or float64 -> Line with arrays (n, peaks).

    changes: single settings by their name, such as method="phase", in place of those in `settings`. noise turns DN into
    electrons; without it, it is estimated from the image (`estimate_noise`), and what neighbouring pixels have in
    common from the positions (`shared_noise`); what a texture does, from the light along the line (`texture`). variance
    (h, w) e-^2 replaces that of the noise model, for images that were combined from others. With a selection other than
    "strongest", or a working volume, one peak of several candidates is taken: arrays (n, 1), `candidates` holds the
    rest. Smoothed along the line, where the settings ask for it, are the positions that were selected. Scan lines
    without a position carry a flag that says why. shared: False where somebody selects among the peaks first, and then
    asks what neighbouring pixels share. judged: False where every line is to be measured as one, whatever its profile.
    Raises InputError: an image of the wrong type, shape or size, without a finite pixel, a channel it does not have,
    settings out of range.
    """
    chosen = settings_of(settings, **changes)
    array = check_image(image)
    if noise is None:
        noise = estimate_noise(array, chosen, threads=threads)
    lines = scan_lines(array, chosen, noise, variance)
    note = ""
    if chosen.method == "auto":
        picked, note = choose_method(lines, chosen, threads)
        chosen = chosen.model_copy(update={"method": picked})
    if chosen.method == "likelihood":
        chosen = chosen.model_copy(update={"smoothing": 0.0})
    lines = replace(lines, smoothing=chosen.smoothing)
    if (noise.alike or noise.filled_in) and chosen.method == "likelihood":
        lines = seen_only(lines, lines.image, chosen, threads)
    alone = chosen.select == "strongest" and volume is None
    wanted = chosen if alone else chosen.model_copy(update={"peaks": max(chosen.peaks, CANDIDATES)})
    # fused exposures hold so many electrons that no lens draws a line which is a Gaussian to their noise
    line = replace(measure(lines, wanted, threads, judge=judged and variance is None, passing=alone), note=note)
    if chosen.select == "learned":
        line = with_hidden(line, lines, wanted, threads)
    check_finite("line", positions=line.u[line.valid])
    line = line if alone else select(line, chosen.select, volume, chosen.chooser)
    if noise.alike:
        line = with_shared_noise(line) if shared else line
    elif chosen.smoothing == 0.0:  # which would make the light of neighbours alike
        line = with_texture(line, noise)
    return smooth_along(line) if chosen.smooth_along else line


def select(candidates: Line, how: Select, volume: WorkingVolume | None = None, chooser: str | None = None) -> Line:
    """Peaks (n, k) -> Line (n, 1): one peak of each scan line, of those that the working volume allows, or none.

    chooser: weights of the learned selection, in place of the program's own. InputError: they are not a chooser's.
    """
    usable = candidates.valid if volume is None else candidates.valid & consistent(candidates, volume)
    if how == "continuous":
        return select_chain(candidates, usable)
    if how == "learned":
        choice = choose_learned(candidates, usable, load_chooser(READY_MADE if chooser is None else Path(chooser)))
        note = "; ".join(filter(None, (candidates.note, choice.refused)))
        return replace(pick(candidates, choice.rank), note=note)
    if how == "strongest":
        order = np.broadcast_to(np.arange(usable.shape[1], dtype=np.float64), usable.shape)
    else:
        order = candidates.u if how == "first" else -candidates.u
    rank = np.argmin(np.where(usable, order, np.inf), axis=1)
    return pick(candidates, np.where(usable.any(axis=1), rank, -1))


def settings_of(settings: ExtractionSettings | None, **given: Any) -> ExtractionSettings:
    """Settings with some values replaced where they are not None. InputError names a value that is not allowed."""
    values = {} if settings is None else settings.model_dump()
    values.update({name: value for name, value in given.items() if value is not None})
    try:
        return ExtractionSettings(**values)
    except ValidationError as error:
        first = error.errors()[0]
        where = "extraction." + ".".join(str(part) for part in first["loc"]) if first["loc"] else "extraction"
        found = first["input"] if first["loc"] else None  # else it is all of the settings
        raise InputError(first["msg"].removeprefix("Value error, "), where=where, found=found) from None
