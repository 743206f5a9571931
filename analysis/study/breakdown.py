"""Where a measure crosses its limit, by bisection with repeats: few runs, and an interval that holds as often as told.

The search keeps no state: from what was measured so far it says which values to measure next, so that it goes on after
a kill where it stood, and any number of machines can measure.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from analysis.study.intervals import student
from render.base.arrays import Float

Measured = Mapping[float, Float]
"""Repeats (n,) of the measure by the value of the parameter; NaN where a run measured nothing."""
Ending = Literal["found", "holds", "fails"]

NEAR = 9.0
"""Standard errors between the limit and both ends of a bracket, below which bisection would soon decide by noise."""
WIDEST = 0.25
"""Of the whole way: over a wider bracket no parabola follows the measure."""
EXTRA = 6
"""Values measured across the last bracket and half of it on either side, for the fit; 4 to 12 give coverage alike."""


@dataclass(frozen=True)
class Search:
    """From `good`, where the measure is to hold its limit, to `bad`, where it is expected not to; either may be larger.

    above: the limit is broken by a measure above it, otherwise by one below it. tolerance: of the bracket, as a share
    of the whole way, on a logarithmic scale where `logarithmic`.
    """

    good: float
    bad: float
    limit: float
    above: bool = True
    logarithmic: bool = False
    tolerance: float = 0.01

    def place(self, value: float) -> float:
        """0 at `good`, 1 at `bad`."""
        if self.logarithmic:
            return math.log(value / self.good) / math.log(self.bad / self.good)
        return (value - self.good) / (self.bad - self.good)

    def value(self, place: float) -> float:
        """The value at a place, with the ends as they were given."""
        if place in (0.0, 1.0):
            return self.bad if place else self.good
        if self.logarithmic:
            return float(self.good * (self.bad / self.good) ** place)
        return float(self.good + place * (self.bad - self.good))


@dataclass(frozen=True)
class Breakdown:
    """Where the limit is crossed, and the 95 % interval of that."""

    ending: Ending
    """found; holds: the limit is kept up to `bad`; fails: it is broken at `good` already."""
    value: float
    low: float
    high: float
    last_good: float
    """The nearest value measured whose mean holds the limit."""
    first_bad: float


def next_values(search: Search, measured: Measured) -> list[float]:
    """Values to measure next, all with as many repeats; empty: the search has ended."""
    missing = [end for end in (search.good, search.bad) if end not in measured]
    if missing:
        return missing
    good, bad = _bracket(search, measured)
    if good is None or bad is None:
        return []
    if not _resolved(search, measured, good, bad):
        return [search.value(0.5 * (good + bad))]
    if not _noisy(search, measured, good, bad):
        return []
    return [value for value in _across(search, good, bad) if value not in measured]


def breakdown(search: Search, measured: Measured) -> Breakdown:
    """What an ended search found.

    The interval is where the 95 % band of a polynomial, fitted through all repeats about the last bracket, holds the
    limit: exact for normal repeats about such a curve. Source: Fieller (1954), J. R. Stat. Soc. B 16, 175. Where the
    bracket is narrower than the tolerance and its ends clearly apart, it is the interval.
    """
    good, bad = _bracket(search, measured)
    if bad is None:
        return Breakdown("holds", math.nan, search.bad, math.nan, search.bad, math.nan)
    if good is None:
        return Breakdown("fails", math.nan, math.nan, search.good, math.nan, search.good)
    low, high = good, bad
    middle = 0.5 * (good + bad)
    if _noisy(search, measured, good, bad):
        middle, low, high = _crossing(search, measured, good, bad)
    values = sorted((search.value(low), search.value(high)))
    return Breakdown("found", search.value(middle), values[0], values[1], search.value(good), search.value(bad))


def _bracket(search: Search, measured: Measured) -> tuple[float | None, float | None]:
    """Places of the last value that holds the limit before the first bisected one that breaks it; None: there is none.

    Only bisection's own values count: those across the bracket are there for the fit.
    """
    good, bad = 0.0, 1.0
    if _breaks(search, measured[search.good]):
        return None, 0.0
    if not _breaks(search, measured[search.bad]):
        return 1.0, None
    while not _resolved(search, measured, good, bad):
        middle = 0.5 * (good + bad)
        repeats = measured.get(search.value(middle))
        if repeats is None:
            break
        good, bad = (good, middle) if _breaks(search, repeats) else (middle, bad)
    return good, bad


def breaks(limit: float, above: bool, repeats: Float) -> bool:
    """Whether the mean of repeats (n,) is beyond a limit; where nothing at all was measured any limit is broken."""
    found = repeats[np.isfinite(repeats)]
    mean = float(found.mean()) if len(found) else math.nan
    return not (mean <= limit if above else mean >= limit)


def _breaks(search: Search, repeats: Float) -> bool:
    return breaks(search.limit, search.above, repeats)


def _standard_error(repeats: Float) -> float:
    found = repeats[np.isfinite(repeats)]
    return float(found.std(ddof=1) / math.sqrt(len(found))) if len(found) > 1 else 0.0


def _noisy(search: Search, measured: Measured, good: float, bad: float) -> bool:
    """Whether both ends of a bracket are so near the limit that where it is crossed has to be fitted.

    At a step one end stays far from it, whatever the noise of the other, and bisection goes on.
    """
    ends = [measured[search.value(place)] for place in (good, bad)]
    if bad - good > WIDEST or not all(np.isfinite(one).any() for one in ends):
        return False
    return all(abs(float(np.nanmean(one)) - search.limit) < NEAR * _standard_error(one) for one in ends)


def _resolved(search: Search, measured: Measured, good: float, bad: float) -> bool:
    return bad - good <= search.tolerance or _noisy(search, measured, good, bad)


def _across(search: Search, good: float, bad: float) -> list[float]:
    """Values across a bracket and half of it on either side, within the search."""
    low, high = max(0.0, good - 0.5 * (bad - good)), min(1.0, bad + 0.5 * (bad - good))
    return [search.value(float(place)) for place in np.linspace(low, high, EXTRA)]


def _crossing(search: Search, measured: Measured, good: float, bad: float) -> tuple[float, float, float]:
    """Place of the limit with its interval, from a parabola through all repeats about the bracket."""
    reach = 0.5 * (bad - good) * (1.0 + 1e-9)
    pairs = [
        (search.place(value), one)
        for value, repeats in measured.items()
        if good - reach <= search.place(value) <= bad + reach
        for one in repeats
        if math.isfinite(one)
    ]
    places, repeats = np.array(pairs).T
    centre, width = 0.5 * (good + bad), bad - good
    design = np.vander((places - centre) / width, 3, increasing=True)
    solution, *_ = np.linalg.lstsq(design, repeats - search.limit, rcond=None)
    inverse = np.linalg.pinv(design.T @ design)
    freedom = max(len(repeats) - 3, 1)
    variance = float(np.sum((repeats - search.limit - design @ solution) ** 2)) / freedom
    grid = np.linspace(max(0.0, centre - width), min(1.0, centre + width), 4001)
    rows = np.vander((grid - centre) / width, 3, increasing=True)
    curve = rows @ solution
    half = student(freedom) * np.sqrt(variance * np.einsum("ij,jk,ik->i", rows, inverse, rows))
    middle = float(grid[np.argmin(np.abs(curve))])
    inside = np.flatnonzero(np.abs(curve) <= half)
    if len(inside) == 0:
        return middle, middle, middle
    return middle, float(grid[inside[0]]), float(grid[inside[-1]])
