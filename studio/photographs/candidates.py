"""Peaks of each scan line, of which one is chosen: the strongest alone where it goes on, several where it does not.

A second peak is mostly noise, and its fit, which does not converge, takes longest. It is asked for only where the
strongest peaks make no chain, and everywhere if they make more than one: then the other may be the line.
"""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation

from analysis.line.detection.noise import NoiseModel
from analysis.line.extract import CANDIDATES, extract
from analysis.line.measure import METHODS
from analysis.line.result import NEIGHBOURS, Flag, Line
from analysis.line.selection.continuity import GAP, select_chain
from analysis.line.settings import ExtractionSettings
from studio.photographs.line_ends import JUMP

NARROW = 1.0
"""px; a line below it may share its width with its neighbours, which are then looked at again as well."""
FEW = 0.5
"""Share of the scan lines to be looked at again, from which all of them are."""


def peaks_to_choose_from(
    image: NDArray[Any],
    settings: ExtractionSettings,
    noise: NoiseModel,
    threads: int | None,
    every: bool = False,
    judged: bool = True,
) -> Line:
    """Image (h, w) -> Line (n, k) of candidates, strongest first; what its pixels share is not asked yet.

    every: also where the strongest will do, as for a choice that is not by the smoothest chain alone. judged: as
    `extract` has it.
    """
    several = settings.model_copy(update={"select": "strongest", "peaks": max(settings.peaks, CANDIDATES)})
    every = every or settings.peaks > 1 or settings.select != "continuous" or settings.smoothing > 0.0
    if every or (settings.method in METHODS and METHODS[settings.method].halo > 0):
        return extract(image, settings=several, noise=noise, threads=threads, shared=False, judged=judged)
    strongest = settings.model_copy(update={"select": "strongest"})
    first = extract(image, settings=strongest, noise=noise, threads=threads, shared=False, judged=judged)
    again = _unsettled(first)
    if again.mean() > FEW:
        return extract(image, settings=several, noise=noise, threads=threads, shared=False, judged=judged)
    if not again.any():
        return first
    part = image[again] if settings.axis == "rows" else image[:, again]
    several = several.model_copy(update={"method": first.method})
    return _with(
        first, again, extract(part, settings=several, noise=noise, threads=threads, shared=False, judged=judged)
    )


def _unsettled(line: Line) -> NDArray[np.bool_]:
    """Scan lines (n,) whose strongest peak (n, 1) is not on the one chain, and what is beside them; all: there are
    several.
    """
    chain = select_chain(line)
    rows = np.flatnonzero(chain.valid[:, 0])
    off: NDArray[np.bool_] = ~chain.valid[:, 0] & ~np.isin(line.flag[:, 0], (Flag.NO_PEAK, Flag.NO_PIXELS))
    if not len(rows):
        return off
    apart, steps, width = np.diff(rows), np.abs(np.diff(chain.u[rows, 0])), float(np.median(line.width[rows, 0]))
    if (apart > GAP).any() or (steps > JUMP * max(width, 1.0) * apart).any():
        return np.ones(len(off), np.bool_)
    near: NDArray[np.bool_] = binary_dilation(off, iterations=NEIGHBOURS) if width < NARROW else off
    return near


def _with(line: Line, rows: NDArray[np.bool_], more: Line) -> Line:
    """The line (n, 1) with more peaks (m, k) on some of its scan lines (n,)."""
    values: dict[str, Any] = {}
    for field in fields(Line):
        ours, theirs = getattr(line, field.name), getattr(more, field.name)
        if not isinstance(ours, np.ndarray) and not isinstance(theirs, np.ndarray):
            continue
        nothing: Any = np.uint8(Flag.NO_PEAK) if field.name == "flag" else 0.0 if field.name == "shared_u" else np.nan
        whole = np.full((len(rows), more.u.shape[1]), nothing)
        whole[:, :1] = nothing if ours is None else ours
        whole[rows] = nothing if theirs is None else theirs
        values[field.name] = whole
    return replace(line, **values)
