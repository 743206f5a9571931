"""What was seen: corners of a flat board and laser points on it, view by view, each with its covariance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.line.result import Axis
from render.base.arrays import Float

Index = NDArray[np.intp]


@dataclass(frozen=True)
class Stripe:
    """A laser's line on the board in one view: m points, whose coordinate along the scan line was measured."""

    laser: int
    pixel: Float
    """(m, 2) u, v."""
    sigma: Float
    """(m,) px, along the scan line."""
    axis: Axis = "rows"


@dataclass(frozen=True)
class View:
    """One pose of the board: n corners with their places on it, and the lines of any lasers."""

    name: str
    pixel: Float
    """(n, 2) u, v."""
    covariance: Float
    """(n, 2, 2) px^2."""
    target: Float
    """(n, 2) m, on the board."""
    stripes: tuple[Stripe, ...] = ()


@dataclass(frozen=True)
class Observations:
    """All views as arrays, sorted by view: n corners and m laser points of `count` views."""

    names: tuple[str, ...]
    lasers: int
    view: Index
    """(n,) view of each corner."""
    pixel: Float
    """(n, 2) px."""
    target: Float
    """(n, 2) m."""
    whitening: Float
    """(n, 2, 2) W with W^T W = inverse covariance; zero leaves a corner out."""
    laser_view: Index
    """(m,) view of each laser point."""
    laser: Index
    """(m,) which laser."""
    laser_pixel: Float
    """(m, 2) px."""
    laser_weight: Float
    """(m,) 1 / sigma, 1/px; zero leaves a point out."""
    along: Index
    """(m,) coordinate that was measured: 0 is u (axis "rows"), 1 is v."""
    centre: Float
    """(2,) m, middle of the board's corners."""
    half: Float
    """(2,) m, half of what they span."""

    @property
    def count(self) -> int:
        return len(self.names)

    @property
    def residual_count(self) -> int:
        """Of those that are not left out."""
        return 2 * int(np.count_nonzero(self.whitening[:, 0, 0])) + int(np.count_nonzero(self.laser_weight))

    def scaled(self, corner_sigma: float, laser_sigma: float) -> Observations:
        """The same with the corners' and the laser points' standard deviations so many times as large."""
        return replace(self, whitening=self.whitening / corner_sigma, laser_weight=self.laser_weight / laser_sigma)


def gather(views: Sequence[View], extent: Float | None = None) -> Observations:
    """Views -> arrays. extent (2, 2) m: least and greatest corner of the whole board; without, of what was seen."""
    corners = np.concatenate([view.target for view in views]) if extent is None else extent
    least, greatest = corners.min(axis=0), corners.max(axis=0)
    stripes = [(number, stripe) for number, view in enumerate(views) for stripe in view.stripes]
    # the inverse of the Cholesky factor L of a covariance: (L^-1)^T L^-1 is its inverse
    whitening = np.linalg.inv(np.linalg.cholesky(np.concatenate([view.covariance for view in views])))
    return Observations(
        names=tuple(view.name for view in views),
        lasers=1 + max((stripe.laser for _, stripe in stripes), default=-1),
        view=np.repeat(np.arange(len(views)), [len(view.pixel) for view in views]),
        pixel=np.concatenate([view.pixel for view in views]),
        target=np.concatenate([view.target for view in views]),
        whitening=whitening,
        laser_view=_repeated([number for number, _ in stripes], stripes),
        laser=_repeated([stripe.laser for _, stripe in stripes], stripes),
        laser_pixel=np.concatenate([np.empty((0, 2)), *(stripe.pixel for _, stripe in stripes)]),
        laser_weight=1.0 / np.concatenate([np.empty(0), *(stripe.sigma for _, stripe in stripes)]),
        along=_repeated([0 if stripe.axis == "rows" else 1 for _, stripe in stripes], stripes),
        centre=0.5 * (least + greatest),
        half=np.maximum(0.5 * (greatest - least), 1e-9),
    )


def chosen(views: Sequence[View], keep: Sequence[int]) -> list[View]:
    """Those of some numbers."""
    return [views[number] for number in keep]


def _repeated(values: Sequence[int], stripes: Sequence[tuple[int, Stripe]]) -> Index:
    return np.repeat(np.array(values, dtype=np.intp), [len(stripe.pixel) for _, stripe in stripes])
