"""What a photograph's positions scatter beyond what its pixels tell, and how far along the line they err alike.

Demosaicing, denoising, sharpening, JPEG and speckle make the noise of neighbouring pixels alike. A fit takes what is
alike for the line, and its residuals are too small: sigma by single pixels is too small as well. The positions
themselves tell it. Over a run of scan lines a surface is smooth, here a cubic, and what is left,

    r = R e,   R = 1 - P (P' P)^-1 P',   E[r r'] = sum over lags k of c_k R T_k R'

with e the errors in sigmas, P the cubic over sigma and T_k ones on the k-th diagonals, gives moments of r that are
linear in the covariances c_k, of as few lags as explain them. These are weighted as normal likelihood weighs white
errors (C. R. Rao, J. Multivariate Analysis 1, 445, 1971). c_0 is what sigma's square would have to be multiplied with,
1 + 2 (c_1 + c_2 ...) / c_0 how many scan lines err alike. What c_0 is above 1 is parted, by non-negative least squares
over the scan lines, into a share of sigma's square and a variance of its own. Where it is below 1 on scan lines of one
kind, as of those that no fit follows, whose sigma holds what that may cost at most, their sigma is as much smaller.
Shape finer than a run counts as noise: of a sensor whose pixels are independent a rough surface is told, and nothing is
asked here.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import scipy  # whose parts are loaded as they are named: the window starts without them
from numpy.typing import NDArray

from analysis.line.result import Flag, Line
from render.base.arrays import Float
from render.base.few_values import quantile

RUNS = (32, 64)
"""Scan lines in a run: the longer, if a cubic still follows the line there."""
SHAPE = 2.0
"""Times the variance of the shorter runs from which the longer ones show shape: that which a cubic does not follow
grows by 256 with a run of twice the length, noise that is alike over many scan lines by little."""
FILLED, FEWEST_RUNS = 0.6, 4
"""Share of a run with positions, and runs, below which nothing is said."""
DEGREE = 3
LAGS = 4
"""Runs are so many times as long as the distances that are told apart."""
STRAY = 4.0
"""Robust standard deviations from its run's cubic at which a position is a stray, in px and in its own sigmas."""
EDGE, JUMP = 3.0, 1.0
"""Times the median variance from which a run shows an edge; so does a scatter of so many widths of the line."""
FINEST = 1.1
"""px; a narrower line of colours that are filled in, which widens it by 0.7 px, is narrower than the pixels that saw
it are apart: where between them it is, nothing tells."""
SINGLE, MOST = (Flag.OK, Flag.UNRESOLVED, Flag.SPECKLED), 0.6
"""Flags of a line that is no other's neighbour, and the share of them from which they alone are asked: where a line
that is two or none is taken to be, jumps."""
KINDS = (SINGLE, (Flag.SATURATED,), (Flag.BLENDED,), (Flag.MISFIT,))
"""Flags whose sigmas are told in one way each."""
SURE, KNOWN = 3.0, 0.2
"""Standard errors from which a variance is believed to be another than the one told, and how well that is known at
best."""
LIKELY = 1.0
"""Standard errors by which errors at a distance have to be alike to be told so."""
LEAST = 0.01
"""Of the variance told, in one of two rounds."""


@dataclass(frozen=True)
class SharedNoise:
    """sigma^2 = (1 + share) sigma_told^2 + variance."""

    share: float
    """What grows with the noise told: that of pixels which is alike."""
    variance: float
    """px^2: what does not, such as speckle, and colours that are filled in."""
    length: float
    """Scan lines that err alike."""

    def added_to(self, line: Line) -> Line:
        """The line with larger sigmas and correlation lengths."""
        told = np.ones_like(line.u) if line.length_apart is None else line.length_apart
        sigma = np.sqrt((1.0 + self.share) * line.sigma_u**2 + self.variance)
        return replace(line, sigma_u=sigma, length_apart=np.maximum(told, self.length))


def with_shared_noise(line: Line) -> Line:
    """A line (n, k) whose pixels share noise -> the same with what its first peaks scatter beyond their sigma_u, in
    all peaks; as it is where they scatter as they tell, or are too few. Where it is narrow, its single lines are
    flagged `UNRESOLVED`.
    """
    valid, single = line.valid[:, 0], np.isin(line.flag[:, 0], SINGLE)
    narrow = valid.any() and float(np.median(line.width[valid, 0])) < FINEST
    coarse = (line.flag == Flag.OK) & ((line.width < FINEST) | narrow)
    line = replace(line, flag=np.where(coarse, Flag.UNRESOLVED, line.flag).astype(line.flag.dtype))
    line, found = _no_less_sure(line)
    asked = single if single.sum() >= MOST * valid.sum() else valid
    if (asked != valid).any():
        found = _covariance(np.where(asked, line.u[:, 0], np.nan), line.sigma_u[:, 0], line.width[:, 0])
    noise = None if found is None else _beyond(found)
    if noise is None:
        return line
    candidates = None if line.candidates is None else noise.added_to(line.candidates)
    return replace(noise.added_to(line), candidates=candidates)


