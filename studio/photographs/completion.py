"""Scan lines on which a fit fails beside ones on which it does not: the centre of their light, where the line goes on.

Real lines are clipped, granular and not Gaussian; a fit of such a profile may not converge. A centre of mass always has
an answer, but knows neither whether it is the line's nor how wrong it is. Both are told by the scan lines about it: it
has to lie where the line goes on, between fits or on a smooth chain with centres beside fits, and errs as it does where
the fit is known.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.line.result import Flag, Line
from analysis.line.selection.continuity import select_chain
from studio.photographs.line_ends import NEXT, alike

FEWEST = 32
"""Scan lines with both positions by which the second is judged."""
GAP = 16
"""Scan lines that the line may go on without a fit."""
AGREED = 0.25
"""Share of a chain of centres that is beside fits, from which all of it is the line."""
BEND = 1.0
"""Widths from one scan line to the next at which a chain of centres ends."""
SURELY = 1.5
"""Times what centres scatter everywhere that a few of them do not scatter by chance: on a curved, clipped stretch they
lie to one side, by 5 times the scatter on a sphere."""
FILLED = (
    Flag.REJECTED,
    Flag.NOT_CONVERGED,
    Flag.TOO_WIDE,
    Flag.OUT_OF_WINDOW,
    Flag.TOO_FEW_PIXELS,
    Flag.UNSURE,
    Flag.PAST_END,
)
"""Reasons that say nothing against there being a line."""


def offered(candidates: Line, centres: Line) -> Line:
    """Candidates (n, k) by a fit, and the centres (n, m) of the strongest -> the centres where these have none.

    A chain chosen of these does not leave the line for something faint beside it where a fit of the line fails.
    """
    count = centres.u.shape[1]
    lost = np.isin(candidates.flag[:, :count], FILLED) & centres.valid
    values: dict[str, Any] = {}
    for name in ("u", "sigma_u", "width", "amplitude", "background", "flag"):
        values[name] = getattr(candidates, name).copy()
        values[name][:, :count][lost] = getattr(centres, name)[lost]
    return replace(candidates, **values)


def without_detours(line: Line, chosen: Line) -> Line:
    """The lines (n, k) of fits without what is not on the line `chosen` when the centres are offered as well."""
    # a centre beside a fit of the same light is no other line
    detour = ~(np.abs(chosen.u - line.u) <= BEND * line.width) & line.valid
    flag = np.where(detour, np.uint8(Flag.REJECTED), line.flag).astype(np.uint8)
    return replace(line, u=np.where(detour, np.nan, line.u), flag=flag)


def completed(line: Line, centres: Line) -> Line:
    """A line (n, 1) by a fit, and the same by its centre of mass -> the line, with centres (flag MISFIT) where it has
    none.

    Their sigma is how far centres lie from the fits where there are both, all along the line or, where that is surely
    more, on the nearest such scan lines to either side, beside the centre's own.
    """
    fitted = np.flatnonzero(line.valid[:, 0])
    both = np.flatnonzero(line.valid[:, 0] & centres.valid[:, 0])
    apart = np.abs(centres.u[both, 0] - line.u[both, 0])
    if len(both) < FEWEST:
        return line
    scatter, width = 1.4826 * float(np.median(apart)), float(np.median(line.width[fitted, 0]))
    if not scatter < width:
        return line
    rows = np.flatnonzero(np.isin(line.flag[:, 0], FILLED) & centres.valid[:, 0])
    after = np.searchsorted(fitted, rows)
    rows, after = rows[(after > 0) & (after < len(fitted))], after[(after > 0) & (after < len(fitted))]
    first, last = fitted[after - 1], fitted[after]
    expected = np.interp(rows, fitted, line.u[fitted, 0])
    near = np.abs(centres.u[rows, 0] - expected) <= np.maximum(width, np.abs(line.u[last, 0] - line.u[first, 0]))
    rows = np.union1d(rows[near & (last - first <= GAP)], _on_chain(line, centres, width))
    past = line.flag[rows, 0] == Flag.PAST_END  # blur has a centre as well
    rows = np.union1d(rows[~past], _like_fits(line, centres, rows[past]))
    own = np.nan_to_num(centres.sigma_u[rows, 0])
    here = _scatter_about(rows, both, apart)
    scattered = np.where(here > SURELY * scatter, here, scatter)

    def with_values(values: NDArray[np.float64], found: Any) -> NDArray[np.float64]:
        out = values.copy()
        out[rows, 0] = found
        return out

    flag = line.flag.copy()
    flag[rows, 0] = np.uint8(Flag.MISFIT)
    length, shared = line.length_apart, line.shared_u
    return replace(
        line,
        u=with_values(line.u, centres.u[rows, 0]),
        sigma_u=with_values(line.sigma_u, np.hypot(scattered, own)),
        width=with_values(line.width, width),
        amplitude=with_values(line.amplitude, centres.amplitude[rows, 0]),
        background=with_values(line.background, centres.background[rows, 0]),
        chi2=with_values(line.chi2, np.nan),
        length_apart=None if length is None else with_values(length, 1.0),
        shared_u=None if shared is None else with_values(shared, 0.0),
        flag=flag,
    )


def _scatter_about(rows: NDArray[np.intp], known: NDArray[np.intp], apart: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n,) for scan lines: how far centres lie from fits on the nearest NEXT known ones to either side, the larger."""
    at = np.searchsorted(known, rows)
    sides = [[apart[max(0, i - NEXT) : i], apart[i : i + NEXT]] for i in at]
    return np.array([1.4826 * max(float(np.median(side)) for side in pair if len(side)) for pair in sides])


def _on_chain(line: Line, centres: Line, width: float) -> NDArray[np.intp]:
    """Scan lines without a fit where the centres go on as one smooth chain with those that are beside fits."""
    chain = select_chain(centres)
    rows = np.flatnonzero(chain.valid[:, 0])
    u = chain.u[rows, 0]
    near = np.abs(u - line.u[rows, 0]) <= width  # NaN, without a fit, is not near
    found = [np.zeros(0, np.intp)]
    far = (np.diff(rows) > GAP) | (np.abs(np.diff(u)) > BEND * width * np.diff(rows))
    for piece in np.split(np.arange(len(rows)), np.flatnonzero(far) + 1):
        here = rows[piece]
        if near[piece].sum() < max(FEWEST, AGREED * len(piece)):
            here = _like_fits(line, chain, here)
            here = here if len(here) >= FEWEST else here[:0]
        found.append(here[np.isin(line.flag[here, 0], FILLED)])
    return np.concatenate(found)


def _like_fits(line: Line, chain: Line, rows: NDArray[np.intp]) -> NDArray[np.intp]:
    """Of these scan lines of a chain of centres those as bright and as wide as the nearest fits of the line."""
    fitted = np.flatnonzero(line.valid[:, 0])
    middle = np.searchsorted(fitted, rows)
    like = []
    for row, at in zip(rows, middle, strict=True):
        nearest = fitted[max(0, at - NEXT // 2) : at + NEXT // 2]
        width, amplitude = float(chain.width[row, 0]), float(chain.amplitude[row, 0])
        like.append(alike(width, amplitude, line.width[nearest, 0], float(np.median(line.amplitude[nearest, 0]))))
    return rows[np.array(like, np.bool_)]
