"""Triangulation: a pixel's ray meets the laser plane in a point, with its error to first order.

    q = (x, y, 1) the undistorted pixel,  z = -d / (n . q),  P = z q,  dP/dx = z e_x - P n_x / (n . q)

The random error (of the line's position) and the systematic one (of the calibration, common to all points) stay apart.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numba
import numpy as np
from numpy.typing import NDArray

from analysis.calibration.lens import distort as distort_array
from analysis.line.result import Axis, Line
from render.base.arrays import Float
from render.base.errors import InputError
from render.base.finite import check_finite
from render.base.pose import transform_points
from render.camera.camera import Camera
from render.camera.distortion import distort, tilt_matrix

Mask = NDArray[np.bool_]

CALIBRATION = ("fx", "fy", "cx", "cy", "a", "b", "c", "d")
"""Parameters of a calibration covariance, in this order; (a, b, c, d) is the laser plane.

The camera's distortion coefficients may follow.
"""
SMALLEST_BASELINE = 1e-6
"""A plane nearer than 1 um to the camera's centre: every ray meets it there, so that nothing is measured."""


class PointFlag(IntEnum):
    """Why a point is as it is; only OK has coordinates."""

    OK = 0
    NO_RAY = 1
    """The distortion has no inverse at this pixel."""
    NEAR_PARALLEL = 2
    """The ray runs along the laser plane."""
    BEHIND = 3
    """The ray meets the laser plane behind the camera."""


@dataclass(frozen=True)
class Points:
    """One entry for each peak that has a position, (m,) unless said; NaN where `flag` gives a reason.

    `index` is the scan line and `rank` the peak's rank in the `Line` they came from. Lengths in m.
    """

    axis: Axis
    pixel: Float
    """(m, 2) u, v."""
    index: NDArray[np.intp]
    rank: NDArray[np.intp]
    camera: Float
    """(m, 3) camera frame."""
    rig: Float
    """(m, 3) rig frame."""
    world: Float
    """(m, 3) world frame."""
    gradient: Float
    """(m, 3) dP/du (dP/dv on axis "columns"), m/px, camera frame."""
    sigma_pixel: Float
    """Random standard deviation of the position along the scan line, px."""
    correlation_length: Float
    """Scan lines that err alike, as in `Line`; 1 where that is not known."""
    calibration: Float | None
    """(m, 3, k) m, camera frame: how each of k independent errors of the calibration, all of variance 1, moves the
    point; None: the calibration is taken as exact."""
    flag: NDArray[np.uint8]
    motion: Float | None = None
    """(m, 3, k) m, camera frame: the same of the motion by which points of several steps are put together."""

    @property
    def valid(self) -> Mask:
        """(m,): has coordinates."""
        return self.flag == PointFlag.OK

    @property
    def depth_z(self) -> Float:
        """(m,) m along the camera's axis."""
        return self.camera[:, 2]

    @property
    def sigma(self) -> Float:
        """(m,) m, random standard deviation of the point along the laser plane: |dP/du| sigma_u."""
        return np.asarray(np.linalg.norm(self.gradient, axis=1) * self.sigma_pixel)

    @property
    def covariance_systematic(self) -> Float | None:
        """(m, 3, 3) m^2, camera frame, from the calibration; None: it is taken as exact."""
        return None if self.calibration is None else self.calibration @ self.calibration.transpose(0, 2, 1)

    @property
    def sigma_systematic(self) -> Float:
        """(m,) m, root of the summed variances that calibration and motion give the point; 0 where they are exact."""
        parts = (part for part in (self.calibration, self.motion) if part is not None)
        return np.sqrt(sum(((part**2).sum(axis=(1, 2)) for part in parts), start=np.zeros(len(self.flag))))

    @property
    def sigma_depth(self) -> Float:
        """(m,) m, random standard deviation of `depth_z`."""
        return np.asarray(np.abs(self.gradient[:, 2]) * self.sigma_pixel)

    @property
    def sigma_depth_systematic(self) -> Float:
        """(m,) m, standard deviation of `depth_z` by the calibration; 0 where it is taken as exact."""
        if self.calibration is None:
            return np.zeros(len(self.flag))
        return np.asarray(np.linalg.norm(self.calibration[:, 2], axis=1))

    @property
    def covariance(self) -> Float:
        """(m, 3, 3) m^2, camera frame, random part. Of rank one: the scan line's own coordinate is exact."""
        error = self.gradient * self.sigma_pixel[:, None]
        return error[:, :, None] * error[:, None, :]