def _no_less_sure(line: Line) -> tuple[Line, _Covariance | None]:
    """The line (n, k) with smaller sigmas on those `KINDS` of scan lines whose first peaks surely scatter by less, and
    what its positions' errors are by these."""
    sigma, flag = line.sigma_u.copy(), line.flag[:, 0]
    u = np.where(line.valid[:, 0], line.u[:, 0], np.nan)
    found = _covariance(u, sigma[:, 0], line.width[:, 0])
    for _ in range(2):  # runs are weighted by sigma
        smaller = [] if found is None else _smaller(found, flag)
        if not smaller:
            break
        for kind, ratio in smaller:
            sigma[np.isin(line.flag, kind)] *= ratio
        found = _covariance(u, sigma[:, 0], line.width[:, 0])
    if not (sigma < line.sigma_u).any():
        return line, found
    # what neighbours share has to stay a part of it
    less = np.where(sigma < line.sigma_u, sigma / line.sigma_u, 1.0)
    shared = None if line.shared_u is None else line.shared_u * less
    return replace(line, sigma_u=sigma, shared_u=shared), found


def _smaller(found: _Covariance, flag: NDArray[np.uint8]) -> list[tuple[tuple[Flag, ...], float]]:
    """Of the flags (n,) of scan lines those `KINDS` whose sigma is surely too large, and what to multiply it with."""
    rows, squares = (np.concatenate([getattr(run, name) for run in found.runs]) for name in ("rows", "squares"))
    # degrees of freedom, and what errs alike, are missing from all squares alike
    squares = squares * (found.covariance[0] / squares.mean())
    out: list[tuple[tuple[Flag, ...], float]] = []
    for kind in KINDS:
        here = squares[np.isin(flag[rows], kind)]
        error = math.sqrt(2.0 * found.length / max(len(here), 1))
        if len(here) >= FEWEST_RUNS * RUNS[0] / 2 and here.mean() * (1.0 + SURE * error) + KNOWN < 1.0:
            out.append((kind, math.sqrt(max(float(here.mean()), LEAST))))
    return out


def shared_noise(u: Float, sigma: Float, width: Float) -> SharedNoise | None:
    """Positions, sigmas and widths (n,) px -> what they scatter beyond their sigmas, and how far alike.

    None: as they tell and independently, as far as can be sure, or too few positions.
    """
    found = _covariance(u, sigma, width)
    return None if found is None else _beyond(found)


def _beyond(found: _Covariance) -> SharedNoise | None:
    variance = max(float(found.covariance[0]), 1e-300)
    more = variance - 1.0 > SURE * found.error + KNOWN
    if not (more or found.covariance[1:2].sum() > SURE * found.error * max(variance, 1.0)):
        return None
    share, added = _parted(found.runs, variance - 1.0) if more else (0.0, 0.0)
    return SharedNoise(share, added, found.length)


@dataclass(frozen=True)
class _Covariance:
    runs: list[_Run]
    covariance: Float
    """(lags,) of errors in sigmas."""
    error: float
    """Standard error of the first, were errors white."""

    @property
    def length(self) -> float:
        """Scan lines that err alike."""
        below = np.flatnonzero(self.covariance[1:] <= 0.0)
        last = int(below[0]) if len(below) else len(self.covariance) - 1
        shared = float(self.covariance[1 : 1 + last].sum())
        return max(1.0 + 2.0 * shared / max(float(self.covariance[0]), 1e-300), 1.0)


def _covariance(u: Float, sigma: Float, width: Float) -> _Covariance | None:
    """Positions, sigmas and widths (n,) px -> covariances of their errors along the line; None: too few of them."""
    runs: list[_Run] = []
    before = math.inf
    for length in RUNS:
        longer = _runs(u, sigma, width, length)
        typical = float(np.median([run.variance for run in longer])) if longer else math.inf
        smooth = [run for run in longer if run.variance <= EDGE * typical]
        if len(smooth) < FEWEST_RUNS or typical > SHAPE * max(before, 1.0):
            break
        runs, before = smooth, typical
    if not runs:
        return None
    moments = np.sum([run.moments for run in runs], axis=0)
    design = np.sum([run.design for run in runs], axis=0)
    covariance = _shortest(moments, design)
    # of white errors: twice the squared mean over the degrees of freedom
    return _Covariance(runs, covariance, float(np.sqrt(2.0 / design[0, 0])))


