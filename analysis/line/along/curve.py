"""The likeliest smooth curve through positions along the line, how smooth it is chosen by the positions themselves.

Positions u (n,) are a curve f and noise, and of the curve's second differences D f only the variance is known:

    D f ~ N(0, Q):   f = A^-1 P u,   cov f = A^-1,   A = P + D' Q^-1 D,   P = 1 / (sigma^2 length)

(Whittaker, Proc. Edinburgh Math. Soc. 41, 63, 1923; as a prior: Wahba, J. R. Statist. Soc. B 40, 364, 1978). Noise of
which `length` neighbours err alike is taken as white and so many times as strong: that is what it is to a curve that
bends over more scan lines than that, whatever its correlations are. The marginal likelihood chooses Q, one number q
between two breaks (fixed point of Harville, J. Am. Statist. Assoc. 72, 320, 1977), and with it the smoothing length

    h = (sigma^2 length / q)^(1/4),   at which sigma^2 falls to 3 sqrt(2) / 16 sigma^2 length / h

(Silverman, Ann. Statist. 12, 898, 1984) where the curve is as smooth as can be; a third more is what a curve that is no
smoother than the model asks of it may be off. Where h is short beside `length`, the same neighbours are averaged that
err alike, and sigma^2 falls by less: of noise whose correlation falls geometrically, whose spectrum is

    sigma^2 length / (1 + (length^2 - 1) sin^2(w / 2)),

by G(b) times what white noise of that strength leaves, b = (length^2 - 1)^(1/2) / 2 h, in closed form.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_solve_banded, cholesky_banded

from analysis.line.along.five_diagonals import SECOND, gram, inverse_diagonals, of_second_differences
from render.base.arrays import Float

Mask = NDArray[np.bool_]

SHORTEST, LONGEST = 0.5, 32.0
"""Scan lines of smoothing: below, nothing is averaged; beyond, rounding spoils what tells steps and corners."""
PIECE = 8.0
"""Times the smoothing length that a piece between two breaks has at least: a longer one is hardly better."""
FREE = 1
"""Scan lines on either side of a break that are free with it: where it is, is known no better."""
FIRST = 2.0
"""Smoothing length to start from: short, so that breaks stand out."""
STEPS, SETTLED = 40, 0.05
"""Of the fixed point, and the change of log q at which it is one."""
POOLED = 1.0
"""Degrees of freedom of all pieces that each piece counts with its own."""
UNSEEN = 1e-6
"""Weight of a scan line without a position, which is interpolated there, for a matrix that has an inverse."""
SMOOTHEST, DOUBT = 0.75, 4.0
"""Share of the curve's variance that is noise, and degrees of freedom that speak for none being so smooth."""


class Kind(IntEnum):
    """What does not follow the model."""

    STRAY = 0
    """A position that belongs to no curve."""
    CORNER = 1
    STEP = 2


class Shock(NamedTuple):
    """Where the model does not hold: a stray's row, or the last row of the first second difference that is free."""

    kind: Kind
    row: int


@dataclass(frozen=True)
class Stretch:
    """Positions (n,) px on consecutive scan lines, less a straight line; interpolated where not `there`."""

    u: Float
    sigma: Float
    """(n,) px."""
    length: Float
    """(n,) scan lines that err alike."""
    there: Mask

    @property
    def white(self) -> Float:
        """(n,) px^2: variance of the noise taken as white."""
        return np.asarray(self.sigma**2 * self.length)


