"""The thin lens: rays through the points of its aperture, and where a point of the world lands through one of them.

The calibrated camera stays valid: the centre of the lens is the camera's centre, and the ray through it (the chief
ray) is that of the pinhole with OpenCV's distortion and tilt, so truth and triangulation are the pinhole's. In camera
coordinates the aperture is the disc of radius R = f / (2 N) on z = 0. With (x, y) the chief ray's undistorted slopes,
v = fx pixel_pitch the image distance on the axis, s the focus distance and f the focal length,

    1 / f = 1 / v + 1 / s
    w(x, y) = 1 / s - (g1 x + g2 y)           1 / depth_z of the point in focus on this chief ray
    d(a, b) = (x, y, 1) - w (a, b, 0)         direction of the ray through the lens point (a, b), length 1 along z

All rays of a pixel meet at depth 1 / w, where the chief ray crosses the plane of focus. A point at depth Z off it blurs
to a disc of diameter  2 R fx |w - 1 / Z|  px, which is  f^2 / N |1 / s - 1 / Z| s / (s - f) / pixel_pitch  on the axis.

Scheimpflug: OpenCV's tilt (tauX, tauY) turns the sensor about its principal point. In units of v its plane, ahead of
the centre, is n . p = n3 with n the third row of R(tauX, tauY) (`render.camera.distortion.tilt_matrix`). A point of it
has the image distance v n3 / (n . (x, y, 1)), and the lens equation gives the depth that is sharp there:

    g1 = n1 / (n3 v) = tan(tauY) / (cos(tauX) v),     g2 = n2 / (n3 v) = -tan(tauX) / v

The plane of focus Z / s - g1 X - g2 Y = 1 meets the sensor's plane on the lens's, at g1 X + g2 Y = -1 (Scheimpflug's
rule). Lens distortion moves chief rays and leaves that plane as it is. Where w <= 0 the rays diverge: nothing is sharp.

A pixel's radiance is the mean over its area and over the aperture.
"""

from __future__ import annotations

import math

import numba
import numpy as np

from render.base.arrays import Float
from render.camera.distortion import distort, fold_radius_at, undistort
from render.camera.view import View


@numba.njit(nogil=True, cache=True, error_model="numpy")
def lens_point(radius: float, r1: float, r2: float) -> tuple[float, float]:
    """(a, b) on the aperture, m, uniform for uniform (r1, r2) in [0, 1)^2: concentric map (Shirley and Chiu 1997)."""
    x, y = 2.0 * r1 - 1.0, 2.0 * r2 - 1.0
    if x == 0.0 and y == 0.0:
        return 0.0, 0.0
    if abs(x) > abs(y):
        r, phi = x, 0.25 * math.pi * (y / x)
    else:
        r, phi = y, 0.5 * math.pi - 0.25 * math.pi * (x / y)
    return radius * r * math.cos(phi), radius * r * math.sin(phi)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def chief_ray(view: View, tilt: Float, distorted: bool, u: float, v: float) -> tuple[float, float, bool]:
    """Undistorted slopes (x, y) of the ray through the lens's centre of a pixel (u, v); False: it has none.

    tilt: `tilt_matrix` of the camera; distorted: some of its coefficients are not 0.
    """
    k = view.intrinsics
    y = (v - k[3]) / k[1]
    x = (u - k[2] - k[4] * y) / k[0]
    if not distorted:
        return x, y, True
    return undistort(x, y, view.distortion, tilt, view.folds, 1e-10 / max(k[0], k[1]))


@numba.njit(nogil=True, cache=True, error_model="numpy")
def lens_direction(view: View, x: float, y: float, a: float, b: float) -> tuple[float, float, float]:
    """World direction, of length 1 along the camera's axis, through the lens point (a, b) of the chief ray (x, y)."""
    m, lens = view.T_world_camera, view.lens
    w = lens[1] - (lens[2] * x + lens[3] * y)
    e0, e1 = x - w * a, y - w * b
    return (
        m[0, 0] * e0 + m[0, 1] * e1 + m[0, 2],
        m[1, 0] * e0 + m[1, 1] * e1 + m[1, 2],
        m[2, 0] * e0 + m[2, 1] * e1 + m[2, 2],
    )


