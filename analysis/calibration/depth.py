"""What a calibration's errors do to depth, over the working volume: the part of each laser plane that the camera sees.

With q the pixel's ray, z = 1 / (m . q): dz = -z^2 (q . dm + m . dq), and dq by the camera's parameters follows from the
projection, as the pixel stays where it is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from analysis.calibration.estimate import Estimate
from analysis.calibration.lens import normalise, project
from render.base.arrays import Float

ROWS, DEPTHS = 25, 25


@dataclass(frozen=True)
class Volume:
    """Points of a laser plane that the camera sees between two depths: where depth is measured."""

    laser: int
    pixel: Float
    """(n, 2) px."""
    depth: Float
    """(n,) m along the camera's axis."""


def working_volume(estimate: Estimate, laser: int, size: tuple[int, int], nearest: float, farthest: float) -> Volume:
    """A grid of the laser plane, by depth and across; size (width, height) px, depths in m."""
    m = estimate.planes[laser]
    z = np.linspace(nearest, farthest, DEPTHS)
    half = 0.6 * np.max(size) / estimate.intrinsics[0]
    across = np.linspace(-half, half, 2 * ROWS)
    depth, other = (part.ravel() for part in np.meshgrid(z, across))
    # the normal's larger component of x and y is the measuring direction; along the other the line extends
    measured = 0 if abs(m[0]) >= abs(m[1]) else 1
    q = np.empty((len(depth), 2))
    q[:, 1 - measured] = other
    q[:, measured] = (1.0 / depth - m[2] - m[1 - measured] * other) / m[measured]
    pixel, by_q, _ = project(q, estimate.intrinsics, estimate.distortion)
    seen = np.all((pixel >= 0.0) & (pixel <= np.array(size) - 1.0), axis=1) & (np.linalg.det(by_q) > 0.0)
    return Volume(laser, pixel[seen], depth[seen])


def depth_jacobian(estimate: Estimate, volume: Volume, q: Float) -> Float:
    """(n, p) derivative of depth, m, at the volume's pixels by all shared parameters; q (n, 2) their rays."""
    m = estimate.planes[volume.laser]
    _, by_q, by_camera = project(q, estimate.intrinsics, estimate.distortion)
    depth = _depth(estimate, volume, q)
    out = np.zeros((len(q), len(estimate.shared)))
    dq = -np.linalg.solve(by_q, by_camera)
    out[:, : estimate.camera_count] = -(depth**2)[:, None] * np.einsum("i,nij->nj", m[:2], dq)
    out[:, estimate.plane_slice(volume.laser)] = -(depth**2)[:, None] * np.column_stack([q, np.ones(len(q))])
    return out


def depth_off(estimate: Estimate, truth: Estimate, volume: Volume) -> Float:
    """(n,) m, depth at the volume's pixels by an estimate less the true one."""
    found, exact = (
        _depth(each, volume, normalise(volume.pixel, each.intrinsics, each.distortion)) for each in (estimate, truth)
    )
    return found - exact


def _depth(estimate: Estimate, volume: Volume, q: Float) -> Float:
    m = estimate.planes[volume.laser]
    return np.asarray(1.0 / (q @ m[:2] + m[2]))


def pixel_gain(estimate: Estimate, volume: Volume, q: Float) -> Float:
    """(n,) m of depth a px of the line's position along the scan line: the random error's part."""
    m = estimate.planes[volume.laser]
    along = 0 if abs(m[0]) >= abs(m[1]) else 1
    _, by_q, _ = project(q, estimate.intrinsics, estimate.distortion)
    unit = np.zeros((len(q), 2, 1))
    unit[:, along] = 1.0
    depth = _depth(estimate, volume, q)
    return np.asarray(np.abs(depth**2 * (np.linalg.solve(by_q, unit)[:, :, 0] @ m[:2])))


@dataclass(frozen=True)
class DepthError:
    """Standard deviations of depth over a volume, m: by the calibration, common to all scans, and by the line."""

    volume: Volume
    systematic: Float
    """(n,)"""
    random: Float
    """(n,) for a line known to one pixel's `line_sigma`."""

    @property
    def rms(self) -> float:
        """m, of the systematic part."""
        return float(np.sqrt(np.mean(self.systematic**2)))


def depth_error(estimate: Estimate, covariance: Float, volume: Volume, line_sigma: float) -> DepthError:
    """covariance (p, p) of the shared parameters; line_sigma px of the line's position."""
    q = normalise(volume.pixel, estimate.intrinsics, estimate.distortion)
    jacobian = depth_jacobian(estimate, volume, q)
    variance = np.einsum("ni,ij,nj->n", jacobian, covariance, jacobian)
    return DepthError(volume, np.sqrt(np.maximum(variance, 0.0)), line_sigma * pixel_gain(estimate, volume, q))
