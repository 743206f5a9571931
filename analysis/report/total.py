"""Measures over all points of a scan: from exact sums, and from the sample where sums do not suffice (quantiles)."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.error import MATCH_SIGMAS
from analysis.line.result import Flag
from analysis.measures import Measures, measure
from analysis.report.sample import Rows
from analysis.report.sums import Moments, Sums
from render.base.arrays import Float

NARROW_PX = 0.4
"""Sigma of a line, px, below which the pixels undersample it: by method, from 0.28 to 0.35 px down its place is 0.03 px
off by where between two pixels it lies. The one limit that is told before a render, of a study and in a report."""


@dataclass(frozen=True)
class Chosen:
    """Sums and sample of one method's lines, of one laser or of all."""

    sums: Sums
    rows: Rows
    """The points in the sample, in the order of the scan."""
    lines_kept: int
    """Number of scan lines in the sample."""
    lines: int
    """Number of scan lines in the scan."""


@dataclass(frozen=True)
class Total:
    """Errors of one method, over all frames, of one laser or all.

    Of a scan that is longer than its sample, quantiles, outlier rate and autocorrelation are those of the sample; all
    else is exact.
    """

    method: str
    u: Measures
    depth_z: Measures
    surface: Measures
    points: int
    outliers: int
    """Number of outliers, found in each image on its own."""
    truth_rows: int
    valid_rows: int
    measured_rows: int
    false_rows: int
    false_rows_at_ends: int
    """Those of them that are next to an end of the line."""
    depthless_rows: int
    """Without a line and with a peak whose ray gives no point."""
    lines_kept: int
    lines: int
    narrow: float = 0.0
    """Fraction of the points where the line's sigma is below `NARROW_PX`."""
    saturated: float = 0.0
    """Fraction of the points that are saturated."""
    sheet_bias: tuple[float, float] = (0.0, 0.0)
    """RMS and 95th percentile, px, of the bias of the positions by the sheet's width; 0: not known."""
    half_by: int = 0
    """Number of points, those with the largest errors in depth, that make half of the sum of its squares."""
    calibration: float = 0.0
    """m, median standard deviation of `depth_z` by the calibration; 0: it is taken as exact."""

    @property
    def false_alarms(self) -> int:
        """Scan lines on which a position was found although there is no line to be seen, with a point or without."""
        return self.false_rows + self.depthless_rows

    @property
    def completeness(self) -> float:
        """Measured rows over truth rows; NaN when nothing is visible."""
        return self.measured_rows / self.truth_rows if self.truth_rows else float("nan")

    @property
    def sampled(self) -> bool:
        """Whether the sample holds less than the whole scan."""
        return self.lines_kept < self.lines


def total(chosen: Chosen) -> Total:
    """Measures over all points together."""
    sums, rows = chosen.sums, chosen.rows
    whole = chosen.lines_kept == chosen.lines

    def all_of(found: Measures, moments: Moments) -> Measures:
        return found if whole or found.count == 0 else _exact(found, moments)

    return Total(
        method=sums.method,
        u=all_of(position_measures(rows), sums.position),
        depth_z=all_of(depth_measures(rows), sums.depth),
        surface=all_of(surface_measures(rows), sums.off_surface),
        points=sums.points,
        outliers=sums.outliers,
        truth_rows=sums.truth_rows,
        valid_rows=sums.valid_rows,
        measured_rows=sums.measured_rows,
        false_rows=sums.false_rows,
        false_rows_at_ends=sums.false_rows_at_ends,
        depthless_rows=sums.depthless_rows,
        lines_kept=chosen.lines_kept,
        lines=chosen.lines,
        narrow=_share(rows["width"][np.isfinite(rows["width"])] < NARROW_PX),
        saturated=_share(rows["flag"] == Flag.SATURATED),
        sheet_bias=_sheet_bias(rows["sheet_bias"]),
        half_by=round(_half_by(rows["depth"]) * chosen.lines / max(chosen.lines_kept, 1)),
        calibration=_median(rows["sigma_systematic"]),
    )


def _share(there: NDArray[np.bool_]) -> float:
    return float(np.mean(there)) if len(there) else 0.0


def _half_by(errors: Float) -> int:
    squares = np.sort(errors[np.isfinite(errors)] ** 2)[::-1].cumsum()
    return int(np.searchsorted(squares, 0.5 * squares[-1])) + 1 if len(squares) else 0


def _median(values: Float) -> float:
    known = values[np.isfinite(values)]
    return float(np.median(known)) if len(known) else 0.0


def _sheet_bias(values: Float) -> tuple[float, float]:
    known = np.abs(values[np.isfinite(values)])
    return (float(np.sqrt(np.mean(known**2))), float(np.quantile(known, 0.95))) if len(known) else (0.0, 0.0)


def position_measures(rows: Rows) -> Measures:
    """Measures of the error along the scan line, px."""
    return _measures(rows, "position", 1.0)


def depth_measures(rows: Rows) -> Measures:
    """Measures of the error of depth_z, m."""
    return _measures(rows, "depth", rows["pixel_depth"])


def surface_measures(rows: Rows) -> Measures:
    """Measures of the error normal to the surface, m."""
    return _measures(rows, "off_surface", rows["pixel_distance"])


def _measures(rows: Rows, name: str, pixel: Float | float) -> Measures:
    """pixel: the error that one pixel makes."""
    edge = MATCH_SIGMAS * rows["width"] * pixel
    return measure(rows[name], rows[f"sigma_{name}"], pixel, rows["index"], rows["rank"], edge)


def _exact(found: Measures, moments: Moments) -> Measures:
    """The sample's measures, with those replaced that the sums give exactly."""
    variance = moments.squares / moments.count
    return replace(
        found,
        count=moments.count,
        bias=moments.mean,
        sigma=math.sqrt(variance),
        rmse=math.sqrt(variance + moments.mean**2),
        coverage=moments.covered / moments.predicted if moments.predicted else float("nan"),
    )
