"""Whether what was found is a line at all: a photograph without one has edges and textures, which make short pieces.

A line goes on from scan line to scan line. On boards, walls, steps and a ball of knobs 46 to 100 % of positions were
in pieces of 24 scan lines and more, on photographs of printed boards without a laser 0 to 15 %.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from analysis.line.detection.matched_filter import FILTER_SIGMA, NOISE_GAIN
from analysis.line.detection.noise import NoiseModel
from analysis.line.result import Flag, Line
from studio.photographs.line_arrays import changed
from studio.photographs.line_ends import pieces_of

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
    return _without(line, gone)


def _without(line: Line, gone: NDArray[np.bool_]) -> Line:
    if not gone.any():
        return line

    def kept(values: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.where(gone, np.nan, values)

    return changed(line, kept, np.where(gone, np.uint8(Flag.REJECTED), line.flag).astype(np.uint8))


def above_noise(line: Line, noise: NoiseModel, threshold: float) -> Line:
    """The line (n, k) without those of its pieces that rise above the noise as pixels that share none would have it,
    and not above what they share makes of it (flag REJECTED). threshold: of the detection, standard deviations.

    A JPEG makes stripes as long as its blocks, and two that happen to meet are a chain. Single scan lines that are as
    faint belong to the line where it goes on.
    """
    if noise.spread <= 1.0:
        return line
    gone = np.zeros(line.u.shape, np.bool_)
    for k in range(line.u.shape[1]):
        rows = np.flatnonzero(line.valid[:, k])
        height = line.amplitude[rows, k] / np.hypot(1.0, FILTER_SIGMA / line.width[rows, k])
        response = height / np.sqrt(NOISE_GAIN * (np.maximum(line.background[rows, k], 0.0) + noise.floor))
        for piece in pieces_of(rows, line.u[rows, k], line.width[rows, k]):
            if np.median(response[piece]) < noise.spread * threshold:
                gone[rows[piece], k] = True
    return _without(line, gone)


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
