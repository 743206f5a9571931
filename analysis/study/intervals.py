"""A number from repeated runs with the interval that it is known to."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from render.base.arrays import Float

LEVEL = 0.95


@dataclass(frozen=True)
class Interval:
    """A mean over `count` repeats; `low` and `high` bound its 95 % interval, NaN with fewer than two repeats."""

    mean: float
    low: float
    high: float
    count: int


NOTHING = Interval(float("nan"), float("nan"), float("nan"), 0)


def mean_interval(values: Float) -> Interval:
    """(n,) repeats -> mean with Student's t interval; values that are not finite are left out.

    Source: Student (1908), Biometrika 6, 1; exact for normal repeats.
    """
    found = np.asarray(values, dtype=np.float64)
    found = found[np.isfinite(found)]
    if len(found) == 0:
        return NOTHING
    mean = float(found.mean())
    if len(found) == 1:
        return Interval(mean, float("nan"), float("nan"), 1)
    half = student(len(found) - 1) * float(found.std(ddof=1) / np.sqrt(len(found)))
    return Interval(mean, mean - half, mean + half, len(found))


def positive_interval(values: Float) -> Interval:
    """(n,) repeats of what is never negative -> mean with the interval of its logarithm, by Student's t and the delta
    method: its half width, in the logarithm, is that of `mean_interval` over the mean.

    It ends above 0, and where a few repeats lie far above the others it holds the mean more often than `mean_interval`.
    """
    found = mean_interval(values)
    if not found.mean > 0.0:
        return found
    factor = np.exp((found.high - found.mean) / found.mean)
    return Interval(found.mean, float(found.mean / factor), float(found.mean * factor), found.count)


@lru_cache(maxsize=4096)
def student(freedom: int) -> float:
    """Half the width of a 95 % interval in standard errors, by degrees of freedom."""
    from scipy.stats import t

    return float(t.ppf(0.5 + LEVEL / 2.0, freedom))
