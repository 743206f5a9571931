"""Statistics that add up exactly over the frames of a scan: counts, and moments of the errors."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from analysis.report.frame_result import Extraction
from render.base.arrays import Float


@dataclass
class Moments:
    """Running moments of errors, and their coverage by the predicted sigma; NaN is ignored."""

    count: int = 0
    mean: float = 0.0
    squares: float = 0.0
    """Sum of squared deviations from the mean."""
    predicted: int = 0
    """Number of errors with a predicted sigma."""
    covered: int = 0
    """Number of errors within +-2 predicted sigma."""

    def add(self, error: Float, sigma: Float) -> None:
        here = np.isfinite(error)
        e, s = error[here], sigma[here]
        known = np.isfinite(s)
        mean = float(np.mean(e)) if len(e) else 0.0
        covered = int(np.count_nonzero(np.abs(e[known]) <= 2.0 * s[known]))
        self.merge(Moments(len(e), mean, float(np.sum((e - mean) ** 2)), int(np.count_nonzero(known)), covered))

    def merge(self, other: Moments) -> None:
        """Add other moments without cancellation (Chan, Golub, LeVeque 1983, American Statistician 37(3), eq. 2.1)."""
        count = self.count + other.count
        if other.count:
            apart = other.mean - self.mean
            self.squares += other.squares + apart**2 * self.count * other.count / count
            self.mean += apart * other.count / count
        self.count = count
        self.predicted += other.predicted
        self.covered += other.covered


@dataclass
class Sums:
    """Sums of one method's lines over frames and lasers."""

    method: str = ""
    """Name of the method, as the first line has it."""
    points: int = 0
    outliers: int = 0
    truth_rows: int = 0
    valid_rows: int = 0
    measured_rows: int = 0
    false_rows: int = 0
    false_rows_at_ends: int = 0
    depthless_rows: int = 0
    position: Moments = field(default_factory=Moments)
    depth: Moments = field(default_factory=Moments)
    off_surface: Moments = field(default_factory=Moments)

    def add(self, extraction: Extraction) -> None:
        points, errors = extraction.points, extraction.errors
        self.method = self.method or extraction.line.method
        self.points += int(np.count_nonzero(points.valid))
        self.outliers += int(np.count_nonzero(errors.outlier))
        self.truth_rows += errors.truth_rows
        self.valid_rows += errors.valid_rows
        self.measured_rows += errors.measured_rows
        self.false_rows += errors.false_rows
        self.false_rows_at_ends += errors.false_rows_at_ends
        self.depthless_rows += errors.depthless_rows
        self.position.add(errors.position, points.sigma_pixel)
        self.depth.add(errors.depth, points.sigma_depth)
        self.off_surface.add(errors.off_surface, errors.sigma_off_surface)

    def merge(self, other: Sums) -> None:
        self.method = self.method or other.method
        self.points += other.points
        self.outliers += other.outliers
        self.truth_rows += other.truth_rows
        self.valid_rows += other.valid_rows
        self.measured_rows += other.measured_rows
        self.false_rows += other.false_rows
        self.false_rows_at_ends += other.false_rows_at_ends
        self.depthless_rows += other.depthless_rows
        self.position.merge(other.position)
        self.depth.merge(other.depth)
        self.off_surface.merge(other.off_surface)
