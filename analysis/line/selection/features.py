"""What tells the line from its reflections: numbers of every candidate beside the others of its row and its neighbours.

All of it comes from positions, widths and amplitudes that are measured already, each relative to the frame's own line,
so that neither image scale nor exposure matters; left and right, up and down are alike.
"""

from __future__ import annotations

import numpy as np
import scipy  # whose parts are loaded as they are named: the window starts without them
from numpy.typing import NDArray

from analysis.line.result import Flag, Line
from analysis.line.selection.continuity import cheapest_chain
from render.base.arrays import Float

REACH = (1, 2, 4, 8)
"""Scan lines to either side that a candidate's neighbours are looked for in."""
FAR = 6.0
"""Of asinh px: stands for no neighbour at all."""
LINKS = 3
"""Scan lines that a segment may skip to its next candidate, less one."""
STEEPEST = 3.0
"""px a scan line, of a segment."""
OWN = (
    "width",
    "width in px",
    "below row's strongest",
    "amplitude",
    "precision",
    "chi2",
    "saturated",
    "blended",
    "misfit",
)
ROW = ("others", "nearest", "nearest's amplitude", "nearest's width", "strongest's distance", "strongest's amplitude")
BESIDE = tuple(f"{name} {d}" for d in REACH for name in ("step", "larger step", "bend", "amplitude beside"))
SEGMENT = (
    "length", "share of length", "to its end", "its amplitude", "its width", "its width's spread", "its chi2",
    "its place in rows", "its bend", "its slope", "beside longer", "its share of the chain",
)  # fmt: skip
CHAIN = ("on the chain", "off the chain", "rows to the chain")
FEATURES = (*OWN, *ROW, *BESIDE, *SEGMENT, *CHAIN)


def candidate_features(candidates: Line) -> Float:
    """Peaks (n, k) -> (m, len(FEATURES)) of the valid ones, in the order of `np.nonzero`."""
    valid = candidates.valid
    if not valid.any():
        return np.zeros((0, len(FEATURES)))
    u = np.where(valid, candidates.u, np.nan)
    with np.errstate(divide="ignore", invalid="ignore"):
        amplitude = np.log(np.where(valid & (candidates.amplitude > 0.0), candidates.amplitude, np.nan))
        width = np.log(np.where(valid & (candidates.width > 0.0), candidates.width, np.nan))
        precision = np.log(np.where(valid, candidates.width / candidates.sigma_u, np.nan))
        misfit = np.log(np.where(valid & (candidates.chi2 > 0.0), candidates.chi2, np.nan))
    amplitude = _known(amplitude, valid)
    width = _known(width, valid)
    first = valid.argmax(axis=1)[valid.any(axis=1)], np.nonzero(valid.any(axis=1))[0]
    typical = [np.nanmedian(values[first[1], first[0]]) for values in (amplitude, width)]
    top = np.max(np.where(valid, amplitude, -np.inf), axis=1, keepdims=True)
    own = [
        width - typical[1], width, amplitude - top, amplitude - typical[0], precision, misfit,
        *(candidates.flag == flag for flag in (Flag.SATURATED, Flag.BLENDED, Flag.MISFIT)),
    ]  # fmt: skip
    bends, beside = _beside(u, amplitude)
    alone = [values[valid] for values in (*own, *_row(u, amplitude, width), *beside)]
    # one table and no copies of it: memory that is touched for the first time costs more than the numbers
    table = np.column_stack([*alone, _along(u, candidates.amplitude, own, bends)]).astype(np.float64, copy=False)
    np.nan_to_num(table, copy=False)
    return np.clip(table, -20.0, 20.0, out=table)


def _known(values: Float, valid: NDArray[np.bool_]) -> Float:
    """Values (n, k), the median where a valid one is not a number."""
    some = values[valid & np.isfinite(values)]
    return np.where(valid & ~np.isfinite(values), np.median(some) if len(some) else 0.0, values)


def _row(u: Float, amplitude: Float, width: Float) -> list[Float]:
    """`ROW`, each (n, k): the other candidates of the scan line."""
    apart = np.abs(u[:, :, None] - u[:, None, :])
    apart[:, np.arange(u.shape[1]), np.arange(u.shape[1])] = np.nan
    apart = np.where(np.isnan(apart), np.inf, apart)
    nearest, alone = apart.argmin(axis=2), ~np.isfinite(apart).any(axis=2)
    rival = np.where(np.isfinite(apart), np.nan_to_num(amplitude, nan=-np.inf)[:, None, :], -np.inf).argmax(axis=2)

    def of(values: Float, other: NDArray[np.intp]) -> Float:
        return np.where(alone, 0.0, np.take_along_axis(values, other, axis=1) - values)

    def distance(other: NDArray[np.intp]) -> Float:
        return np.where(alone, FAR, np.arcsinh(np.take_along_axis(apart, other[:, :, None], axis=2)[..., 0]))

    others = np.broadcast_to(np.isfinite(u).sum(axis=1, keepdims=True) - 1.0, u.shape)
    return [
        others,
        distance(nearest),
        of(amplitude, nearest),
        of(width, nearest),
        distance(rival),
        of(amplitude, rival),
    ]