@dataclass(frozen=True)
class Curve:
    """The curve through a stretch, with some shocks; arrays (n,) by scan line."""

    stretch: Stretch
    used: Mask
    """Positions that are on it."""
    bent: Mask
    """Second differences, by their last row, that follow the model; False: free, and on the first two rows none."""
    q: Float
    """px^2, of second differences."""
    weight: Float
    """P, px^-2."""
    factor: Float
    """(3, n) Cholesky's of A, as diagonals."""

    @cached_property
    def covariance(self) -> Float:
        """(5, n) px^2, of the curve."""
        return np.asarray(inverse_diagonals(self.factor))

    @cached_property
    def u(self) -> Float:
        return self.smoothed(self.stretch.u[:, None])[:, 0]

    @cached_property
    def bend(self) -> Float:
        """Its second differences, px."""
        return np.concatenate([[0.0, 0.0], np.diff(self.u, 2)])

    @cached_property
    def told(self) -> Float:
        """px^2: of a second difference what the positions tell, q less the variance that is left."""
        return np.asarray(self.q - of_second_differences(self.covariance, 0))

    @property
    def reach(self) -> Float:
        """Smoothing lengths, scan lines."""
        return np.asarray((self.stretch.white / self.q) ** 0.25)

    def smoothed(self, data: Float) -> Float:
        """Other data (n, k), averaged as the positions are."""
        return np.asarray(cho_solve_banded((self.factor, True), self.weight[:, None] * data))

    def variance(self) -> Float:
        """px^2, of the curve's error: noise, and of what the curve may be off as much as its bends call for.

        Second differences that follow each other smoothly belong to a curve that is smoother than the model, off by
        next to nothing: then noise is 3/4 of the model's variance, and of their changes from row to row as well.
        """
        whole, own = self.covariance[0], self.stretch.sigma**2
        pairs = self.bent[1:] & self.bent[:-1]
        if not pairs.any():
            return np.minimum(whole, own)
        covariance = of_second_differences(self.covariance, 1)[:-1]
        expected = ((self.told[1:] + self.told[:-1] + 2.0 * covariance) / self.q[1:])[pairs].sum()
        found = (np.diff(self.bend) ** 2 / self.q[1:])[pairs].sum()
        known = max(float((self.told / self.q)[self.bent].sum()), 0.0)
        share = (known * found / max(float(expected), 1e-12) + DOUBT) / (known + DOUBT)
        alone = np.minimum(whole * self.weight, 1.0)  # 1: told by nothing but its own position
        noise = whole * (1.0 - (1.0 - np.clip(share, SMOOTHEST, 1.0)) * (1.0 - alone))
        return np.minimum(noise * averaged_alike(self.stretch.length, alone), own)


def averaged_alike(length: Float, alone: Float) -> Float:
    """Of noise of which `length` (n,) neighbours err alike, correlations falling geometrically, what a spline leaves of
    its variance over what it leaves of white noise of variance sigma^2 length; alone (n,): a position's own weight in
    the curve, 1 / (2 sqrt(2) h) of smoothing length h.

    Integral over w of 1 / ((1 + w^4)^2 (1 + b^2 w^2)), over that of b = 0, by partial fractions.
    """
    b = np.sqrt(2.0 * np.maximum(length**2 - 1.0, 0.0)) * alone
    square, fourth = b**2, b**4
    far = fourth / (1.0 + fourth) * 4.0 / 3.0 * (np.sqrt(2.0) * b**3 + 1.0 - square)
    return np.asarray((far + 1.0 - square / 3.0) / (1.0 + fourth))


def curve_through(
    stretch: Stretch, shocks: Sequence[Shock] = (), start: Float | None = None, longest: float = LONGEST
) -> Curve:
    """The curve with the likeliest q of each piece between breaks, of smoothing lengths up to `longest` scan lines;
    start (n,): q to begin with."""
    used, bent = _marked(stretch.there, shocks)
    white = stretch.white
    piece = np.cumsum(bent & ~np.concatenate([[False], bent[:-1]]))  # what is free goes with the one before
    rows = np.maximum(np.bincount(piece), 1)
    typical = np.exp(np.bincount(piece, np.log(white)) / rows)
    most = np.clip(rows / PIECE, SHORTEST, longest)
    q = white / FIRST**4 if start is None else start
    for _ in range(STEPS):
        curve = _curve(stretch, used, bent, q)
        squares = np.where(bent, curve.bend**2, 0.0)
        known = np.where(bent, np.maximum(curve.told / q, 0.0), 0.0)
        pooled = squares.sum() / max(float(known.sum()), 1e-12)
        likeliest = (np.bincount(piece, squares) + POOLED * pooled) / (np.bincount(piece, known) + POOLED)
        before, q = q, np.clip(likeliest, typical / most**4, typical / SHORTEST**4)[piece]
        if not bent.any() or np.abs(np.log(q / before))[bent].max() < SETTLED:
            break
    return _curve(stretch, used, bent, q)


def with_shocks(curve: Curve, shocks: Sequence[Shock]) -> Curve:
    """The same curve with other shocks, as smooth as before."""
    used, bent = _marked(curve.stretch.there, shocks)
    return _curve(curve.stretch, used, bent, curve.q)


def _curve(stretch: Stretch, used: Mask, bent: Mask, q: Float) -> Curve:
    weight = 1.0 / stretch.white
    weight[~used] = UNSEEN * np.median(weight[used])
    whole = gram(np.where(bent[:, None], SECOND / np.sqrt(q)[:, None], 0.0))
    whole[0] += weight
    return Curve(stretch, used, bent, q, weight, cholesky_banded(whole, lower=True))


def _marked(there: Mask, shocks: Sequence[Shock]) -> tuple[Mask, Mask]:
    """`used` and `bent`."""
    used, bent = there.copy(), np.ones(len(there), np.bool_)
    bent[:2] = False
    for kind, row in shocks:
        if kind == Kind.STRAY:
            used[row] = False
        else:
            bent[max(row - FREE, 0) : row + FREE + int(kind)] = False
    return used, bent
