"""Where a triangulated cloud is no height over x and y: walls, jumps, and cells whose points contradict each other."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from render.base.arrays import Float

STEEPEST = math.tan(math.radians(80.0))
"""Of a surface that is one height over a place: a steeper one has any height in a cell."""
JUMP = 3.0
"""Times what the surface about its corners, in its flatter triangles, rises over its longest edge: one that rises more
joins two surfaces."""
HARMLESS = 0.1
"""Of the usual edge: a rise that is no jump, however short the triangle is."""
NOISE = 8.5
"""Sigmas of a point, by which three of them may differ."""
Mask = NDArray[np.bool_]


def steep_triangles(corners: Float, rise: Float, of: NDArray[np.int32], is_surface: Mask, sigma: float) -> Mask:
    """(t,) the triangles that join what is no surface over x and y.

    corners: (t, 3, 2) m; rise: (t, 3) heights of the corners, m; of: (t, 3) points; is_surface: (t,) those that bridge
    no gap; sigma: m, of a point, NaN for unknown. A triangle is steep by its own plane, by a corner about which most
    are so, or as it rises far more than the surface about each of its corners.
    """
    first, second = (corners[:, i] - corners[:, 0] for i in (1, 2))
    a, b = (rise[:, i] - rise[:, 0] for i in (1, 2))
    area = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        slope = np.hypot(a * second[:, 1] - b * first[:, 1], b * first[:, 0] - a * second[:, 0]) / np.abs(area)
    length = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    height = np.ptp(rise, axis=1)
    least = HARMLESS * float(np.median(length)) + NOISE * float(np.nan_to_num(sigma))
    steep = (np.nan_to_num(slope, nan=np.inf) > STEEPEST) & (height > least)
    count = int(of.max()) + 1
    mostly = _rank_about(steep.astype(np.float64), of, is_surface, count, 0.5) > 0.0
    rises = _rank_about(height / length, of, is_surface, count, 0.25)
    allowed = JUMP * (rises[of].max(axis=1) * length + least)
    return np.asarray(steep | mostly[of].any(axis=1) | (height > allowed))


def _rank_about(value: Float, of: NDArray[np.int32], here: Mask, count: int, share: float) -> Float:
    """(count,) what a share of the (t,) values of the triangles about each point is at most; 0 where there are none."""
    point, values = of[here].ravel(), np.repeat(value[here], 3)
    order = np.lexsort((values, point))
    point, values = point[order], values[order]
    number = np.bincount(point, minlength=count)
    begin = np.cumsum(number) - number
    found, there = np.zeros(count), number > 0
    found[there] = values[(begin + (share * np.maximum(number - 1, 0)).astype(np.intp))[there]]
    return found


def contradicted(heights: Float, steep: Mask, low: Float, high: Float, pitch: float, sigma: float) -> Mask:
    """(n,) cells whose height their own points do not support, by the points' lowest and highest, infinite for none.

    steep: (n,) cells of a triangle that is no surface: only points within them may hold their height.
    """
    reach = np.where(steep, 1.0, STEEPEST) * pitch + NOISE * float(np.nan_to_num(sigma))
    has_points = low <= high
    apart = has_points & ((high - low > 2.0 * reach) | (heights < low - reach) | (heights > high + reach))
    return np.asarray(np.isfinite(heights) & (apart | (steep & ~has_points)))
