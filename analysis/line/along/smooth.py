"""A line estimated along itself: neighbouring scan lines look at one smooth surface, and say of it more than one does.

What is assumed: the line is smooth between steps and corners, which are found and kept; sigma_u and correlation length
are right. Positions whose error is not noise are left as they are: those
flagged `MISFIT` and `BLENDED`, strays, those that would be moved by more than the line is wide, and those without a
sigma or with one that is not small beside that width.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.line.along.curve import LONGEST, Kind, Stretch
from analysis.line.along.shocks import curve_with_shocks
from analysis.line.result import SYSTEMATIC, Line
from render.base.arrays import Float

GAP, FEWEST = 12, 16
"""Scan lines without a position beyond which a line is another one, and positions that make a line."""
SURE, MOVED = 0.5, 1.0
"""Times the line's width that sigma_u is at most where a position tells of its neighbours, and that it is moved by."""
APART, FINEST = 1e-3, 0.01
"""Share of sigma_u at least taken as what scan lines do not have in common; of the typical one, as a position's own."""


@dataclass(frozen=True)
class Smoothed:
    """Positions (n,) px by scan line, estimated together; as they were where `reach` is NaN."""

    u: Float
    sigma: Float
    length: Float
    """Scan lines that err alike: a mean over many of them is known as well as before."""
    shared: Float
    """(n,) px, the averages of an error that they have in common."""
    reach: Float
    """Smoothing length, scan lines; NaN where nothing was smoothed."""
    shocks: tuple[int, ...]
    """How many strays, corners and steps were kept, by `Kind`."""


def smooth_along(line: Line, longest: float = LONGEST) -> Line:
    """A line (n, k) -> the same with the positions of each rank estimated along it, over smoothing lengths of up to
    `longest` scan lines; `note` tells what was done."""
    length = np.ones_like(line.u) if line.length_apart is None else np.nan_to_num(line.length_apart, nan=1.0)
    shared = np.zeros_like(line.u) if line.shared_u is None else np.nan_to_num(line.shared_u)
    apart = np.sqrt(np.maximum(line.variance_apart, (APART * line.sigma_u) ** 2))
    there = line.valid & ~np.isin(line.flag, SYSTEMATIC) & ~(line.sigma_u > SURE * line.width)
    ranks = [
        smoothed(np.where(there[:, k], line.u[:, k], np.nan), apart[:, k], length[:, k], shared[:, k], longest)
        for k in range(line.u.shape[1])
    ]
    done = np.isfinite(np.stack([one.reach for one in ranks], axis=1))
    done &= ~(np.abs(np.stack([one.u for one in ranks], axis=1) - line.u) > MOVED * line.width)
    note = "; ".join(filter(None, (line.note, _told(ranks))))
    if not done.any():
        return replace(line, note=note)

    def changed(before: Float, name: str) -> Float:
        return np.where(done, np.stack([getattr(one, name) for one in ranks], axis=1), before)

    common = changed(shared, "shared")
    sigma = np.where(done, np.hypot(changed(apart, "sigma"), common), line.sigma_u)
    return replace(
        line,
        u=changed(line.u, "u"),
        sigma_u=sigma,
        length_apart=changed(length if line.length_apart is None else line.length_apart, "length"),
        shared_u=None if line.shared_u is None else common,
        note=note,
    )


def smoothed(u: Float, sigma: Float, length: Float, shared: Float, longest: float = LONGEST) -> Smoothed:
    """Positions u (n,) px, NaN where there is none, with their sigmas (n,) px, how many scan lines err alike (n,), and
    an error in common (n,) px; over smoothing lengths of up to `longest` scan lines.
    """
    rows = np.flatnonzero(np.isfinite(u) & np.isfinite(sigma) & (sigma > 0.0))
    out = Smoothed(u.copy(), sigma.copy(), length.copy(), shared.copy(), np.full(len(u), np.nan), (0,) * len(Kind))
    for part in np.split(rows, np.flatnonzero(np.diff(rows) > GAP) + 1):
        if len(part) >= FEWEST:
            out = _stretch_smoothed(out, part, longest)
    return out


def _stretch_smoothed(line: Smoothed, rows: NDArray[np.intp], longest: float) -> Smoothed:
    """With the positions on `rows`, without wide gaps, smoothed."""
    whole = np.arange(rows[0], rows[-1] + 1)

    def filled(values: Float) -> Float:
        return np.interp(whole, rows, values[rows])

    middle = whole.mean()
    level = np.polynomial.Polynomial.fit(rows - middle, line.u[rows], 1)(whole - middle)
    sigma = np.maximum(filled(line.sigma), FINEST * np.median(line.sigma[rows]))
    stretch = Stretch(filled(line.u) - level, sigma, filled(line.length), np.isin(whole, rows))
    curve, shocks = curve_with_shocks(stretch, longest)
    kept = np.flatnonzero(curve.used)
    mean = curve.smoothed(np.stack([filled(line.shared), stretch.white], axis=1))[kept]
    variance = curve.variance()[kept]
    at = whole[kept]
    out = replace(line, **{name: getattr(line, name).copy() for name in ("u", "sigma", "length", "shared", "reach")})
    out.u[at], out.sigma[at], out.shared[at] = (level + curve.u)[kept], np.sqrt(variance), mean[:, 0]
    # a mean over many is as sure as before, so that what sigma loses the length gains
    out.length[at], out.reach[at] = np.maximum(mean[:, 1] / variance, 1.0), curve.reach[kept]
    counts = tuple(before + sum(one.kind == kind for one in shocks) for kind, before in enumerate(line.shocks))
    return replace(out, shocks=counts)


def _told(ranks: list[Smoothed]) -> str:
    """What was done, for a person."""
    reach = np.concatenate([one.reach[np.isfinite(one.reach)] for one in ranks])
    if not len(reach):
        return f"not smoothed along the line: no {FEWEST} positions with a sigma stand together"
    counts = {Kind(kind): sum(one.shocks[kind] for one in ranks) for kind in range(len(Kind))}
    kept = [_counted(counts[kind], kind.name.lower()) for kind in (Kind.CORNER, Kind.STEP) if counts[kind]]
    told = [f"smoothed along the line over {np.median(reach):.2g} scan lines (median)"]
    told += [" and ".join(kept) + " kept"] if kept else []
    told += [_counted(counts[Kind.STRAY], "stray") + " left alone"] if counts[Kind.STRAY] else []
    return ", ".join(told)


def _counted(count: int, noun: str) -> str:
    return f"{count} {noun}{'' if count == 1 else 's'}"
