"""The camera model with its derivatives: distortion as OpenCV's, in OpenCV's order of coefficients."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numba
import numpy as np

from render.base.arrays import Float
from render.camera.distortion import fold_radii, tilt_matrix, undistort_points

LENGTHS = (0, 4, 5, 8, 12, 14)
"""Numbers of coefficients that a lens model may have."""
NAMES = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6", "s1", "s2", "s3", "s4", "taux", "tauy")
CAMERA = 4 + len(NAMES)
"""Parameters of a camera with all of them."""


class Lens(NamedTuple):
    """A camera as kernels take it."""

    intrinsics: Float
    """(4,) fx, fy, cx, cy, px."""
    k: Float
    """(14,) all coefficients."""
    tilts: Float
    """(3, 3, 3) the homography of the sensor's tilt and its derivatives by taux and tauy."""
    tilted: bool
    """Whether there is a tilt to know."""


def lens_of(intrinsics: Float, k: Float) -> Lens:
    """intrinsics (4,) px, and k (terms,) with as many terms as one of `LENGTHS`."""
    padded = np.zeros(len(NAMES))
    padded[: len(k)] = k
    tilted = len(k) == len(NAMES)
    angles = padded[12], padded[13]
    tilts = np.stack([tilt_matrix(*angles), *_tilt_derivatives(*angles)]) if tilted else np.zeros((3, 3, 3))
    return Lens(np.ascontiguousarray(intrinsics, dtype=np.float64), padded, tilts, tilted)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def project_point(x: float, y: float, lens: Lens, by_q: Float, by_camera: Float) -> tuple[float, float]:
    """Normalised x, y -> u, v px; by_q (2, 2) and by_camera (2, 18), by fx, fy, cx, cy and k, become its derivatives.

    Source: OpenCV, projectPoints; derivatives by hand.
    """
    c, by_k = lens.k, by_camera[:, 4:]
    xx, xy, yy = x * x, x * y, y * y
    r2 = xx + yy
    r4 = r2 * r2
    r6 = r4 * r2
    bottom = 1.0 + c[5] * r2 + c[6] * r4 + c[7] * r6
    radial = (1.0 + c[0] * r2 + c[1] * r4 + c[4] * r6) / bottom
    slope = c[0] + 2.0 * c[1] * r2 + 3.0 * c[4] * r4 - radial * (c[5] + 2.0 * c[6] * r2 + 3.0 * c[7] * r4)
    slope /= bottom
    u = x * radial + 2.0 * c[2] * xy + c[3] * (r2 + 2.0 * xx) + c[8] * r2 + c[9] * r4
    v = y * radial + c[2] * (r2 + 2.0 * yy) + 2.0 * c[3] * xy + c[10] * r2 + c[11] * r4
    thin_x, thin_y = c[8] + 2.0 * c[9] * r2, c[10] + 2.0 * c[11] * r2
    by_q[0, 0] = radial + 2.0 * xx * slope + 2.0 * c[2] * y + 6.0 * c[3] * x + 2.0 * x * thin_x
    by_q[0, 1] = 2.0 * xy * slope + 2.0 * c[2] * x + 2.0 * c[3] * y + 2.0 * y * thin_x
    by_q[1, 0] = 2.0 * xy * slope + 2.0 * c[2] * x + 2.0 * c[3] * y + 2.0 * x * thin_y
    by_q[1, 1] = radial + 2.0 * yy * slope + 6.0 * c[2] * y + 2.0 * c[3] * x + 2.0 * y * thin_y
    by_camera[:] = 0.0
    for row, along in enumerate((x, y)):
        for column, power in ((0, r2), (1, r4), (4, r6)):
            by_k[row, column] = along * power / bottom
        for column, power in ((5, r2), (6, r4), (7, r6)):
            by_k[row, column] = -along * radial * power / bottom
    by_k[0, 2], by_k[1, 2] = 2.0 * xy, r2 + 2.0 * yy
    by_k[0, 3], by_k[1, 3] = r2 + 2.0 * xx, 2.0 * xy
    by_k[0, 8], by_k[0, 9], by_k[1, 10], by_k[1, 11] = r2, r4, r2, r4
    if lens.tilted:
        u, v = _tilt(u, v, lens.tilts, by_q, by_k)
    fx, fy = lens.intrinsics[0], lens.intrinsics[1]
    by_q[0] *= fx
    by_q[1] *= fy
    by_k[0] *= fx
    by_k[1] *= fy
    by_camera[0, 0], by_camera[1, 1] = u, v
    by_camera[0, 2] = by_camera[1, 3] = 1.0
    return fx * u + lens.intrinsics[2], fy * v + lens.intrinsics[3]


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _tilt(u: float, v: float, tilts: Float, by_q: Float, by_k: Float) -> tuple[float, float]:
    """The image on the tilted sensor, a homography of the straight one; its derivatives follow."""
    tilt = tilts[0]
    mapped = tilt[:, 0] * u + tilt[:, 1] * v + tilt[:, 2]
    there = mapped[0] / mapped[2], mapped[1] / mapped[2]
    by_straight = np.empty((2, 2))
    for row in range(2):
        by_straight[row] = (tilt[row, :2] - there[row] * tilt[2, :2]) / mapped[2]
    by_q[:] = by_straight @ by_q
    for column in range(12):
        first, second = by_k[0, column], by_k[1, column]
        for row in range(2):
            by_k[row, column] = by_straight[row, 0] * first + by_straight[row, 1] * second
    for angle in range(2):
        change = tilts[1 + angle]
        moved = change[:, 0] * u + change[:, 1] * v + change[:, 2]
        for row in range(2):
            by_k[row, 12 + angle] = (moved[row] - there[row] * moved[2]) / mapped[2]
    return there


