"""Where a line ends: light past it is blur, sharpening and the blocks of a JPEG, not the laser on a surface.

A sharp end blurred by anything symmetric has half of its light exactly at the end. So a scan line at an end belongs to
the line if it surely has half of the light of those next to it, a width like theirs, and lies where they go on to. A
camera that makes pictures for the eye codes light on a curve: half of it is at much more than half of the number on
dark ground, hardly more on bright ground. So numbers are turned back into light, the line's less that of its ground.

What fades over more scan lines than the line is wide is no sharp end that is blurred, but the end of the laser's fan,
and the line as far as it is seen. Of clipped scan lines a fit tells a height that may be anything above what clips.

Beyond that, for as long as it may be, there is what lens and surface scatter: softer than the line and much dimmer. A
dark surface dims the line and leaves its width, a depth out of focus widens it and leaves its light.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from analysis.line.result import Flag, Line
from render.base.few_values import quantile
from studio.photographs.line_arrays import changed

NEXT = 16
"""Scan lines that an end is compared with, and as many as blur may lengthen a line by."""
HALF = 0.5
"""Of the light, at an end."""
GAMMA = 2.2
"""Of what a picture for the eye codes light by (IEC 61966-2-1)."""
ASIDE, STRAY = 0.5, 4.0
"""Widths from where the line goes on to, beyond which it is not the line; so many times its scatter if that is more."""
WIDER = 3.0
"""Ratio of widths that is no longer one line's."""
SURELY = 1.0
"""Standard deviations of the light along the line by which it is to be above half, but no more than midway to all."""
SURE = 3
"""Scan lines one after the other that are the line's: there it begins; fewer between two jumps are no piece of it."""
SOFTER, DIMMER, RUNNING = 1.5, 1.0 / 3.0, 7
"""Width and light over those of the line next to it, from which light is scattered; their running medians."""
FAINT, BLURRED, SLOWLY = 0.2, 0.84, 1.5
"""Of the light next to it, from which a fading end is looked at; widths of the line on which blur falls from half of
the light to there; times these scan lines, and one more, beyond which it fades of itself."""
ONE_WIDTH_IN = 0.84
"""Of its light, at one width of the line from its end: the least that blur no wider than that leaves of it there."""
JUMP = 3.0
"""Widths from one scan line to the next at which a piece of the line ends."""

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Tone:
    """How a picture for the eye codes light by numbers, and what the electrons of a line are of these."""

    gain: float
    """DN/e-."""
    black: float
    """DN without electrons."""

    def light(self, amplitude: Floats, ground: Floats) -> Floats:
        """Amplitude over ground (m,) e- -> (m,) light over that of the ground, in units of no matter."""
        low = np.maximum(self.black + self.gain * ground, 0.0)
        return np.asarray((low + self.gain * np.maximum(amplitude, 0.0)) ** GAMMA - low**GAMMA)


def ended(line: Line, tone: Tone | None = None) -> Line:
    """The line (n, k) without what lies past its ends (flag PAST_END). tone: None where numbers are the light."""
    past = np.zeros(line.u.shape, np.bool_)
    for k in range(line.u.shape[1]):
        rows = np.flatnonzero(line.valid[:, k])
        scattered = _scattered(_Found(rows, line, k, tone))
        past[rows[scattered], k] = True
        rows = rows[~scattered]
        past[rows, k] = _past(_Found(rows, line, k, tone))
    if not past.any():
        return line

    def kept(values: Floats) -> Floats:
        return np.where(past, np.nan, values)

    return changed(line, kept, np.where(past, np.uint8(Flag.PAST_END), line.flag).astype(np.uint8))


class _Found:
    """Scan lines (m,) of a line and what is known of them, each (m,)."""

    def __init__(self, rows: NDArray[np.intp], line: Line, k: int, tone: Tone | None) -> None:
        self.rows, self.u, self.width, self.amplitude = (
            rows,
            line.u[rows, k],
            line.width[rows, k],
            line.amplitude[rows, k],
        )
        self.saturated = line.flag[rows, k] == Flag.SATURATED
        if self.saturated.any():
            # a fit of wings may tell any height, but what is not clipped is below what clips
            clips = float(self.amplitude[self.saturated].min())
            whole = self.amplitude[np.isin(line.flag[rows, k], (Flag.OK, Flag.UNRESOLVED))]
            self.amplitude = np.minimum(self.amplitude, max(clips, float(np.median(whole)) if len(whole) else clips))
        # half of what is clipped may be clipped as well: what is not is less than half of what the wings tell
        told = line.amplitude[rows, k]
        told = np.where(self.saturated, np.quantile(told[self.saturated], 0.25), told) if self.saturated.any() else told
        self.light = told if tone is None else tone.light(told, line.background[rows, k])

    def usual(self, some: NDArray[np.intp]) -> float:
        """Amplitude of some of them."""
        return self._usual(self.amplitude, some)

    def usual_light(self, some: NDArray[np.intp]) -> float:
        """Light of some of them."""
        return self._usual(self.light, some)

    def _usual(self, values: Floats, some: NDArray[np.intp]) -> float:
        # what is told by the wings of saturated peaks tends to be too much
        return quantile(values[some], 0.25 if self.saturated[some].any() else 0.5)


