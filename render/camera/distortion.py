"""OpenCV lens distortion of normalised image coordinates, forwards and inverted, with its fold.

Rational, tangential, thin-prism and tilted-sensor terms, coefficients (14,) in OpenCV's order. A strong distortion is
one-to-one only up to a "fold", where the Jacobian's determinant vanishes; outside it the model has no meaning.
"""

from __future__ import annotations

import math

import numba
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

FOLD_ANGLES = 720
"""Number of directions in which the fold is tabulated."""
MAX_RADIUS = 20.0
"""Largest radius, normalised, at which a fold is looked for: 87 deg off the axis."""


@numba.njit(nogil=True, cache=True, error_model="numpy")
def tilt_matrix(tau_x: float, tau_y: float) -> Array:
    """(3, 3) homography of a tilted sensor (OpenCV, computeTiltProjectionMatrix)."""
    cx, sx, cy, sy = math.cos(tau_x), math.sin(tau_x), math.cos(tau_y), math.sin(tau_y)
    r = np.array([[cy, sy * sx, -sy * cx], [0.0, cx, sx], [sy, -cy * sx, cy * cx]])
    p = np.array([[r[2, 2], 0.0, -r[0, 2]], [0.0, r[2, 2], -r[1, 2]], [0.0, 0.0, 1.0]])
    return p @ r


# numpy's error model: at a pole of the rational model the result is inf or NaN, which the fold then excludes
@numba.njit(nogil=True, cache=True, error_model="numpy")
def distort(x: float, y: float, k: Array, tilt: Array) -> tuple[float, float, float, float, float, float]:
    """Distorted (x', y') and the Jacobian's entries dx'/dx, dx'/dy, dy'/dx, dy'/dy."""
    r2 = x * x + y * y
    r4, r6 = r2 * r2, r2 * r2 * r2
    top = 1.0 + k[0] * r2 + k[1] * r4 + k[4] * r6
    bottom = 1.0 + k[5] * r2 + k[6] * r4 + k[7] * r6
    radial = top / bottom
    dtop = k[0] + 2.0 * k[1] * r2 + 3.0 * k[4] * r4
    dbottom = k[5] + 2.0 * k[6] * r2 + 3.0 * k[7] * r4
    dradial = (dtop - radial * dbottom) / bottom
    xd = x * radial + 2.0 * k[2] * x * y + k[3] * (r2 + 2.0 * x * x) + k[8] * r2 + k[9] * r4
    yd = y * radial + k[2] * (r2 + 2.0 * y * y) + 2.0 * k[3] * x * y + k[10] * r2 + k[11] * r4
    thin_x, thin_y = k[8] + 2.0 * k[9] * r2, k[10] + 2.0 * k[11] * r2
    xx = radial + 2.0 * x * x * dradial + 2.0 * k[2] * y + 6.0 * k[3] * x + 2.0 * x * thin_x
    xy = 2.0 * x * y * dradial + 2.0 * k[2] * x + 2.0 * k[3] * y + 2.0 * y * thin_x
    yx = 2.0 * x * y * dradial + 2.0 * k[2] * x + 2.0 * k[3] * y + 2.0 * x * thin_y
    yy = radial + 2.0 * y * y * dradial + 6.0 * k[2] * y + 2.0 * k[3] * x + 2.0 * y * thin_y
    if k[12] == 0.0 and k[13] == 0.0:
        return xd, yd, xx, xy, yx, yy
    a = tilt[0, 0] * xd + tilt[0, 1] * yd + tilt[0, 2]
    b = tilt[1, 0] * xd + tilt[1, 1] * yd + tilt[1, 2]
    w = tilt[2, 0] * xd + tilt[2, 1] * yd + tilt[2, 2]
    xt, yt = a / w, b / w
    h00, h01 = (tilt[0, 0] - xt * tilt[2, 0]) / w, (tilt[0, 1] - xt * tilt[2, 1]) / w
    h10, h11 = (tilt[1, 0] - yt * tilt[2, 0]) / w, (tilt[1, 1] - yt * tilt[2, 1]) / w
    return xt, yt, h00 * xx + h01 * yx, h00 * xy + h01 * yy, h10 * xx + h11 * yx, h10 * xy + h11 * yy


@numba.njit(nogil=True, cache=True, error_model="numpy")
def fold_radius_at(x: float, y: float, folds: Array) -> float:
    """Fold radius in the direction of (x, y), interpolated in the table of `fold_radii`."""
    position = (math.atan2(y, x) / (2.0 * math.pi)) % 1.0 * FOLD_ANGLES
    i = int(position)
    t = position - i
    return (1.0 - t) * folds[i % FOLD_ANGLES] + t * folds[(i + 1) % FOLD_ANGLES]


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _determinant(r: float, c: float, s: float, k: Array, tilt: Array) -> float:
    _, _, xx, xy, yx, yy = distort(r * c, r * s, k, tilt)
    det = xx * yy - xy * yx
    # the radius must also grow: past a pole of the rational model the image returns from the other side
    return min(det, xx * c * c + (xy + yx) * c * s + yy * s * s)