@numba.njit(nogil=True, cache=True, error_model="numpy")
def project_points(q: Float, lens: Lens) -> tuple[Float, Float, Float]:
    """(n, 2) normalised -> (n, 2) px, (n, 2, 2) its derivative by q, (n, 2, 18) by the camera."""
    pixel, by_q, by_camera = np.empty((len(q), 2)), np.empty((len(q), 2, 2)), np.empty((len(q), 2, CAMERA))
    for i in range(len(q)):
        pixel[i, 0], pixel[i, 1] = project_point(q[i, 0], q[i, 1], lens, by_q[i], by_camera[i])
    return pixel, by_q, by_camera


def project(q: Float, intrinsics: Float, k: Float) -> tuple[Float, Float, Float]:
    """(n, 2) normalised -> (n, 2) px, (n, 2, 2) its derivative by q, (n, 2, 4 + terms) by fx, fy, cx, cy and k.

    intrinsics (4,) fx, fy, cx, cy in px.
    """
    pixel, by_q, by_camera = project_points(np.ascontiguousarray(q, dtype=np.float64), lens_of(intrinsics, k))
    return pixel, by_q, by_camera[:, :, : 4 + len(k)]


def distort(q: Float, k: Float) -> tuple[Float, Float, Float]:
    """(n, 2) normalised -> (n, 2) distorted, (n, 2, 2) its derivative by q, (n, 2, terms) by the coefficients k."""
    distorted, by_q, by_camera = project(q, np.array([1.0, 1.0, 0.0, 0.0]), k)
    return distorted, by_q, by_camera[:, :, 4:]


def _tilt_derivatives(tau_x: float, tau_y: float) -> tuple[Float, Float]:
    """(3, 3) each: derivatives of `tilt_matrix` by its two angles."""
    cx, sx, cy, sy = np.cos(tau_x), np.sin(tau_x), np.cos(tau_y), np.sin(tau_y)
    r = np.array([[cy, sy * sx, -sy * cx], [0.0, cx, sx], [sy, -cy * sx, cy * cx]])
    by_x = np.array([[0.0, sy * cx, sy * sx], [0.0, -sx, cx], [0.0, -cy * cx, -cy * sx]])
    by_y = np.array([[-sy, cy * sx, -cy * cx], [0.0, 0.0, 0.0], [cy, sy * sx, -sy * cx]])

    def projection(m: Float, one: float) -> Float:
        return np.array([[m[2, 2], 0.0, -m[0, 2]], [0.0, m[2, 2], -m[1, 2]], [0.0, 0.0, one]])

    p = projection(r, 1.0)
    return projection(by_x, 0.0) @ r + p @ by_x, projection(by_y, 0.0) @ r + p @ by_y


def normalise(pixels: Float, intrinsics: Float, k: Float) -> Float:
    """(n, 2) px -> (n, 2) normalised; beyond the fold of the distortion, the nearest that there is within it."""
    q = np.ascontiguousarray((pixels - intrinsics[2:]) / intrinsics[:2])
    if not np.any(k):
        return q
    padded = np.zeros(14)
    padded[: len(k)] = k
    return np.asarray(undistort_points(q, padded, _folds(padded.tobytes()), 1e-10 / float(intrinsics[:2].max()))[0])


@lru_cache(maxsize=64)
def _folds(k: bytes) -> Float:
    """Those of a lens that one adjustment, check or drawing asks for again and again."""
    return np.asarray(fold_radii(np.frombuffer(k).copy()))