@numba.njit(nogil=True, cache=True, error_model="numpy")
def lens_position(view: View, a: float, b: float) -> tuple[float, float, float]:
    """World position, m, of the lens point (a, b)."""
    m = view.T_world_camera
    return (
        m[0, 3] + m[0, 0] * a + m[0, 1] * b,
        m[1, 3] + m[1, 0] * a + m[1, 1] * b,
        m[2, 3] + m[2, 0] * a + m[2, 1] * b,
    )


@numba.njit(nogil=True, cache=True, error_model="numpy")
def lens_project(
    view: View, tilt: Float, distorted: bool, p0: float, p1: float, p2: float, a: float, b: float
) -> tuple[float, float, float]:
    """Pixel (u, v) of the image of the world point p through the lens point (a, b), and the image area of a patch at p.

    The area, px^2 for each m^2 of a patch at p that faces the lens point, is 0 where p has no image (behind the camera,
    beyond the distortion's fold); whether (u, v) lies in the image is left to the caller. Light of power Phi that p
    scatters by f adds  Phi f cos(at p, to the lens point) area  to the pixel's radiance, for a lens point sampled
    uniformly on the aperture: I = mean over the aperture of the integral of L over the pixel, du dv. Conversely, a ray
    sampled uniformly from one pixel and the aperture meets p with the pdf `area`, 1/m^2, on a patch that faces the lens
    point; times the squared distance it is the pdf of the direction, 1/sr. A pinhole is (a, b) = (0, 0).

    Derivation. The ray from (a, b) to p = (X, Y, Z), camera coordinates, has the slopes e = ((X - a) / Z, (Y - b) / Z),
    and chief-ray slopes n with  e = n - w(n) (a, b),  w = 1 / s - g . n.  Hence  n + (a, b) (g . n) = q,
    q = e + (a, b) / s,  and by Sherman and Morrison  n = q - (a, b) (g . q) / (1 + g . (a, b)),  whose determinant
    |dn / de| is 1 / (1 + g . (a, b)). A patch dS that faces the lens point at the distance r covers the solid angle
    dS / r^2 = de cos^3(off axis) = de (Z / r)^3, and the image is  du dv = fx fy |J_distortion(n)| dn.
    """
    m, lens, k = view.T_world_camera, view.lens, view.intrinsics
    p0, p1, p2 = p0 - m[0, 3], p1 - m[1, 3], p2 - m[2, 3]
    z = m[0, 2] * p0 + m[1, 2] * p1 + m[2, 2] * p2
    ex = m[0, 0] * p0 + m[1, 0] * p1 + m[2, 0] * p2 - a
    ey = m[0, 1] * p0 + m[1, 1] * p1 + m[2, 1] * p2 - b
    r = math.sqrt(ex * ex + ey * ey + z * z)
    # a point nearly in the plane of the lens has no image
    if not z > 1e-6 * r:
        return np.nan, np.nan, 0.0
    qx, qy = ex / z + lens[1] * a, ey / z + lens[1] * b
    stretch = 1.0 + lens[2] * a + lens[3] * b
    t = (lens[2] * qx + lens[3] * qy) / stretch
    x, y = qx - t * a, qy - t * b
    jacobian = 1.0
    if distorted:
        if not math.hypot(x, y) < fold_radius_at(x, y, view.folds):
            return np.nan, np.nan, 0.0
        x, y, xx, xy, yx, yy = distort(x, y, view.distortion, tilt)
        jacobian = xx * yy - xy * yx
    area = k[0] * k[1] * jacobian * r / (z * z * z * stretch)
    return k[0] * x + k[4] * y + k[2], k[1] * y + k[3], area