def _scattered(found: _Found) -> NDArray[np.bool_]:
    """Which of a line's scan lines (m,) show nothing but what is scattered beside it."""
    out = np.zeros(len(found.rows), np.bool_)
    if len(found.rows) <= RUNNING:
        return out
    width, light = (median_filter(values, RUNNING, mode="nearest") for values in (found.width, found.light))
    soft = width > SOFTER * np.median(found.width[found.amplitude >= np.median(found.amplitude)])
    at = np.flatnonzero(soft)
    for run in np.split(at, np.flatnonzero(np.diff(at) > 1) + 1):
        if len(run) < SURE:
            continue
        first, last = found.rows[run[0]], found.rows[run[-1]]
        sides = (
            np.flatnonzero(~soft & (found.rows < first) & (found.rows >= first - NEXT)),
            np.flatnonzero(~soft & (found.rows > last) & (found.rows <= last + NEXT)),
        )
        # the line's own end fades among the scan lines beside
        beside = [float(np.quantile(found.light[side], 0.75)) for side in sides if len(side) >= SURE]
        saturated = found.saturated[run].any()
        if beside and not saturated and np.median(light[run]) < DIMMER * min(beside):
            out[run] = True
    return out


def _past(found: _Found) -> NDArray[np.bool_]:
    """Which of a line's scan lines (m,) are past an end of one of its pieces, or on a short piece unlike the next."""
    rows, width = found.rows, found.width
    past = np.zeros(len(rows), np.bool_)
    pieces = pieces_of(rows, found.u, width)
    long = np.concatenate([piece for piece in pieces if len(piece) > 2 * NEXT] or [np.zeros(0, np.intp)])
    for piece in pieces:
        if len(piece) > 2 * NEXT:
            for inward in (piece, piece[::-1]):
                past[inward[: _first(found, inward)]] = True
        elif len(piece) < SURE and len(long):
            past[piece] = True
        elif len(piece) <= NEXT and len(long):
            nearest = long[np.argsort(np.abs(long - piece.mean()), kind="stable")[:NEXT]]
            seen = float(np.median(width[piece])), float(np.median(found.amplitude[piece]))
            past[piece] = not alike(*seen, width[nearest], found.usual(nearest))
    return past


def pieces_of(rows: NDArray[np.intp], u: Floats, width: Floats) -> list[NDArray[np.intp]]:
    """Scan lines, positions and widths (m,) of a line -> the indices of each of its pieces."""
    narrower = np.minimum(width[1:], width[:-1])
    splits = np.flatnonzero((np.diff(rows) > NEXT) | (np.abs(np.diff(u)) > JUMP * np.maximum(narrower, 1.0))) + 1
    return [piece for piece in np.split(np.arange(len(rows)), splits) if len(piece)]


def _first(found: _Found, inward: NDArray[np.intp]) -> int:
    """From the end of a piece inward: how many scan lines are past it; 0 where it fades for longer than blur does."""
    there, on, surely = [], [], []
    for k in range(NEXT + SURE):
        at, inside = inward[k], inward[k + 1 : k + 1 + NEXT]
        usual = min(found.usual_light(inside), _one_width_in(found, inside))
        bends = np.abs(np.diff(found.light[inside], 2))
        scatter = 1.4826 * quantile(bends) / 6.0**0.5 / max(usual, 1e-300)
        asked = min(HALF * (1.0 + SURELY * scatter), 0.5 * (1.0 + HALF))
        there.append(alike(found.width[at], found.amplitude[at], found.width[inside], found.usual(inside)))
        on.append(there[-1] and _goes_on(found, at, inside))
        surely.append(on[-1] and found.light[at] >= asked * usual)
    # one that is wild, as a saturated fit may be, is no end
    begins = [k for k in range(NEXT) if there[k] and sum(there[k : k + SURE]) >= SURE - 1]
    likely = [k for k in range(NEXT) if on[k]] if begins else []
    first = next((k for k in begins if surely[k]), likely[0] if likely else 0)
    return _fades_from(found, inward, first)


def _one_width_in(found: _Found, inside: NDArray[np.intp]) -> float:
    """The light of a line whose end is blurred, by the light one of its widths inward: blur is no wider than the line.

    What is brighter still beyond, as a glossy surface may be, tells nothing of the end.
    """
    width = quantile(found.width[inside])
    at = min(int(np.ceil(width)), len(inside)) - 1
    return found.usual_light(inside[max(at - at // 2, 0) : at + at // 2 + 1]) / ONE_WIDTH_IN


def _fades_from(found: _Found, inward: NDArray[np.intp], first: int) -> int:
    """The same from which scan line on a line fades, that has half of its light on the `first`; that, if it is blur."""
    inside = inward[first : first + NEXT]
    usual, width = found.usual_light(inside), quantile(found.width[inside])
    start = first
    while start > 0:
        at = inward[start - 1]
        follows = abs(int(found.rows[at]) - int(found.rows[inward[start]])) == 1
        like = width / WIDER <= found.width[at] <= WIDER * width and _goes_on(found, at, inside)
        if not (follows and like and found.light[at] >= FAINT * usual):
            break
        start -= 1
    return start if first - start > SLOWLY * BLURRED * width + 1.0 else first


def _goes_on(found: _Found, at: np.intp, inside: NDArray[np.intp]) -> bool:
    """Whether a scan line lies on a straight line through those that follow it."""
    inside = inside[: NEXT // 2]
    apart = (found.rows[inside] - found.rows[at]).astype(np.float64)
    slope = quantile(np.diff(found.u[inside]) / np.diff(apart))
    expected = found.u[inside] - slope * apart
    middle = quantile(expected)
    scatter = 1.4826 * quantile(np.abs(expected - middle))
    allowed = max(ASIDE * quantile(found.width[inside]), STRAY * scatter)
    return abs(float(found.u[at]) - middle) <= allowed


def alike(width: float, amplitude: float, widths: Floats, usual: float) -> bool:
    """Whether a width and an amplitude are those of a line whose scan lines (m,) have others, and a usual amplitude."""
    typical = quantile(widths)
    return amplitude >= HALF * usual and typical / WIDER <= width <= WIDER * typical
