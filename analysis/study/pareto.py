"""Which of several ways nothing beats in both cost and error, where more cost stops paying, and how sure that is."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from render.base.arrays import Float

Mask = NDArray[np.bool_]

RESAMPLES = 2000


@dataclass(frozen=True)
class Front:
    """(n,) arrays, one entry a way. `member` and `knee` are of the means, the probabilities of the bootstrap."""

    member: Mask
    """On the front: no other way is as cheap and as accurate, and better in one of them."""
    member_probability: Float
    knee: int | None
    """The way where the front turns from steep to flat; None: the front has fewer than three ways."""
    knee_probability: Float
    """That this way is the knee, over the resamples that have one."""


def front(cost: Float, error: Float) -> Mask:
    """(n,) costs and errors -> (n,) on the Pareto front; a way that is not finite is not.

    Of several ways that are equal in both, all are on it.
    """
    usable = np.isfinite(cost) & np.isfinite(error)
    order = np.lexsort((error, cost))
    member = np.zeros(len(cost), dtype=np.bool_)
    best, best_cost = np.inf, np.nan
    for i in order[usable[order]]:
        if error[i] < best or (error[i] == best and cost[i] == best_cost):
            member[i], best, best_cost = True, error[i], cost[i]
    return member


def knee(cost: Float, error: Float) -> int | None:
    """Index of the way on the front that lies farthest below the chord between its ends, on logarithmic axes.

    The axes are scaled to the front's own extent first, so that units do not matter. None: fewer than three ways on
    the front, or none below the chord. Source: Satopaa et al. (2011), "Finding a kneedle in a haystack", section 3.
    """
    ways = np.flatnonzero(front(cost, error) & (cost > 0.0) & (error > 0.0))
    ways = ways[np.argsort(cost[ways], kind="stable")]
    if len(ways) < 3:
        return None
    x, y = np.log(cost[ways]), np.log(error[ways])
    if x[-1] == x[0] or y[-1] == y[0]:
        return None
    below = 1.0 - (x - x[0]) / (x[-1] - x[0]) - (y - y[-1]) / (y[0] - y[-1])
    best = int(np.argmax(below))
    return int(ways[best]) if below[best] > 1e-9 else None


def bootstrapped_front(costs: Sequence[Float], errors: Sequence[Float], seed: int = 0) -> Front:
    """Repeats of each way, (repeats,) costs and errors -> the front of median cost and mean error.

    A repeat that measured nothing, NaN, is left out with its cost, as it is of the interval of the mean; a way of which
    none measured anything is not on the front. The repeats of a way are drawn anew with replacement, cost and error
    together. Source: Efron (1979).
    """
    usable = [np.isfinite(cost) & np.isfinite(error) for cost, error in zip(costs, errors, strict=True)]
    costs = [np.asarray(one)[here] for one, here in zip(costs, usable, strict=True)]
    errors = [np.asarray(one)[here] for one, here in zip(errors, usable, strict=True)]
    generator = np.random.Generator(np.random.Philox(seed))
    cost = np.array([_or_nan(np.median, one) for one in costs])
    error = np.array([_or_nan(np.mean, one) for one in errors])
    drawn_cost, drawn_error = np.empty((RESAMPLES, len(cost))), np.empty((RESAMPLES, len(cost)))
    for i, (one_cost, one_error) in enumerate(zip(costs, errors, strict=True)):
        if len(one_cost) == 0:
            drawn_cost[:, i] = drawn_error[:, i] = np.nan
            continue
        which = generator.integers(0, len(one_cost), (RESAMPLES, len(one_cost)))
        drawn_cost[:, i] = np.median(np.asarray(one_cost)[which], axis=1)
        drawn_error[:, i] = np.mean(np.asarray(one_error)[which], axis=1)
    members = np.zeros(len(cost))
    knees = np.zeros(len(cost))
    for one_cost, one_error in zip(drawn_cost, drawn_error, strict=True):
        members += front(one_cost, one_error)
        found = knee(one_cost, one_error)
        if found is not None:
            knees[found] += 1.0
    return Front(front(cost, error), members / RESAMPLES, knee(cost, error), knees / max(knees.sum(), 1.0))


def _or_nan(summary: Callable[[Float], np.floating[Any]], values: Float) -> float:
    return float(summary(values)) if len(values) else float("nan")