def _beside(u: Float, amplitude: Float) -> tuple[Float, list[Float]]:
    """Bends over two scan lines (n, k), asinh px, and `BESIDE`, each (n, k): the nearest candidates d rows away."""
    found: list[Float] = []
    kept = np.full(u.shape, FAR)
    for d in REACH:
        steps, levels = [], []
        for rows in (-d, d):
            other, level = _shifted(u, rows), _shifted(amplitude, rows)
            nearest, _ = _nearest(u, other)
            steps.append(np.take_along_axis(other, nearest, axis=1) - u)
            levels.append(np.take_along_axis(level, nearest, axis=1) - amplitude)
        size = [np.where(np.isnan(step), FAR, np.arcsinh(np.abs(step) / d)) for step in steps]
        bend = np.arcsinh(np.abs(steps[0] + steps[1]) / d)
        bend = np.where(np.isnan(bend), FAR, bend)
        found += [np.minimum(*size), np.maximum(*size), bend]
        found.append(np.nansum(np.abs(np.clip(levels, -5.0, 5.0)), axis=0))
        if d == 2:
            kept = bend
    return kept, found


def _nearest(u: Float, others: Float) -> tuple[NDArray[np.intp], Float]:
    """Positions (n, k) and others (n, k), NaN for none -> (n, k) the rank of the nearest other, and how far it is, px.

    Rank 0, infinitely far, where there is none.
    """
    rank, least = np.zeros(u.shape, np.intp), np.full(u.shape, np.inf)
    for k in range(others.shape[1]):  # few ranks, many rows: several times faster than argmin over (n, k, k)
        apart = np.abs(others[:, k : k + 1] - u)
        closer = apart < least
        rank[closer] = k
        np.copyto(least, apart, where=closer)
    return rank, least


def _shifted(values: Float, rows: int) -> Float:
    """Values (n, k) of the scan line so many further on, NaN beyond the image."""
    out = np.full_like(values, np.nan)
    if abs(rows) < len(values):
        out[max(-rows, 0) : len(values) - max(rows, 0)] = values[max(rows, 0) : len(values) + min(rows, 0)]
    return out


def _along(u: Float, strength: Float, own: list[Float], bends: Float) -> Float:
    """(m, len(SEGMENT) + len(CHAIN)): the run of neighbours that a candidate belongs to, and the smoothest chain."""
    rows, ranks = np.nonzero(np.isfinite(u))
    segment = segments(u)
    count = int(segment.max()) + 1
    first, last = np.full(count, len(u)), np.full(count, -1)
    np.minimum.at(first, segment, rows)
    np.maximum.at(last, segment, rows)
    members = np.bincount(segment, minlength=count)

    def mean(values: Float) -> Float:
        return np.bincount(segment, np.nan_to_num(values), minlength=count) / members

    width, amplitude, below, chi2 = (own[k][rows, ranks] for k in (0, 3, 2, 5))
    length = (last - first + 1).astype(np.float64)
    longest = np.zeros(u.shape)
    longest[rows, ranks] = length[segment]
    # the longest run of the row, or the second longest for the longest itself
    ordered = np.sort(longest, axis=1)
    rival = np.where(
        length[segment] >= ordered[rows, -1], ordered[rows, -2] if u.shape[1] > 1 else 0.0, ordered[rows, -1]
    )
    choice = cheapest_chain(u, strength)
    chosen = np.nonzero(choice >= 0)[0]
    on_chain = (choice[rows] == ranks).astype(np.float64)
    middle = mean(width)
    spread = np.sqrt(np.maximum(mean(width**2) - middle**2, 0.0))
    at = u[rows, ranks]
    low, high = np.full(count, np.inf), np.full(count, -np.inf)
    np.minimum.at(low, segment, at)
    np.maximum.at(high, segment, at)
    lit = max(int(np.isfinite(u).any(axis=1).sum()), 1)
    of_segment = [
        np.log(length), length / lit, np.zeros(count), mean(amplitude), middle, spread, mean(chi2), mean(below),
        mean(bends[rows, ranks]), (high - low) / length, mean((rival > length[segment]).astype(np.float64)),
        mean(on_chain),
    ]  # fmt: skip
    table = np.column_stack(of_segment)[segment]
    table[:, 2] = np.log1p(np.minimum(rows - first[segment], last[segment] - rows))
    if len(chosen):
        chain = np.interp(rows, chosen, u[chosen, choice[chosen]])
        after = np.clip(np.searchsorted(chosen, rows), 0, len(chosen) - 1)
        before = np.maximum(after - 1, 0)
        gap = np.minimum(np.abs(chosen[after] - rows), np.abs(rows - chosen[before]))
        off = np.arcsinh(np.abs(at - chain))
    else:
        gap, off = np.full(len(rows), len(u)), np.full(len(rows), FAR)
    return np.column_stack([table, on_chain, off, np.log1p(gap)])


def segments(u: Float) -> NDArray[np.int32]:
    """Positions (n, k), NaN for none -> (m,) the number of the run of mutually nearest neighbours that each is of."""
    rows, ranks = np.nonzero(np.isfinite(u))
    number = np.full(u.shape, -1)
    number[rows, ranks] = np.arange(len(rows))
    starts, ends = [], []
    linked = np.zeros(u.shape, np.bool_)  # a candidate has its successor
    for gap in range(1, min(LINKS, len(u) - 1) + 1):
        onward, apart = _nearest(u[:-gap], u[gap:])
        back, _ = _nearest(u[gap:], u[:-gap])
        mutual = np.take_along_axis(back, onward, axis=1) == np.arange(u.shape[1])
        found = mutual & (apart <= STEEPEST * gap) & ~linked[:-gap]
        linked[:-gap] |= found
        row, rank = np.nonzero(found)
        starts.append(number[row, rank])
        ends.append(number[row + gap, onward[row, rank]])
    a, b = (np.concatenate(one) if one else np.zeros(0, int) for one in (starts, ends))
    graph = scipy.sparse.coo_matrix((np.ones(len(a)), (a, b)), shape=(len(rows), len(rows)))
    return np.asarray(scipy.sparse.csgraph.connected_components(graph, directed=False)[1])
