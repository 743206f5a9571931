"""Where the smoothest chain leaves the line for something else, although the line goes on beside it.

An even edge far off is smoother than a line on rough ground, and a chain that asks for smoothness may take it. What is
left behind tells: it follows on the line from scan line to scan line, is brighter than the detour, and as wide as the
line was, which the detour is not.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from analysis.line.result import Line
from analysis.line.selection.continuity import pick
from studio.photographs.line_ends import JUMP, NEXT, SURE

MOST = 0.8
"""Share of a detour's scan lines on which the line has to go on."""

Floats = NDArray[np.float64]


def without_detours_of(candidates: Line, line: Line) -> Line:
    """A line (n, 1) chosen of candidates (n, k) -> the same, back on what it was before each detour."""
    same = (candidates.u == line.u) & candidates.valid
    rank = np.where(line.valid[:, 0] & same.any(axis=1), np.argmax(same, axis=1), -1)
    rows = np.flatnonzero(rank >= 0)
    if len(rows) < 2:
        return line
    u, width = line.u[rows, 0], line.width[rows, 0]
    steps = np.abs(np.diff(u)) > JUMP * np.maximum(np.minimum(width[1:], width[:-1]), 1.0) * np.diff(rows)
    pieces = np.split(rows, np.flatnonzero(steps) + 1)
    changed = False
    for inward in (1, -1):
        for before, piece in pairwise(pieces[::inward]):
            known, rest = (one[::inward][rank[one[::inward]] >= 0] for one in (before, piece))
            known = known[-NEXT:]
            back = _going_on(candidates, known, rank[known], rest, rank[rest]) if len(rest) else None
            if back is not None:
                rank[rest], changed = back, True
    return pick(candidates, rank) if changed else line


def _going_on(
    candidates: Line, known: NDArray[np.intp], ranks: NDArray[np.intp], piece: NDArray[np.intp], now: NDArray[np.intp]
) -> NDArray[np.intp] | None:
    """Ranks (m,) on the scan lines of a piece by which the line goes on from those before it as far as it does, -1:
    none; None: it does not, or is no better than what the piece has.
    """
    if len(known) < NEXT:
        return None
    usual = float(np.median(candidates.width[known, ranks]))
    at, place = float(candidates.u[known[-1], ranks[-1]]), known[-1]
    found = np.full(len(piece), -1)
    for i, row in enumerate(piece):
        off = np.where(candidates.valid[row], np.abs(candidates.u[row] - at), np.inf)
        best = int(np.argmin(off))
        if abs(int(row) - int(place)) > NEXT:
            break
        if off[best] <= JUMP * max(usual, 1.0) and best != now[i]:
            found[i], at, place = best, float(candidates.u[row, best]), row
    on = found >= 0
    last = int(np.flatnonzero(on)[-1]) + 1 if on.any() else 0
    if last < SURE or on[:last].mean() < MOST:
        return None

    def typical(values: Floats, which: NDArray[np.intp]) -> float:
        return float(np.median(values[piece[on], which[on]]))

    brighter = typical(candidates.amplitude, found) > typical(candidates.amplitude, now)
    ours, theirs = (abs(np.log(typical(candidates.width, which) / usual)) for which in (found, now))
    found[last:] = now[last:]
    return found if brighter and ours < theirs else None