@numba.njit(nogil=True, error_model="numpy")
def _determinants(r: float, c: Array, s: Array, k: Array, out: Array) -> None:
    """As `_determinant` without a tilted sensor, in directions (n,) at one radius, which share the radial part."""
    r2 = r * r
    r4, r6 = r2 * r2, r2 * r2 * r2
    bottom = 1.0 + k[5] * r2 + k[6] * r4 + k[7] * r6
    radial = (1.0 + k[0] * r2 + k[1] * r4 + k[4] * r6) / bottom
    dtop, dbottom = k[0] + 2.0 * k[1] * r2 + 3.0 * k[4] * r4, k[5] + 2.0 * k[6] * r2 + 3.0 * k[7] * r4
    dradial = (dtop - radial * dbottom) / bottom
    thin_x, thin_y = k[8] + 2.0 * k[9] * r2, k[10] + 2.0 * k[11] * r2
    for i in range(len(c)):
        x, y = r * c[i], r * s[i]
        xx = radial + 2.0 * x * x * dradial + 2.0 * k[2] * y + 6.0 * k[3] * x + 2.0 * x * thin_x
        xy = 2.0 * x * y * dradial + 2.0 * k[2] * x + 2.0 * k[3] * y + 2.0 * y * thin_x
        yx = 2.0 * x * y * dradial + 2.0 * k[2] * x + 2.0 * k[3] * y + 2.0 * x * thin_y
        yy = radial + 2.0 * y * y * dradial + 6.0 * k[2] * y + 2.0 * k[3] * x + 2.0 * y * thin_y
        out[i] = min(xx * yy - xy * yx, xx * c[i] * c[i] + (xy + yx) * c[i] * s[i] + yy * s[i] * s[i])


@numba.njit(nogil=True, cache=True, error_model="numpy")
def fold_radii(k: Array) -> Array:
    """(14,) coefficients -> (720,) radius, by angle, up to which the map is one-to-one (at most 20, i.e. 87 deg)."""
    folds, folded = np.full(FOLD_ANGLES, MAX_RADIUS), np.zeros(FOLD_ANGLES, dtype=np.bool_)
    tilt = tilt_matrix(k[12], k[13])
    if not np.any(k):
        return folds
    angle = 2.0 * math.pi * np.arange(FOLD_ANGLES) / FOLD_ANGLES
    c, s, determinant = np.cos(angle), np.sin(angle), np.empty(FOLD_ANGLES)
    radius, step = 0.0, 0.01
    while radius < MAX_RADIUS and not folded.all():
        beyond = radius + step
        if k[12] == 0.0 and k[13] == 0.0:
            _determinants(beyond, c, s, k, determinant)
        else:
            for i in range(FOLD_ANGLES):
                determinant[i] = _determinant(beyond, c[i], s[i], k, tilt)
        for i in range(FOLD_ANGLES):
            if not folded[i] and not determinant[i] > 0.0:
                low, high = radius, beyond
                for _ in range(50):
                    middle = 0.5 * (low + high)
                    if _determinant(middle, c[i], s[i], k, tilt) > 0.0:
                        low = middle
                    else:
                        high = middle
                folds[i], folded[i] = low, True
        radius = beyond
        step = min(step * 1.02, 0.1)
    return folds


@numba.njit(nogil=True, cache=True, error_model="numpy")
def distort_points(points: Array, k: Array, folds: Array) -> tuple[Array, Mask]:
    """(n, 2) normalised -> (n, 2) distorted, (n,) inside the fold."""
    n = points.shape[0]
    out, inside = points.copy(), np.ones(n, dtype=np.bool_)
    if not np.any(k):
        return out, inside
    tilt = tilt_matrix(k[12], k[13])
    for i in range(n):
        x, y = points[i, 0], points[i, 1]
        xd, yd, _, _, _, _ = distort(x, y, k, tilt)
        out[i, 0], out[i, 1] = xd, yd
        inside[i] = math.hypot(x, y) < fold_radius_at(x, y, folds)
    return out, inside


@numba.njit(nogil=True, cache=True, error_model="numpy")
def undistort(xd: float, yd: float, k: Array, tilt: Array, folds: Array, tolerance: float) -> tuple[float, float, bool]:
    """Invert `distort` by damped Newton steps inside the fold; returns (x, y) and whether the residual <= tolerance."""
    x, y = xd, yd
    limit = fold_radius_at(x, y, folds)
    radius = math.hypot(x, y)
    if radius >= limit:
        x, y = x * 0.9 * limit / radius, y * 0.9 * limit / radius
    fx, fy, xx, xy, yx, yy = distort(x, y, k, tilt)
    ex, ey = fx - xd, fy - yd
    error = math.hypot(ex, ey)
    for _ in range(50):
        if error <= 1e-17:
            break
        det = xx * yy - xy * yx
        if det == 0.0:
            break
        dx, dy = (yy * ex - xy * ey) / det, (xx * ey - yx * ex) / det
        scale, improved = 1.0, False
        for _ in range(12):
            nx, ny = x - scale * dx, y - scale * dy
            if math.hypot(nx, ny) < fold_radius_at(nx, ny, folds):
                fx, fy, xx, xy, yx, yy = distort(nx, ny, k, tilt)
                next_error = math.hypot(fx - xd, fy - yd)
                if next_error < error:
                    x, y, ex, ey, error, improved = nx, ny, fx - xd, fy - yd, next_error, True
                    break
            scale *= 0.5
        if not improved:
            break
    return x, y, error <= tolerance


@numba.njit(nogil=True, cache=True, error_model="numpy")
def undistort_points(points: Array, k: Array, folds: Array, tolerance: float) -> tuple[Array, Mask]:
    """(n, 2) distorted -> (n, 2) normalised, (n,) solved to `tolerance` (normalised units)."""
    n = points.shape[0]
    out, valid = points.copy(), np.ones(n, dtype=np.bool_)
    if not np.any(k):
        return out, valid
    tilt = tilt_matrix(k[12], k[13])
    for i in range(n):
        out[i, 0], out[i, 1], valid[i] = undistort(points[i, 0], points[i, 1], k, tilt, folds, tolerance)
    return out, valid
