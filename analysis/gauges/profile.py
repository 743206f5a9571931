"""The profile in a section of the part, and the covariance of whatever is worked out from it."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.error import Errors
from analysis.gauges.true_end import TrueSection
from analysis.triangulate import Points
from render.base.arrays import Float
from render.base.pose import transform_points
from render.frame import LaserCurve

SOFT_END = 0.1
"""Of a region's length, at each of its ends, over which points come to count in full."""
NEARLY_ONE = 1.0 - 1e-9
ANY_SIGMA = 1e-6
"""m, of a truth without measured points beside it: all its points weigh alike."""


@dataclass(frozen=True)
class Section:
    """Which section of the part a profile is of."""

    name: str = ""
    """In words; empty: it is not said."""
    others: tuple[tuple[str, Float], ...] = ()
    """Those that may be chosen in its place: name, and (3,) unit normal in this section's frame."""


@dataclass(frozen=True)
class Profile:
    """(m,) points in the order of their scan lines; all lengths in m.

    A point errs by `random` times a number of variance 1, which falls off along the scan lines as an autoregressive
    sequence of first order does, and by `systematic` times k independent numbers that all points share.
    """

    position: Float
    """(m, 2): across the fan, and height, towards the laser, of which the laser is the zero."""
    random: Float
    """(m, 2): the point's displacement by one random sigma of the line in the image."""
    systematic: Float
    """(m, 2, k): by one sigma of each thing that is common to all points."""
    index: NDArray[np.intp]
    """(m,) scan line."""
    correlation_length: Float
    """(m,) scan lines that err alike, as of `Points`."""
    place: Float | None = None
    """(m, 3) in the section's frame: off it, across the fan, and away from the laser."""
    normal: Float | None = None
    """(m, 3) unit, in the section's frame: of the true surface there, NaN where it is unknown; None: everywhere."""
    section: Section = Section()
    strength: Float | None = None
    """(m,) electrons at the line's peak; None: a point is of its scan line's middle alone, as on the exact line."""
    true_section: TrueSection | None = None
    """Of the part, by which edges of the exact line are known; None: these are points, which do not tell of it."""
    ground: NDArray[np.bool_] | None = None
    """(m,) points on the plane that parts stand on; None: it is not known."""
    fitted: dict[Any, Any] = field(default_factory=dict, repr=False, compare=False)
    """The curves that were fitted to it so far, for whoever reads and then draws them; by kind and regions."""

    def weight(self, low: float, high: float) -> Float:
        """(m,) weights of the points across the fan between two places, m: 0 outside and at the ends, 1 in the middle.

        With hard ends, noise would decide whether a point on an end counts, and those that it moves in would err alike.
        """
        inside = np.minimum(self.position[:, 0] - low, high - self.position[:, 0])
        return np.asarray(np.clip(inside / (SOFT_END * (high - low)), 0.0, 1.0))

    def taken(self, here: NDArray[np.bool_]) -> Profile:
        """The part of it at (m,) points."""
        return Profile(
            self.position[here],
            self.random[here],
            self.systematic[here],
            self.index[here],
            self.correlation_length[here],
            None if self.place is None else self.place[here],
            None if self.normal is None else self.normal[here],
            self.section,
            None if self.strength is None else self.strength[here],
            self.true_section,
        )

    def whitening(self) -> tuple[Float, Float]:
        """(m,) diagonal and (m,) subdiagonal of the W for which W C W^T = 1, C the correlation of the random errors.

        Lengths L give the correlation r of neighbours by L = (1 + r) / (1 - r), as in `analysis.measures.shared_rows`.
        """
        r = np.clip((self.correlation_length - 1.0) / (self.correlation_length + 1.0), 0.0, NEARLY_ONE)
        gap = np.diff(self.index)
        # of two peaks on one scan line each has its own noise
        rho = np.where(gap > 0, np.sqrt(r[1:] * r[:-1]) ** np.maximum(gap, 1), 0.0)
        diagonal, below = np.ones(len(r)), np.zeros(len(r))
        diagonal[1:] = 1.0 / np.sqrt(1.0 - rho**2)
        below[1:] = -rho * diagonal[1:]
        return diagonal, below

    def sigmas(self, gradient: Float) -> tuple[float, float]:
        """Random and systematic sigma of a quantity whose derivative by the points' positions is (m, 2)."""
        random = float(np.linalg.norm(self.spread(gradient[None])))
        systematic = float(np.linalg.norm(np.einsum("ij,ijk->k", gradient, self.systematic)))
        return random, systematic

    def spread(self, gradients: Float) -> Float:
        """(m, c): S of which S^T S is the random covariance of c quantities, from their derivatives (c, m, 2)."""
        from scipy.linalg import solve_banded  # slow to load

        diagonal, below = self.whitening()
        amplitude = np.einsum("cij,ij->ic", gradients, self.random)
        banded = np.stack([np.append(0.0, below[1:]), diagonal])
        return np.asarray(solve_banded((0, 1), banded, amplitude))


