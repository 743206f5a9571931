"""The middle between the two places where a line's light falls to half of its height: of a line clipped beyond any fit.

A white core with a wide glow has no width that a fit accepts, and a centre of mass takes in the glow of one side and
not of the other. Its two flanks are steep all the same, and in between lies the line.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from analysis.line.result import Axis, Flag, Line
from render.base.arrays import Float
from studio.photographs.completion import FEWEST, FILLED

COMPARED = 256
"""Scan lines on which middles are compared with fits."""
TO_SIGMA = 1.0 / 2.3548
"""Of a Gaussian's width at half of its height."""


def half_heights(light: NDArray[np.generic], axis: Axis) -> tuple[Float, Float, Float]:
    """Image (h, w) -> (n,) middle of the brightest stretch above half height, px, its width as sigma, px, and height,
    DN, of every scan line; NaN: it has none, or it ends at the image's edge.
    """
    rows = np.asarray(light if axis == "rows" else light.T, np.float32)
    n, w = rows.shape
    values = np.where(np.isfinite(rows), rows, -np.inf)
    ground = np.array([np.median(row[np.isfinite(row)]) if np.isfinite(row).any() else np.nan for row in rows])
    top = values.max(axis=1)
    level = (0.5 * (ground + top))[:, None]
    inside = np.zeros((n, w + 2), np.bool_)
    with np.errstate(invalid="ignore"):
        inside[:, 1:-1] = (values >= level) & (top > ground)[:, None]
    edges = np.diff(inside.astype(np.int8), axis=1)
    row, first = np.nonzero(edges == 1)  # in the same order as
    last = np.nonzero(edges == -1)[1] - 1
    out = np.full((3, n), np.nan)
    if not len(row):
        return out[0], out[1], out[2]
    above = np.cumsum(np.where(inside[:, 1:-1], values - level, 0.0), axis=1, dtype=np.float64)
    light_of = above[row, last] - np.where(first > 0, above[row, np.maximum(first - 1, 0)], 0.0)
    order = np.lexsort((light_of, row))
    best = order[np.append(np.flatnonzero(np.diff(row[order])), len(order) - 1)]
    best = best[(first[best] > 0) & (last[best] < w - 1)]
    at, first, last = row[best], first[best], last[best]
    half = level[at, 0]

    def crossing(outer: NDArray[np.intp], inner: NDArray[np.intp]) -> Float:
        low, high = values[at, outer], values[at, inner]
        return np.asarray(inner + (outer - inner) * np.clip((high - half) / np.maximum(high - low, 1e-12), 0.0, 1.0))

    left, right = crossing(first - 1, first), crossing(last + 1, last)
    out[:, at] = 0.5 * (left + right), TO_SIGMA * (right - left), top[at] - ground[at]
    return out[0], out[1], out[2]


def with_half_heights(centres: Line, line: Line, light: NDArray[np.generic], gain: float) -> Line:
    """Centres (n, 1) beside a line (n, 1) by a fit -> the same with middles between half heights where they have none.

    Their sigma is how far such middles lie from the fits where there are both. gain: DN/e- of the light (h, w).
    """
    lost = np.isin(line.flag[:, 0], FILLED) & ~centres.valid[:, 0]
    if not lost.any():
        return centres
    fitted = np.flatnonzero(line.valid[:, 0])
    asked = np.union1d(np.flatnonzero(lost), fitted[:: len(fitted) // COMPARED + 1])
    u, width, height = np.full((3, len(lost)), np.nan)
    some = light[asked] if line.axis == "rows" else light[:, asked]
    u[asked], width[asked], height[asked] = half_heights(some, line.axis)
    apart = np.abs(u - line.u[:, 0])[fitted]
    apart = apart[np.isfinite(apart)]
    rows = np.flatnonzero(lost & np.isfinite(u))
    if len(apart) < FEWEST or not len(rows):
        return centres

    def given(values: Float, found: Float | float) -> Float:
        out = values.copy()
        out[rows, 0] = found
        return out

    flag = centres.flag.copy()
    flag[rows, 0] = np.uint8(Flag.SATURATED)
    return replace(
        centres,
        u=given(centres.u, u[rows]),
        sigma_u=given(centres.sigma_u, 1.4826 * float(np.median(apart))),
        width=given(centres.width, width[rows]),
        amplitude=given(centres.amplitude, height[rows] / gain),
        background=given(centres.background, 0.0),
        flag=flag,
    )