def triangulate(
    line: Line,
    camera: Camera,
    plane: Float,
    *,
    T_rig_camera: Float,
    T_world_camera: Float,
    calibration_covariance: Float | None = None,
) -> Points:
    """Points of a line's valid peaks.

    plane (4,) laser plane (a, b, c, d) in the camera frame, of any scale; T_rig_camera, T_world_camera (4, 4);
    calibration_covariance (8, 8) of `CALIBRATION` (px, m), with the distortion's (8 + terms, 8 + terms), or None.

    InputError: the plane is not finite, has no normal, or passes through the camera's centre; a point is not finite.
    """
    normal, offset = _unit_plane(plane)
    pixel, index, rank = line.pixels()
    normalised, has_ray = camera.normalise(pixel)
    q = np.concatenate([normalised, np.ones((len(pixel), 1))], axis=1)
    facing = q @ normal
    # Within one pixel of the plane's vanishing line, one pixel of error moves the point by its own distance or more:
    # first-order errors, and the point, mean nothing there.
    parallel = np.abs(facing) < np.linalg.norm(q, axis=1) / min(camera.fx, camera.fy)
    flag = np.full(len(pixel), PointFlag.OK, dtype=np.uint8)
    flag[-offset * facing < 0.0] = PointFlag.BEHIND
    flag[parallel] = PointFlag.NEAR_PARALLEL
    flag[~has_ray] = PointFlag.NO_RAY
    usable = flag == PointFlag.OK

    facing = np.where(usable, facing, np.nan)
    point = (-offset / facing)[:, None] * q
    dq = _pixel_jacobians(camera, normalised, usable)
    # dP/dq = z I - P n^T / (n . q); the third component of q is fixed, so two columns remain
    dpoint_dq = point[:, 2, None, None] * np.eye(3)[:, :2] - point[:, :, None] * (normal[:2] / facing[:, None])[:, None]
    dpoint = dpoint_dq @ dq
    check_finite("points", coordinates=point[usable], changes_by_a_pixel=dpoint[usable])
    return Points(
        axis=line.axis,
        pixel=pixel,
        index=index,
        rank=rank,
        camera=point,
        rig=transform_points(T_rig_camera, point),
        world=transform_points(T_world_camera, point),
        gradient=np.ascontiguousarray(dpoint[:, :, 0 if line.axis == "rows" else 1]),
        sigma_pixel=line.sigma_u[index, rank],
        correlation_length=np.ones(len(pixel))
        if line.correlation_length is None
        else line.correlation_length[index, rank],
        calibration=None
        if calibration_covariance is None
        else _systematic(camera, pixel, q, point, facing, dpoint, calibration_covariance),
        flag=flag,
    )


