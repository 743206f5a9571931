"""How much of an error each of several effects makes, by switching each of them off, and each of them on alone.

Effects that do not meet add up: each makes as much alone as among the others. Where two meet, what an effect makes
among all others is more, or less, than alone, and that difference, summed over the effects, counts every pair twice.
So with pairs alone the total is what is there without any effect, plus every effect alone, plus half of the summed
differences; what is left over is made by three or more at once, and is told. It is the Shapley value of each effect,
for pairs (Shapley 1953, Contributions to the Theory of Games II, 307). Bias adds up as it is, spread as variance.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np

from analysis.study.intervals import Interval, mean_interval
from render.base.arrays import Float


@dataclass(frozen=True)
class Term:
    """What one effect makes of a measure that adds up."""

    effect: str
    alone: Interval
    """More than without any effect."""
    among: Interval
    """More with it than with all others but it."""
    share: Interval
    """The mean of both: alone, with its half of every interaction."""


@dataclass(frozen=True)
class Budget:
    """Of one measure; `floor` + all `alone` + `interaction` + `rest` is the total."""

    total: Interval
    floor: Interval
    """Without any effect."""
    terms: tuple[Term, ...]
    interaction: Interval
    """Of all pairs."""
    rest: Interval
    """Of three or more effects at once; 0 within its interval where the terms add up."""
    own: Interval
    """Shares of the effects that only the simulation has, together."""

    @property
    def adds_up(self) -> bool:
        """The terms and their interaction make the total, within what the repeats tell of it."""
        rest = self.rest
        known = max(self.total.high - self.total.mean, 0.0)
        return bool(rest.low <= 0.0 <= rest.high or abs(rest.mean) <= known)


def budget(
    total: Float,
    none: Float,
    without: Mapping[str, Float],
    only: Mapping[str, Float],
    of_simulation: Collection[str] = (),
) -> Budget:
    """(repeats,) of a measure that adds up, in each state; repeat i of all states shares its seed.

    A repeat in which a state measured nothing counts in none. of_simulation: effects that no real scanner has.
    """
    together = np.array([total, none, *without.values(), *only.values()])
    known = np.isfinite(together).all(axis=0)
    total, none = total[known], none[known]
    terms, alone_sum, met, own = [], np.zeros(len(total)), np.zeros(len(total)), np.zeros(len(total))
    for effect in without:
        alone, among = only[effect][known] - none, total - without[effect][known]
        alone_sum, met = alone_sum + alone, met + 0.5 * (among - alone)
        share = 0.5 * (alone + among)
        own = own + share if effect in of_simulation else own
        terms.append(Term(effect, mean_interval(alone), mean_interval(among), mean_interval(share)))
    rest = mean_interval(total - none - alone_sum - met)
    return Budget(mean_interval(total), mean_interval(none), tuple(terms), mean_interval(met), rest, mean_interval(own))
