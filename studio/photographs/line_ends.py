"""Where a line ends: light past it is blur, sharpening and the blocks of a JPEG, not the laser on a surface.

A sharp end blurred by anything symmetric has half of its light exactly at the end. So a scan line at an end belongs to
the line if it has at least half of the light of those next to it, and a width like theirs.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from analysis.line.result import Flag, Line

NEXT = 16
"""Scan lines that an end is compared with, and as many as blur may lengthen a line by."""
HALF = 0.5
WIDER = 3.0
"""Ratio of widths that is no longer one line's."""
SURE = 3
"""Scan lines one after the other that are the line's: there it begins."""
JUMP = 3.0
"""Widths from one scan line to the next at which a piece of the line ends."""

Floats = NDArray[np.float64]


def ended(line: Line) -> Line:
    """The line (n, k) without what lies past its ends (flag PAST_END)."""
    past = np.zeros(line.u.shape, np.bool_)
    for k in range(line.u.shape[1]):
        rows = np.flatnonzero(line.valid[:, k])
        past[rows, k] = _past(rows, line.u[rows, k], line.width[rows, k], _seen(line, rows, k))
    if not past.any():
        return line

    def kept(values: Floats) -> Floats:
        return np.where(past, np.nan, values)

    return replace(
        line,
        u=kept(line.u),
        sigma_u=kept(line.sigma_u),
        width=kept(line.width),
        amplitude=kept(line.amplitude),
        background=kept(line.background),
        chi2=kept(line.chi2),
        length_apart=None if line.length_apart is None else kept(line.length_apart),
        shared_u=None if line.shared_u is None else kept(line.shared_u),
        flag=np.where(past, np.uint8(Flag.PAST_END), line.flag).astype(np.uint8),
    )


def _seen(line: Line, rows: NDArray[np.intp], k: int) -> Floats:
    """Amplitudes (m,) of a line's scan lines; a saturated one's is the least that saturates: the fit's is a guess."""
    amplitude, saturated = line.amplitude[rows, k], line.flag[rows, k] == Flag.SATURATED
    return np.asarray(np.where(saturated, amplitude[saturated].min(initial=np.inf), amplitude))


def _past(rows: NDArray[np.intp], u: Floats, width: Floats, amplitude: Floats) -> NDArray[np.bool_]:
    """Which of a line's scan lines (m,) are past an end of one of its pieces, or on a short piece unlike the next."""
    past = np.zeros(len(rows), np.bool_)
    narrower = np.minimum(width[1:], width[:-1])
    splits = np.flatnonzero((np.diff(rows) > NEXT) | (np.abs(np.diff(u)) > JUMP * np.maximum(narrower, 1.0))) + 1
    pieces = [piece for piece in np.split(np.arange(len(rows)), splits) if len(piece)]
    long = np.concatenate([piece for piece in pieces if len(piece) > 2 * NEXT] or [np.zeros(0, np.intp)])
    for piece in pieces:
        if len(piece) > 2 * NEXT:
            for inward in (piece, piece[::-1]):
                past[inward[: _first(width[inward], amplitude[inward])]] = True
        elif len(piece) <= NEXT and len(long):
            nearest = long[np.argsort(np.abs(long - piece.mean()), kind="stable")[:NEXT]]
            past[piece] = not alike(
                float(np.median(width[piece])), float(np.median(amplitude[piece])), width[nearest], amplitude[nearest]
            )
    return past


def _first(width: Floats, amplitude: Floats) -> int:
    """From the end of a piece inward: how many scan lines are past it; 0 where it fades for longer than blur does."""
    there = []
    for k in range(NEXT + SURE):
        inside = slice(k + 1, k + 1 + NEXT)
        there.append(alike(width[k], amplitude[k], width[inside], amplitude[inside]))
    return next((k for k in range(NEXT) if all(there[k : k + SURE])), 0)


def alike(width: float, amplitude: float, widths: Floats, amplitudes: Floats) -> bool:
    """Whether a width and an amplitude are those of a line whose scan lines (m,) have others."""
    usual = float(np.median(widths))
    return amplitude >= HALF * float(np.median(amplitudes)) and usual / WIDER <= width <= WIDER * usual