def calibration_jacobian(camera: Camera, pixel: Float, q: Float, point: Float, facing: Float, dpoint: Float) -> Float:
    """(m, 3, 8 + terms) dP/d(CALIBRATION, distortion).

    pixel (m, 2), q, point (m, 3), facing n . q (m,), dpoint dP/d(u, v) (m, 3, 2).
    """
    y = (pixel[:, 1] - camera.cy) / camera.fy
    x = (pixel[:, 0] - camera.cx - camera.skew * y) / camera.fx
    jacobian = np.empty((len(pixel), 3, len(CALIBRATION) + len(camera.distortion)))
    # a parameter that shifts the model's pixel by s acts like a pixel measured s lower
    jacobian[:, :, 0], jacobian[:, :, 1] = -dpoint[:, :, 0] * x[:, None], -dpoint[:, :, 1] * y[:, None]
    jacobian[:, :, 2], jacobian[:, :, 3] = -dpoint[:, :, 0], -dpoint[:, :, 1]
    jacobian[:, :, 4:7] = -point[:, :, None] * (q / facing[:, None])[:, None, :]
    jacobian[:, :, 7] = -q / facing[:, None]
    if camera.distortion:
        known = np.where(np.isnan(q[:, :2]), 0.0, q[:, :2])
        _, _, by_coefficient = distort_array(known, np.array(camera.distortion))
        forward = np.array([[camera.fx, camera.skew], [0.0, camera.fy]])
        jacobian[:, :, 8:] = -dpoint @ (forward @ by_coefficient)
    return jacobian


def _systematic(
    camera: Camera, pixel: Float, q: Float, point: Float, facing: Float, dpoint: Float, covariance: Float
) -> Float:
    covariance = np.asarray(covariance, dtype=np.float64)
    size, whole = len(CALIBRATION), len(CALIBRATION) + len(camera.distortion)
    if covariance.shape not in ((size, size), (whole, whole)):
        raise ValueError(f"calibration_covariance has shape {covariance.shape}; allowed: ({size}, {size})")
    jacobian = calibration_jacobian(camera, pixel, q, point, facing, dpoint)[:, :, : len(covariance)]
    # by way of the correlations, as the variances are of px^2, m^2 and 1
    scale = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    divisor = np.where(scale > 0.0, scale, 1.0)
    variance, mode = np.linalg.eigh(covariance / divisor[:, None] / divisor)
    return np.asarray((jacobian * scale) @ (mode * np.sqrt(np.maximum(variance, 0.0))))


def _unit_plane(plane: Float) -> tuple[Float, float]:
    plane = np.asarray(plane, dtype=np.float64)
    length = float(np.linalg.norm(plane[:3]))
    if plane.shape != (4,) or not np.all(np.isfinite(plane)) or length == 0.0:
        raise InputError(
            "the laser plane is not a plane", found=plane.tolist(), allowed="(a, b, c, d), finite, a normal"
        )
    if abs(plane[3]) < SMALLEST_BASELINE * length:
        raise InputError(
            "the laser plane passes through the camera's centre, so that depth cannot be measured",
            found=f"{abs(plane[3]) / length * 1e6:.3g} um away",
            allowed="at least 1 um",
            cure="move the laser off the camera's centre, or turn its sheet",
        )
    return plane[:3] / length, float(plane[3]) / length


@numba.njit(nogil=True, cache=True)
def _distortion_jacobians(points: Float, k: Float) -> Float:
    """(n, 2) normalised -> (n, 2, 2) d(distorted) / d(normalised)."""
    out = np.empty((points.shape[0], 2, 2))
    tilt = tilt_matrix(k[12], k[13])
    for i in range(points.shape[0]):
        _, _, out[i, 0, 0], out[i, 0, 1], out[i, 1, 0], out[i, 1, 1] = distort(points[i, 0], points[i, 1], k, tilt)
    return out


def _pixel_jacobians(camera: Camera, normalised: Float, usable: Mask) -> Float:
    """(m, 2) normalised -> (m, 2, 2) d(normalised) / d(u, v), NaN where not usable."""
    out = np.full((len(normalised), 2, 2), np.nan)
    forward = np.array([[camera.fx, camera.skew], [0.0, camera.fy]])
    if camera.has_distortion:
        distortion = _distortion_jacobians(np.ascontiguousarray(normalised[usable]), camera.coefficients)
        out[usable] = np.linalg.inv(forward @ distortion)
    else:
        out[usable] = np.linalg.inv(forward)
    return out
