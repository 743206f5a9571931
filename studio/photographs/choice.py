"""Of the peaks of each scan line those that are the line, or each of several lines, carried on by centres."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.line.extract import select
from analysis.line.result import Flag, Line
from analysis.line.selection.geometry import WorkingVolume
from analysis.line.settings import ExtractionSettings
from studio.photographs.completion import completed, offered, without_detours
from studio.photographs.detours import without_detours_of
from studio.photographs.line_arrays import changed, column, side_by_side
from studio.photographs.line_ends import Tone, ended


def selected(candidates: Line, settings: ExtractionSettings, volume: WorkingVolume | None) -> Line:
    """Peaks (n, k) -> (n, 1) by the selection, or, of the continuous one, (n, peaks): a chain each."""
    if settings.select != "continuous" or settings.peaks == 1:
        line = select(candidates, settings.select, volume, settings.chooser)
        return without_detours_of(candidates, line) if settings.select == "continuous" and volume is None else line
    left, chains = candidates, []
    for _ in range(settings.peaks):
        chain = select(left, "continuous", volume)
        chains.append(chain)
        used = chain.valid & (left.u == chain.u)
        left = replace(left, u=np.where(used, np.nan, left.u), flag=np.where(used, np.uint8(Flag.REJECTED), left.flag))
    return side_by_side(chains, candidates)


def carried_on(
    candidates: Line, centres: Line, settings: ExtractionSettings, volume: WorkingVolume | None, tone: Tone | None
) -> Line:
    """Peaks (n, k) by a fit, and centres (n, peaks) of the strongest -> the lines (n, peaks), without what is past
    their ends, with centres where a fit fails.
    """
    chosen = selected(offered(candidates, centres), settings, volume)
    fitted = without_detours(selected(candidates, settings, volume), chosen)
    lines = [column(fitted, k) for k in range(settings.peaks)]
    return side_by_side([completed(ended(one, tone), _nearest(centres, one)) for one in lines], candidates)


def _nearest(centres: Line, line: Line) -> Line:
    """Of centres (n, k) those (n, 1) that are nearest to where a line (n, 1) goes on."""
    there = np.flatnonzero(line.valid[:, 0])
    if centres.u.shape[1] == 1 or not len(there):
        return column(centres, 0)
    expected = np.interp(np.arange(len(line.u)), there, line.u[there, 0])[:, None]
    off = np.where(centres.valid, np.abs(centres.u - expected), np.inf)
    rank = np.argmin(off, axis=1)[:, None]

    def taken(values: NDArray[Any]) -> NDArray[Any]:
        return np.take_along_axis(values, rank, axis=1)

    return changed(centres, taken, taken(centres.flag))
