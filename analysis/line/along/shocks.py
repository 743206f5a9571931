"""Steps, corners and strays: where positions along the line depart from a smooth curve by more than chance.

A shock is an unknown number in the mean of one second difference (a corner), of two in a row (a step) or of the noise
of one position (a stray). By how much it raises twice the log likelihood follows from the curve without it,

    m' (q - V)^-1 m,   m, V the second differences and their covariance;   P (u - f)^2 / (1 - P A^-1)

and is chi-square distributed where there is none (de Jong and Penzer, J. Am. Statist. Assoc. 93, 796, 1998).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.special import chdtri

from analysis.line.along.curve import LONGEST, Curve, Kind, Shock, Stretch, curve_through, with_shocks
from analysis.line.along.five_diagonals import of_second_differences
from render.base.arrays import Float

CHANCE = 0.05
"""Of one shock of a kind or more on a line that has none."""
ROUNDS = 40
"""Of finding shocks, each with those that were found before."""
NEAR = 6
"""Scan lines to either side that a shock is placed anew in, when the others are known."""
ROUNDING = 1e-3
"""Share of a variance below which rounding has it."""


def curve_with_shocks(stretch: Stretch, longest: float = LONGEST) -> tuple[Curve, list[Shock]]:
    """The curve through a stretch, smoothed over `longest` scan lines at most, and the steps, corners and strays that
    are not smoothed."""
    shocks: list[Shock] = []
    curve = curve_through(stretch, longest=longest)
    for _ in range(ROUNDS):
        more = _found(curve)
        if not more:
            break
        shocks += more
        curve = curve_through(stretch, shocks, curve.q, longest)
    if shocks:
        shocks = _placed_anew(curve, shocks)
        curve = curve_through(stretch, shocks, curve.q, longest)
    return curve, shocks


def _placed_anew(curve: Curve, shocks: Sequence[Shock]) -> list[Shock]:
    """Each where it is likeliest with the others as they are, or left out: the first were found among all others."""
    placed = list(shocks)
    for shock in shocks:
        others = [one for one in placed if one != shock]
        first = max(shock.row - NEAR, 0)
        gain = _gain(with_shocks(curve, others))[:, first : shock.row + NEAR + 1]
        kind, row = np.unravel_index(int(np.argmax(gain)), gain.shape)
        placed = others + ([Shock(Kind(int(kind)), first + int(row))] if gain[kind, row] > 0.0 else [])
    return placed


def _found(curve: Curve) -> list[Shock]:
    """The strongest shocks, so far apart that one is not the other's shadow."""
    gain = _gain(curve)
    best, kind = gain.max(axis=0), gain.argmax(axis=0)
    apart = math.ceil(2.0 * float(np.median(curve.reach))) + 3
    found: list[Shock] = []
    for row in np.argsort(-best, kind="stable"):
        if best[row] <= 0.0:
            break
        if all(abs(int(row) - other.row) > apart for other in found):
            found.append(Shock(Kind(int(kind[row])), int(row)))
    return found


def _gain(curve: Curve) -> Float:
    """(3, n) by how much a shock of each `Kind` is likelier than chance, as chi-square; -inf where none can be."""
    n = len(curve.u)
    one, two = float(chdtri(1, CHANCE / n)), float(chdtri(2, CHANCE / n))
    out = np.full((len(Kind), n), -np.inf)
    known = 1.0 - curve.weight * curve.covariance[0]
    sure = curve.used & (known > ROUNDING)
    residual = curve.weight * (curve.stretch.u - curve.u) ** 2
    out[Kind.STRAY, sure] = residual[sure] / known[sure] - one
    bend, told = curve.bend, curve.told
    sure = curve.bent & (told > ROUNDING * curve.q)
    out[Kind.CORNER, sure] = bend[sure] ** 2 / told[sure] - one
    both = -of_second_differences(curve.covariance, 1)[:-1]
    determinant = told[:-1] * told[1:] - both**2
    pairs = np.flatnonzero(sure[:-1] & sure[1:] & (determinant > ROUNDING**2 * told[:-1] * told[1:]))
    left, right = bend[pairs], bend[pairs + 1]
    square = told[pairs + 1] * left**2 - 2.0 * both[pairs] * left * right + told[pairs] * right**2
    out[Kind.STEP, pairs] = square / determinant[pairs] - two
    return out
