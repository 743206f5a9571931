"""Measures of a set of errors: bias, spread, outliers, and whether the predicted sigma tells the truth."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.line.result import overlap
from render.base.arrays import Float

Mask = NDArray[np.bool_]

MAD_TO_SIGMA = 1.4826
"""Standard deviation of a normal distribution over its median absolute deviation."""
MAD_EFFICIENCY = 0.3675
"""Of the median absolute deviation of normal errors, against their standard deviation (Rousseeuw and Croux, J. Am.
Stat. Assoc. 88, 1993)."""
FEWEST = 4
"""Points whose errors have a spread worth telling."""


@dataclass(frozen=True)
class Measures:
    """In the unit of the errors; NaN where there is nothing to measure. Rates are fractions, 0 to 1."""

    count: int
    bias: float
    """Mean error."""
    median: float
    sigma: float
    """Standard deviation about the mean."""
    rmse: float
    """Root of the mean squared error: bias and sigma together."""
    robust_sigma: float
    """1.4826 times the median absolute deviation: sigma as it would be without outliers."""
    p95: float
    """95 % of the errors are smaller in size."""
    outlier_rate: float
    """Errors larger than `floor`, and than 5 robust sigma or `ceiling`."""
    autocorrelation: float
    """Between neighbouring scan lines, outliers left out and others counted to 3 robust sigma at most: near 0 for
    independent rows, towards 1 after smoothing."""
    coverage: float
    """Within +-2 predicted sigma; 0.954 when the prediction is honest and the errors are normal."""


CLIPPED = 3.0
"""Robust sigmas from the median to which errors count in their correlation."""
EMPTY = Measures(0, *[float("nan")] * 9)


DOMINATED = 3.0
"""RMSE over what most points err by from which a few rule it: without any it is near 1, on textured parts near 2."""


def ruled(rmse: float, median: float, robust_sigma: float) -> bool:
    """The RMSE is far beyond what most points err by, all alike and each on its own: a few make it."""
    return bool(rmse > DOMINATED * np.hypot(median, robust_sigma))


def outliers(error: Float, floor: Float | float, ceiling: Float | float = np.inf) -> Mask:
    """(m,) errors -> (m,) larger than both `floor` (the error of one pixel) and 5 robust sigma. NaN is no outlier.

    ceiling: larger ones are outliers in any case, as robust sigma means nothing where most errors are; NaN for none.
    """
    if not np.any(np.isfinite(error)):
        return np.zeros(len(error), dtype=np.bool_)
    return np.asarray(np.abs(error) > np.maximum(floor, np.fmin(5.0 * robust_sigma(error), ceiling)))


def robust_sigma(error: Float) -> float:
    """1.4826 MAD of the finite errors."""
    finite = error[np.isfinite(error)]
    return float(MAD_TO_SIGMA * np.median(np.abs(finite - np.median(finite)))) if len(finite) else float("nan")


def measure(
    error: Float,
    sigma: Float,
    floor: Float | float,
    index: NDArray[np.intp],
    rank: NDArray[np.intp],
    ceiling: Float | float = np.inf,
) -> Measures:
    """Measures of (m,) errors, NaN left out.

    sigma (m,) predicted standard deviation, NaN where there is none; floor, ceiling: those of `outliers`, numbers or
    (m,); index, rank (m,) scan line and peak of each error, for the autocorrelation.
    """
    here = np.isfinite(error)
    if not np.any(here):
        return EMPTY
    e = error[here]
    out = outliers(error, floor, ceiling)[here]
    predicted = sigma[here]
    has_sigma = np.isfinite(predicted)
    covered = np.abs(e[has_sigma]) <= 2.0 * predicted[has_sigma]
    return Measures(
        count=len(e),
        bias=float(np.mean(e)),
        median=float(np.median(e)),
        sigma=float(np.std(e)),
        rmse=float(np.sqrt(np.mean(e**2))),
        robust_sigma=robust_sigma(e),
        p95=float(np.percentile(np.abs(e), 95)),
        outlier_rate=float(np.mean(out)),
        autocorrelation=_autocorrelation(_clipped(e[~out]), index[here][~out], rank[here][~out]),
        coverage=float(np.mean(covered)) if len(covered) else float("nan"),
    )


def shared_rows(length: Float, count: int) -> Float:
    """How many of `count` neighbouring scan lines err as one: the variance of their mean is sigma^2 that / count.

    length: of correlation, scan lines, of errors whose correlation falls by one factor r from line to line, so that it
    is (1 + r) / (1 - r); among few it is less, by those beyond the ends (Bartlett, J. R. Stat. Soc. B 8, 1946).
    """
    r = np.clip((length - 1.0) / (length + 1.0), 0.0, 1.0 - 1e-9)
    return np.asarray(length - 2.0 * r * (1.0 - r**count) / (count * (1.0 - r) ** 2))


def error_statistics(error: Float, index: NDArray[np.intp], length: float) -> tuple[tuple[float, float], ...]:
    """Mean, RMSE and robust sigma of (n,) errors on scan lines `index`, n >= 4, each with its sigma.

    Neighbours err alike over `length` scan lines, or over more where the errors themselves say so: with a correlation
    that falls by r from line to line the mean is of n (1 - r) / (1 + r) independent ones, the mean square, whose
    correlation falls by r^2, of n (1 - r^2) / (1 + r^2) (Bartlett, J. R. Stat. Soc. B 8, 1946).
    """
    count, nobody = len(error), np.full(len(error), np.nan)
    strongest = np.zeros(count, dtype=np.intp)
    found = measure(error, nobody, np.inf, index, strongest)
    # of all the error that the spread below holds, of edges as well
    whole = _autocorrelation(error, index, strongest)
    r = max((length - 1.0) / (length + 1.0), whole if math.isfinite(whole) else 0.0)
    r = min(max(r, 0.0), 1.0 - 1e-9)
    of_mean = float(shared_rows(np.array((1.0 + r) / (1.0 - r)), count)) / count
    of_square = float(shared_rows(np.array((1.0 + r**2) / (1.0 - r**2)), count)) / count
    spread = found.sigma * math.sqrt(count / (count - 1))
    sigma_rmse = float(np.std(error**2)) * math.sqrt(of_square) / (2.0 * found.rmse) if found.rmse > 0.0 else 0.0
    sigma_robust = found.robust_sigma * math.sqrt(of_square / (2.0 * MAD_EFFICIENCY))
    return (
        (found.bias, spread * math.sqrt(of_mean)),
        (found.rmse, sigma_rmse),
        (found.robust_sigma, sigma_robust),
    )


def median_length(length: Float) -> float:
    """Of (n,) lengths of correlation, scan lines; 1 where none is known."""
    known = length[np.isfinite(length)]
    return float(np.median(known)) if len(known) else 1.0


def means(
    error: Float,
    sigma: Float,
    length: Float,
    shared: Float,
    lasting: Mask,
    index: NDArray[np.intp],
    rank: NDArray[np.intp],
    count: int,
) -> tuple[Float, Float]:
    """Means of (m,) errors over `count` neighbouring scan lines, and their predicted sigma.

    From sigma, `Line.length_apart` and what lines share, as `Line.shared_u` in the unit of the error (m,); lasting:
    which share it by what is there, as far as that goes, and not by the width of neighbours (m,).

    Of the strongest peaks, and of runs without a gap; index, rank: as in `measure`.
    """
    order = np.lexsort((rank, index))
    lines, first = np.unique(index[order], return_index=True)
    at = order[first]
    e, common = error[at], np.nan_to_num(shared[at])
    variance = np.maximum(sigma[at] ** 2 - common**2, 0.0) * shared_rows(length[at], count) / count
    begins = np.flatnonzero(lines % count == 0)
    begins = begins[begins + count <= len(lines)]
    begins = begins[lines[begins + count - 1] - lines[begins] == count - 1]
    runs = begins[:, None] + np.arange(count)
    alike = overlap(np.arange(count)[:, None] - np.arange(count))
    last = np.where(lasting[at], common, 0.0)[runs]
    together = np.sum((common[runs] @ alike) * common[runs] + (last @ (1.0 - alike)) * last, axis=1) / count**2
    return np.asarray(e[runs].mean(axis=1)), np.asarray(np.sqrt(variance[runs].mean(axis=1) + together))


def _clipped(error: Float) -> Float:
    """Two neighbours at an edge err alike and may be a hundred times the usual error: they do not speak for all."""
    reach = CLIPPED * robust_sigma(error)
    return np.clip(error, np.median(error) - reach, np.median(error) + reach) if reach > 0.0 else error


def _autocorrelation(error: Float, index: NDArray[np.intp], rank: NDArray[np.intp]) -> float:
    """Correlation of errors on scan lines i and i + 1, the strongest peak of each."""
    order = np.lexsort((rank, index))
    lines, first = np.unique(index[order], return_index=True)
    e = error[order][first]
    adjacent = np.flatnonzero(np.diff(lines) == 1)
    if len(adjacent) < 3:
        return float("nan")
    e = e - np.mean(e)
    variance = float(np.mean(e**2))
    return float(np.mean(e[adjacent] * e[adjacent + 1]) / variance) if variance > 0.0 else float("nan")