def measured_profile(
    points: Points,
    errors: Errors | None,
    T_section_camera: Float,
    section: Section = Section(),
    strength: Float | None = None,
) -> Profile:
    """Profile of the points that have coordinates and a sigma, in the y and z of a section: a laser's plane or another.

    strength: of each of the points, as of `Profile`.

    With `errors`, what the sheet's own width moves the line by, known from the truth, counts as one systematic error.
    """
    here = points.valid & np.isfinite(points.sigma_pixel) & (points.sigma_pixel > 0.0)
    order = np.flatnonzero(here)[np.argsort(points.index[here], kind="stable")]
    to_section = np.stack([T_section_camera[1, :3], -T_section_camera[2, :3]])
    by_pixel = points.gradient[order] @ to_section.T
    normal = None
    shared = [] if points.calibration is None else [np.einsum("ij,mjk->mik", to_section, points.calibration[order])]
    if errors is not None:
        shared.append((by_pixel * np.nan_to_num(errors.sheet_bias[order])[:, None])[:, :, None])
        # of a false point it is that of whatever face is nearest
        unknown = errors.outlier[order] | (errors.truth[order] < 0)
        normal = np.where(unknown[:, None], np.nan, errors.normal[order]) @ T_section_camera[:3, :3].T
    place = transform_points(T_section_camera, points.camera[order])
    return Profile(
        position=np.stack([place[:, 1], -place[:, 2]], axis=1),
        random=by_pixel * points.sigma_pixel[order, None],
        systematic=np.concatenate([np.zeros((len(order), 2, 0)), *shared], axis=2),
        index=points.index[order],
        correlation_length=np.nan_to_num(points.correlation_length[order], nan=1.0),
        place=place,
        normal=normal,
        section=section,
        strength=None if strength is None else strength[order],
    )


def true_profile(
    curve: LaserCurve,
    T_section_camera: Float,
    measured: Profile,
    part: TrueSection | None = None,
    ground: Collection[int] = (),
) -> Profile:
    """The exact line, where it is lit; its points weigh as the measured ones beside them.

    part: in the same section; without it no edge has a true end. ground: objects that parts stand on, as of the
    curve's `object_id`.
    """
    lit = curve.irradiance > 0.0
    position = _in_section(T_section_camera, curve.point[lit])
    order = np.argsort(measured.position[:, 0], kind="stable")
    weight = np.tile([0.0, ANY_SIGMA], (len(position), 1))
    if len(order):
        across = measured.position[order, 0]
        weight = np.stack([np.interp(position[:, 0], across, measured.random[order, k]) for k in (0, 1)], axis=1)
    index, on_ground = np.asarray(curve.index[lit], dtype=np.intp), np.isin(curve.object_id[lit], list(ground))
    systematic, alone, true = np.zeros((len(position), 2, 0)), np.ones(len(position)), part or TrueSection()
    return Profile(position, weight, systematic, index, alone, true_section=true, ground=on_ground)


def _in_section(T_section_camera: Float, camera: Float) -> Float:
    there = transform_points(T_section_camera, camera)
    return np.stack([there[:, 1], -there[:, 2]], axis=1)
