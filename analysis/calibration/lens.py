"""The camera model with its derivatives, for arrays: distortion as OpenCV's, in OpenCV's order of coefficients."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from render.base.arrays import Float
from render.camera.distortion import fold_radii, tilt_matrix, undistort_points

LENGTHS = (0, 4, 5, 8, 12, 14)
"""Numbers of coefficients that a lens model may have."""
NAMES = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6", "s1", "s2", "s3", "s4", "taux", "tauy")


def distort(q: Float, k: Float) -> tuple[Float, Float, Float]:
    """(n, 2) normalised -> (n, 2) distorted, (n, 2, 2) its derivative by q, (n, 2, terms) by the coefficients.

    k (terms,) with as many terms as one of `LENGTHS`. Source: OpenCV, projectPoints; derivatives by hand.
    """
    terms = len(k)
    x, y = q[:, 0], q[:, 1]
    if terms == 0:
        return q, np.broadcast_to(np.eye(2), (len(q), 2, 2)), np.empty((len(q), 2, 0))
    c = np.zeros(14)
    c[:terms] = k
    xx, xy, yy = x * x, x * y, y * y
    r2 = xx + yy
    r4 = r2 * r2
    r6 = r4 * r2
    bottom = 1.0 + c[5] * r2 + c[6] * r4 + c[7] * r6
    radial = (1.0 + c[0] * r2 + c[1] * r4 + c[4] * r6) / bottom
    slope = c[0] + 2.0 * c[1] * r2 + 3.0 * c[4] * r4 - radial * (c[5] + 2.0 * c[6] * r2 + 3.0 * c[7] * r4)
    slope /= bottom
    out = np.empty((len(q), 2))
    out[:, 0] = x * radial + 2.0 * c[2] * xy + c[3] * (r2 + 2.0 * xx) + c[8] * r2 + c[9] * r4
    out[:, 1] = y * radial + c[2] * (r2 + 2.0 * yy) + 2.0 * c[3] * xy + c[10] * r2 + c[11] * r4
    thin_x, thin_y = c[8] + 2.0 * c[9] * r2, c[10] + 2.0 * c[11] * r2
    by_q = np.empty((len(q), 2, 2))
    by_q[:, 0, 0] = radial + 2.0 * xx * slope + 2.0 * c[2] * y + 6.0 * c[3] * x + 2.0 * x * thin_x
    by_q[:, 0, 1] = 2.0 * xy * slope + 2.0 * c[2] * x + 2.0 * c[3] * y + 2.0 * y * thin_x
    by_q[:, 1, 0] = 2.0 * xy * slope + 2.0 * c[2] * x + 2.0 * c[3] * y + 2.0 * x * thin_y
    by_q[:, 1, 1] = radial + 2.0 * yy * slope + 6.0 * c[2] * y + 2.0 * c[3] * x + 2.0 * y * thin_y
    by_k = np.zeros((len(q), 2, max(terms, 12)))
    for column, power in ((0, r2), (1, r4), (4, r6)):
        by_k[:, :, column] = q * (power / bottom)[:, None]
    for column, power in ((5, r2), (6, r4), (7, r6)):
        by_k[:, :, column] = -q * (radial * power / bottom)[:, None]
    by_k[:, 0, 2], by_k[:, 1, 2] = 2.0 * xy, r2 + 2.0 * yy
    by_k[:, 0, 3], by_k[:, 1, 3] = r2 + 2.0 * xx, 2.0 * xy
    by_k[:, 0, 8], by_k[:, 0, 9], by_k[:, 1, 10], by_k[:, 1, 11] = r2, r4, r2, r4
    if terms < 14:
        return out, by_q, by_k[:, :, :terms]
    return _tilted(out, by_q, by_k, c[12], c[13])


def _tilted(straight: Float, by_q: Float, by_k: Float, tau_x: float, tau_y: float) -> tuple[Float, Float, Float]:
    """The image on the tilted sensor, a homography of the straight one, with its derivatives."""
    tilt = tilt_matrix(tau_x, tau_y)
    lifted = np.concatenate([straight, np.ones((len(straight), 1))], axis=1)
    mapped = lifted @ tilt.T
    out = mapped[:, :2] / mapped[:, 2:]
    by_straight = (tilt[None, :2, :2] - out[:, :, None] * tilt[2, None, None, :2]) / mapped[:, 2, None, None]
    by_k = by_straight @ by_k
    for column, change in enumerate(_tilt_derivatives(tau_x, tau_y)):
        moved = lifted @ change.T
        by_k[:, :, 12 + column] = (moved[:, :2] - out * moved[:, 2:]) / mapped[:, 2:]
    return out, by_straight @ by_q, by_k


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


def project(q: Float, intrinsics: Float, k: Float) -> tuple[Float, Float, Float]:
    """(n, 2) normalised -> (n, 2) px, (n, 2, 2) its derivative by q, (n, 2, 4 + terms) by fx, fy, cx, cy and k.

    intrinsics (4,) fx, fy, cx, cy in px.
    """
    distorted, by_q, by_k = distort(q, k)
    focal = intrinsics[:2]
    by_camera = np.zeros((len(q), 2, 4 + len(k)))
    by_camera[:, 0, 0], by_camera[:, 1, 1] = distorted[:, 0], distorted[:, 1]
    by_camera[:, 0, 2] = by_camera[:, 1, 3] = 1.0
    by_camera[:, :, 4:] = by_k * focal[None, :, None]
    return distorted * focal + intrinsics[2:], by_q * focal[None, :, None], by_camera


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
