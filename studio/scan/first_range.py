"""Which values colours and axes show before a person says otherwise: a few points far off must not decide. Qt-free."""

from __future__ import annotations

import numpy as np

from analysis.deviation import FAR, far_off
from analysis.measures import robust_sigma
from render.base.arrays import Float
from studio.scan.deviation import Compared
from studio.scan.result_series import Series, symmetric_limit

ENDS = (1.0, 99.0)
"""Percentiles."""
BESIDE = 0.25
"""Of the true profile's size, room on either side of it."""
OVER_TOLERANCE = 2.0
Ends = tuple[float, float]


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
    exact = None if truth is None else np.isfinite(truth.distance)
    if truth is None or exact is None or not exact.any():
        across, distance = (_joined([getattr(one, name) for one in measured]) for name in ("across", "distance"))
        here = np.isfinite(distance)
        along, up = (_wider(values[here], BESIDE) if here.any() else None for values in (across, distance))
        return None if along is None or up is None else (along, up)
    index, across, distance = (values[exact] for values in (truth.index, truth.across, truth.distance))
    spread = robust_sigma(_joined([one.distance - np.interp(one.index, index, distance) for one in measured]))
    beside = BESIDE * float(np.ptp(across))
    # a flat part is as high as the spread of its points
    above = max(BESIDE * float(np.ptp(distance)), FAR * spread if np.isfinite(spread) else 0.0)
    return _around(across, beside), _around(distance, above)


def _around(values: Float, room: float) -> Ends:
    return float(values.min()) - room, float(values.max()) + room


def _joined(pieces: list[Float]) -> Float:
    return np.concatenate([np.zeros(0), *pieces])


def _wider(values: Float, share: float) -> Ends | None:
    """From percentile to percentile of finite values, and so much of it more on either side; None: all are alike."""
    low, high = np.percentile(values, ENDS).tolist()
    more = share * (high - low)
    return (low - more, high + more) if high > low else None
