"""Which values colours and axes show before a person says otherwise: a few points far off must not decide. Qt-free."""

from __future__ import annotations

from typing import Literal

import numpy as np

from analysis.deviation import FAR, far_off
from analysis.measures import robust_sigma
from render.base.arrays import Bool, Float
from studio.scan.deviation import Compared
from studio.scan.result_series import Series, symmetric_limit

ENDS = (1.0, 99.0)
"""Percentiles."""
BESIDE = 0.25
"""Of the true profile's size, room on either side of it."""
OVER_TOLERANCE = 2.0
Ends = tuple[float, float]
Column = Literal["position", "depth", "distance"]


def deviation_limit(made: Compared) -> float:
    """m: twice the larger tolerance; without one, what holds the points that are not far off."""
    asked = [abs(limit) for limit in (made.question.lower, made.question.upper) if limit]
    if asked:
        return OVER_TOLERANCE * max(asked)
    value = made.found.value
    return symmetric_limit(value[~far_off(value)])


def profile_range(truth: Series | None, measured: list[Series]) -> tuple[Ends, Ends] | None:
    """mm, ends of `across` and of `distance`, of a profile: of the true one, and beside it as far as its points are;
    without one from percentile to percentile of the points. None: there is nothing to show a range of."""
    distance, exact = line_range("distance", truth, measured), _exact("distance", truth)
    if truth is None or exact is None:
        across = _of_most(_joined([one.across[np.isfinite(one.distance)] for one in measured]))
    else:
        across = _around(truth.across[exact], BESIDE * float(np.ptp(truth.across[exact])))
    return None if across is None or distance is None else (across, distance)


def line_range(name: Column, truth: Series | None, measured: list[Series]) -> Ends | None:
    """Ends of one column of series, in its unit, as of `profile_range`. None: there is nothing to show a range of."""
    exact = _exact(name, truth)
    if truth is None or exact is None:
        return _of_most(_joined([getattr(one, name) for one in measured]))
    index, values = truth.index[exact], getattr(truth, name)[exact]
    spread = robust_sigma(_joined([getattr(one, name) - np.interp(one.index, index, values) for one in measured]))
    # a flat part is as high as the spread of its points
    return _around(values, max(BESIDE * float(np.ptp(values)), FAR * spread if np.isfinite(spread) else 0.0))


def _exact(name: Column, truth: Series | None) -> Bool | None:
    """(n,) where the true line has a value; None: it has none."""
    exact = None if truth is None else np.isfinite(getattr(truth, name))
    return None if exact is None or not exact.any() else exact


def _around(values: Float, room: float) -> Ends:
    return float(values.min()) - room, float(values.max()) + room


def _joined(pieces: list[Float]) -> Float:
    return np.concatenate([np.zeros(0), *pieces])


def _of_most(values: Float) -> Ends | None:
    """From percentile to percentile, and so much of it more on either side; None: there are none, or all are alike."""
    values = values[np.isfinite(values)]
    low, high = np.percentile(values, ENDS).tolist() if len(values) else (0.0, 0.0)
    more = BESIDE * (high - low)
    return (low - more, high + more) if high > low else None