def _shortest(moments: Float, design: Float) -> Float:
    """(m,) covariances at as few distances as leave none of the next one's moment (lags,) unexplained, by chance.

    All distances that fit into a run are too many: what errs alike over all of it is the cubic's, so that one unknown
    more or less for each shifts all of them together.
    """
    for count in range(1, len(moments)):
        found = np.linalg.solve(design[:count, :count], moments[:count])
        alike = found / max(float(found[0]), 1e-300)
        # of products of normal errors that are alike (Bartlett, J. Royal Statist. Soc. Suppl. 8, 27, 1946)
        scatter = max(float(found[0]), 0.0) * math.sqrt(2.0 * design[count, count] * (2.0 * float(alike @ alike) - 1.0))
        if moments[count] - design[count, :count] @ found <= LIKELY * scatter:
            return np.asarray(found)
    return np.asarray(np.linalg.lstsq(design, moments, rcond=1e-9)[0])


def _parted(runs: list[_Run], excess: float) -> tuple[float, float]:
    """What the squares are above 1 in the mean, as a share of sigma^2 and in px^2, by where they are."""
    squares = np.concatenate([run.squares for run in runs])
    inverse = np.concatenate([run.inverse for run in runs])
    mean = float(inverse.mean())
    design = np.stack([np.ones_like(inverse), inverse / mean], axis=1)
    share, added = scipy.optimize.nnls(design, (1.0 + excess) / squares.mean() * squares - 1.0)[0]
    total = share + added
    if total <= 0.0:
        return excess, 0.0
    return float(share / total * excess), float(added / total * excess / mean)


@dataclass(frozen=True)
class _Run:
    moments: Float
    """(lags,) sums of products of what a cubic leaves, in sigmas."""
    design: Float
    """(lags, lags) what covariances of 1 at each distance would make of them."""
    squares: Float
    """(n,) of what the cubic leaves, in sigmas."""
    inverse: Float
    """(n,) 1 / sigma^2, px^-2."""
    rows: NDArray[np.intp]
    """(n,) scan lines."""

    @property
    def variance(self) -> float:
        return float(self.moments[0] / self.design[0, 0])


def _runs(u: Float, sigma: Float, width: Float, length: int) -> list[_Run]:
    """Those without jumps."""
    starts = range(0, len(u) - length + 1, length)
    cut = [(start, slice(start, start + length)) for start in starts]
    found = [_run(u[here], sigma[here], width[here], start) for start, here in cut]
    return [run for run in found if run is not None]


def _run(u: Float, sigma: Float, width: Float, start: int) -> _Run | None:
    """None: too few positions, or a jump among them."""
    there = np.isfinite(u) & np.isfinite(sigma) & (sigma > 0.0)
    if there.sum() < FILLED * len(u):
        return None
    rest = _residual_maker(np.flatnonzero(there).tobytes(), len(u)) @ u[there]
    scale, own = (1.4826 * quantile(np.abs(one)) for one in (rest, rest / sigma[there]))
    there[there] = (np.abs(rest) <= STRAY * scale) | (np.abs(rest) <= STRAY * own * sigma[there])
    if there.sum() < FILLED * len(u) or scale > JUMP * quantile(width[there]):
        return None
    rows, told = np.flatnonzero(there), sigma[there]
    # a cubic by the positions that know it best: by all alike, the noise of a few would be in the rest of all
    basis = np.linalg.qr(_powers(rows, len(u)) / told[:, None])[0]
    scaled = u[there] / told
    scaled = scaled - basis @ (basis.T @ scaled)
    lags = _lags(rows.tobytes(), len(u))
    sides = lags @ basis
    squares, inner = sides.reshape(len(lags), -1), (basis.T @ sides).reshape(len(lags), -1)
    # sums over R T_j R o T_k of R = 1 - Q Q', Q the cubic's basis
    design = np.diag(lags.sum(axis=(1, 2))) - 2.0 * squares @ squares.T + inner @ inner.T
    return _Run((lags @ scaled) @ scaled, design, scaled**2, told**-2, start + rows)


@lru_cache(maxsize=8)
def _lags(at: bytes, length: int) -> Float:
    """(lags, n, n) pairs of the scan lines `at`, bytes of (n,), of a run that are so far apart."""
    places = np.frombuffer(at, np.intp)
    apart = np.abs(places[:, None] - places[None, :])
    return np.stack([apart == k for k in range(length // LAGS)]).astype(np.float64)


@lru_cache(maxsize=8)
def _residual_maker(at: bytes, length: int) -> Float:
    """(n, n) that takes the cubic out of positions on the scan lines `at`, bytes of (n,), of a run; most are alike."""
    powers = _powers(np.frombuffer(at, np.intp), length)
    return np.asarray(np.eye(len(powers)) - powers @ np.linalg.pinv(powers))


def _powers(rows: NDArray[np.intp], length: int) -> Float:
    """(n, DEGREE + 1) of scan lines (n,) of a run."""
    return np.vander(rows / length - 0.5, DEGREE + 1)
