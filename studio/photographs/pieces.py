"""Whether what was found is a line at all: a photograph without one has edges and textures, which make short pieces.

A line goes on from scan line to scan line. On boards, walls, steps and a ball of knobs 46 to 100 % of positions were
in pieces of 24 scan lines and more, on photographs of printed boards without a laser 0 to 15 %.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from analysis.line.result import Flag, Line
from studio.photographs.line_arrays import changed

LONG, SMALL = 24, 8
"""Scan lines of a piece that no edge makes by chance; in a small image an eighth or so of them."""
MOST = 0.3
"""Share of the positions that are in such pieces, from which they are a line."""
SKIPPED, STEP = 2, 1.0
"""Scan lines that a piece may skip; widths from one scan line to the next that it may move by, or as many px."""
NO_LINE = "what stands out goes on nowhere, and is no line"


def lines_only(line: Line) -> Line:
    """The line (n, k) without those ranks that are scattered pieces of nothing (flag REJECTED); `note` tells."""
    scattered = np.array([_scattered(line, k) for k in range(line.u.shape[1])], np.bool_)
    gone = line.valid & scattered
    if not gone.any():
        return line

    def kept(values: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.where(gone, np.nan, values)

    return changed(line, kept, np.where(gone, np.uint8(Flag.REJECTED), line.flag).astype(np.uint8))


def _scattered(line: Line, k: int) -> bool:
    rows = np.flatnonzero(line.valid[:, k])
    if not len(rows):
        return False
    apart, moved = np.diff(rows), np.abs(np.diff(line.u[rows, k]))
    allowed = max(STEP * float(np.median(line.width[rows, k])), 1.0)
    breaks = np.flatnonzero((apart > SKIPPED + 1) | (moved > allowed * apart)) + 1
    lengths = np.diff(np.concatenate([[0], breaks, [len(rows)]]))
    long = lengths >= min(LONG, max(len(line.u) // SMALL, 2))
    return bool(lengths[long].sum() < MOST * len(rows))
