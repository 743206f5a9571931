"""The error of every point against the exact truth: along the scan line, in depth, and normal to the surface.

Both errors in metres have one sign: measured minus true along the ray from the camera, positive is too far.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.distance import signed_distance, triangle_normals
from analysis.line.result import Line
from analysis.measures import Measures, measure, outliers
from analysis.triangulate import Points
from render.base.arrays import Float
from render.base.errors import InputError
from render.base.finite import check_finite
from render.frame import LaserCurve

Index = NDArray[np.intp]

MATCH_SIGMAS = 2.0
"""Sigmas from a line's centre to its 1/e^2 edge: a peak farther off is an outlier, however wide the errors spread."""
END = 5
"""Scan lines beyond the last that the line crosses, and px beside it, within which a peak is of that end's light."""


@dataclass(frozen=True)
class Errors:
    """Measured minus true: (m,) arrays in the order of the `Points`, NaN where there is no truth to compare with."""

    truth: Index
    """Index into the `LaserCurve` of the crossing matched to the point; -1: none on that scan line is left."""
    position: Float
    """Error along the scan line (u on axis "rows"), px."""
    depth: Float
    """Error of `depth_z`, m: positive is too far from the camera."""
    off_surface: Float
    """Distance from the mesh, m: positive is too far from the camera, behind the surface it sees. Also where no truth
    is matched."""
    sigma_off_surface: Float
    """Standard deviation of `off_surface`, m, predicted from sigma_u."""
    systematic_off_surface: Float
    """The same, m, by what the errors of neighbours have in common: calibration, motion, and the sheet's bias."""
    sheet_bias: Float
    """Part of `position`, px, that the sheet's width explains on curved surfaces and at edges, from the truth."""
    normal: Float
    """(m, 3) unit, camera frame: of the facet that is nearest; NaN where there is none."""
    outlier: NDArray[np.bool_]
    """Position wrong by more than 1 px, and by more than 5 robust sigma or half the line's 1/e^2 width."""
    u: Measures
    """Measures of `position`, px."""
    depth_z: Measures
    """Measures of `depth`, m."""
    surface: Measures
    """Measures of `off_surface`, m."""
    truth_rows: int
    """Scan lines on which the camera can see the line."""
    valid_rows: int
    """Scan lines with at least one point."""
    measured_rows: int
    """Scan lines on which a point matches the truth and is no outlier."""
    false_rows: int
    """Scan lines with a point where there is no line to be seen."""
    false_rows_at_ends: int
    """Those of them whose points are all next to an end of the line."""
    depthless_rows: int
    """Scan lines with peaks where there is no line to be seen, none of whose rays gives a point."""

    @property
    def false_alarms(self) -> int:
        """Scan lines on which a position was found although there is no line to be seen, with a point or without."""
        return self.false_rows + self.depthless_rows

    @property
    def completeness(self) -> float:
        """Measured rows over truth rows; NaN when nothing is visible."""
        return self.measured_rows / self.truth_rows if self.truth_rows else float("nan")


def compare(
    points: Points, line: Line, curve: LaserCurve, vertices: Float, triangles: NDArray[np.int32], T_world_camera: Float
) -> Errors:
    """Errors of points against the curve of the same laser and step, and the mesh (v, 3), (t, 3) in the world frame.

    InputError: line and curve are not on the same axis.
    """
    if not line.axis == curve.axis == points.axis:
        raise InputError(
            "the exact line of the frame is not on the scan axis that the line is extracted along",
            where="extraction.axis",
            found=line.axis,
            allowed=f"{curve.axis}, as the frame was rendered",
            cure="extract along that axis, or render the project again",
        )
    along = points.pixel[:, 0 if line.axis == "rows" else 1]
    lit = np.flatnonzero(curve.irradiance > 0.0)  # a laser of 0 W draws no line
    truth = match(points.index, np.where(points.valid, along, np.nan), curve.index[lit], curve.position[lit])
    matched = truth >= 0
    truth[matched] = lit[truth[matched]]
    position, depth, sheet_bias = (np.full(len(along), np.nan) for _ in range(3))
    sheet_bias[matched] = curve.sheet_bias[truth[matched]]
    position[matched] = along[matched] - curve.position[truth[matched]]
    depth[matched] = points.depth_z[matched] - curve.depth_z[truth[matched]]
    before, nearest = signed_distance(points.world, vertices, triangles, T_world_camera[:3, 3])
    off_surface = -before
    check_finite("errors", along_the_line=position[matched], in_depth=depth[matched])
    if len(triangles):
        check_finite("errors", off_the_surface=off_surface[points.valid])

    normals = triangle_normals(vertices, triangles, nearest)
    per_pixel = np.abs(np.einsum("ij,ij->i", points.gradient @ T_world_camera[:3, :3].T, normals))
    step = np.linalg.norm(points.gradient, axis=1)
    normals = normals @ T_world_camera[:3, :3]
    common = systematic_along(points, normals, per_pixel * sheet_bias)
    where = points.index, points.rank
    edge, depth_of_pixel = MATCH_SIGMAS * line.width[where], np.abs(points.gradient[:, 2])
    wrong = outliers(position, 1.0, edge)
    valid_rows = np.unique(points.index[points.valid])
    truth_rows = np.unique(curve.index[lit])
    elsewhere = ~np.isin(points.index, truth_rows)
    false = elsewhere & points.valid
    index = points.index[false]
    crossings = np.column_stack([curve.index[lit], curve.position[lit]])
    away = index[~_beside_end(np.column_stack([index, along[false]]), crossings)] if len(index) else index
    return Errors(
        truth=truth,
        position=position,
        depth=depth,
        off_surface=off_surface,
        sigma_off_surface=per_pixel * points.sigma_pixel,
        systematic_off_surface=common,
        sheet_bias=sheet_bias,
        normal=normals,
        outlier=wrong,
        u=measure(position, points.sigma_pixel, 1.0, *where, edge),
        depth_z=measure(depth, points.sigma_depth, depth_of_pixel, *where, edge * depth_of_pixel),
        surface=measure(off_surface, per_pixel * points.sigma_pixel, step, *where, edge * step),
        truth_rows=len(truth_rows),
        valid_rows=len(valid_rows),
        measured_rows=len(np.unique(points.index[matched & ~wrong])),
        false_rows=len(np.unique(index)),
        false_rows_at_ends=len(np.setdiff1d(index, away)),
        depthless_rows=len(np.setdiff1d(points.index[elsewhere], index)),
    )


def _beside_end(peaks: Float, crossings: Float) -> NDArray[np.bool_]:
    """(m,) of (m, 2) peaks on scan lines without the line: a true crossing (n, 2) is near; both as scan line and px."""
    from scipy.spatial import cKDTree  # takes a while: not before something is false

    return np.asarray(cKDTree(crossings).query(peaks, p=np.inf)[0] <= END)


def systematic_along(points: Points, direction: Float, sheet: Float) -> Float:
    """(m,) m, standard deviation along (m, 3) unit directions of the camera frame by calibration and motion.

    sheet: (m,) m, the bias of the sheet's own width along them, taken as one standard deviation; NaN where unknown.
    """
    variance = np.nan_to_num(sheet) ** 2
    for part in (points.calibration, points.motion):
        if part is not None:
            variance = variance + (np.einsum("mik,mi->mk", part, direction) ** 2).sum(axis=1)
    return np.asarray(np.sqrt(variance))


def match(index: Index, position: Float, true_index: NDArray[np.int32], true_position: Float) -> Index:
    """One-to-one pairs on each scan line, nearest first: (m,) peaks -> (m,) index into the (n,) true crossings, or -1.

    A peak whose `position` is NaN is not matched. `true_index` ascends.
    """
    found = np.full(len(index), -1, dtype=np.intp)
    start = np.searchsorted(true_index, index, side="left")
    count = np.searchsorted(true_index, index, side="right") - start
    count = np.where(np.isfinite(position), count, 0)
    # all pairs of peak and crossing that share a scan line, nearest first
    peak = np.repeat(np.arange(len(index)), count)
    crossing = np.repeat(start - (np.cumsum(count) - count), count) + np.arange(len(peak))
    order = np.argsort(np.abs(position[peak] - true_position[crossing]), kind="stable")
    taken = np.zeros(len(true_index), dtype=np.bool_)
    for p, c in zip(peak[order].tolist(), crossing[order].tolist(), strict=True):
        if found[p] < 0 and not taken[c]:
            found[p], taken[c] = c, True
    return found
