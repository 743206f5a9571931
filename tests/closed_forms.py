"""Exact lines of a laser sheet on planes, spheres, cylinders and prisms, to judge the renderer by; float64.

All in the camera frame, m: the sheet is (n, d) with n . X + d = 0, and K the (3, 3) camera matrix without distortion.
For a point X on the sheet m . X = 1 with m = -n / d, so that any surface's equation becomes homogeneous in the viewing
ray r = K^-1 (u, v, 1): a plane gives a line, a quadric a conic, and each image row v an equation of degree 1 or 2 in u.
It is solved in the normalised x = r_x / r_z, where it is well scaled.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from render.scene.shape import StepBlock, VGroove

Array = NDArray[np.float64]


def triangulate(K: Array, laser: Array, u: Array | float, v: Array | float) -> Array:
    """(..., 3) points where the viewing rays of pixels (u, v) meet the sheet (a, b, c, d)."""
    ray = _rays(K, u, v)
    return np.asarray(-laser[3] / (ray @ laser[:3])[..., None] * ray)


def plane_line(laser: Array, plane: Array) -> Array:
    """(3,) line in normalised coordinates of the sheet on a plane (nx, ny, nz, k), n . X = k."""
    return np.asarray(-plane[3] * laser[:3] / laser[3] - plane[:3])


def u_on_plane(K: Array, laser: Array, plane: Array, v: Array) -> Array:
    """(n,) u of the sheet on a plane for rows v (n,); infinite where the row runs along the line."""
    line = plane_line(laser, plane)
    y = _row(K, v)
    with np.errstate(divide="ignore", invalid="ignore"):
        return _column(K, -(line[1] * y + line[2]) / line[0], y)


def sphere_conic(laser: Array, centre: Array, radius: float) -> Array:
    """(3, 3) conic in normalised coordinates of the sheet on a sphere; the cut is a circle about the centre's foot."""
    n, d = laser[:3], laser[3]
    distance = n @ centre + d
    e1, e2 = _basis(n)
    H = np.stack([e1, e2, centre - distance * n], axis=1)
    return _carried(H, np.diag([1.0, 1.0, distance**2 - radius**2]))


def cylinder_conic(laser: Array, point: Array, axis: Array, radius: float) -> Array:
    """(3, 3) conic in normalised coordinates of the sheet on an endless cylinder about a line along the unit `axis`."""
    n, d = laser[:3], laser[3]
    M = np.eye(3) - np.outer(axis, axis)
    e1, e2 = _basis(n)
    foot = point - (n @ point + d) * n
    q = foot - point
    E = np.stack([e1, e2, q], axis=1)
    conic = E.T @ M @ E
    conic[2, 2] -= radius**2
    return _carried(np.stack([e1, e2, foot], axis=1), conic)


def u_on_conic(K: Array, conic: Array, v: Array) -> Array:
    """(n, 2) both u of a conic for rows v (n,), ascending; NaN where the row misses it."""
    y = _row(K, v)
    a = conic[0, 0] + 0.0 * y
    b = conic[0, 1] * y + conic[0, 2]
    c = conic[1, 1] * y**2 + 2.0 * conic[1, 2] * y + conic[2, 2]
    with np.errstate(invalid="ignore", divide="ignore"):
        # Without cancellation: one root from the larger sum, the other from the product of both.
        q = -(b + np.copysign(np.sqrt(b**2 - a * c), b))
        roots = np.sort(np.stack([q / a, c / q], axis=-1), axis=-1)
    return _column(K, roots, y[:, None])


@dataclass(frozen=True)
class Rectangle:
    """corner + s a + t b for s, t in [0, 1], m; a and b are perpendicular; the outward normal is a x b."""

    corner: Array
    a: Array
    b: Array

    @property
    def plane(self) -> Array:
        """(4,) (n, k) with n . X = k."""
        n = np.cross(self.a, self.b)
        n = n / np.linalg.norm(n)
        return np.append(n, n @ self.corner)

    def holds(self, points: Array) -> NDArray[np.bool_]:
        """Whether points of its plane lie on it."""
        s = (points - self.corner) @ self.a / (self.a @ self.a)
        t = (points - self.corner) @ self.b / (self.b @ self.b)
        return (s >= 0) & (s <= 1) & (t >= 0) & (t <= 1)


def step_block_tops(shape: StepBlock, T_camera_object: Array) -> list[Rectangle]:
    """Treads and risers in the order of the climb: riser, tread, riser, tread ..."""
    x = (np.arange(shape.steps + 1) - shape.steps / 2) * shape.tread
    profile = [(x[0], 0.0)]
    for i in range(shape.steps):
        z = (i + 1) * shape.rise
        profile += [(x[i], z), (x[i + 1], z)]
    return _swept(profile, shape.width, T_camera_object)


def v_groove_tops(shape: VGroove, T_camera_object: Array) -> list[Rectangle]:
    """Left land, left flank, right flank, right land."""
    half, opening = shape.width / 2, shape.depth * math.tan(shape.angle / 2)
    profile = [(-half, 0.0), (-opening, 0.0), (0.0, -shape.depth), (opening, 0.0), (half, 0.0)]
    return _swept(profile, shape.length, T_camera_object)


def u_on_rectangles(K: Array, laser: Array, rectangles: list[Rectangle], v: Array) -> Array:
    """(n, r) u of the sheet on each rectangle for rows v (n,); NaN where it is missed. Nothing is said of occlusion."""
    columns = []
    for rectangle in rectangles:
        u = u_on_plane(K, laser, rectangle.plane, v)
        with np.errstate(invalid="ignore"):
            on = np.isfinite(u) & rectangle.holds(triangulate(K, laser, np.where(np.isfinite(u), u, 0.0), v))
        columns.append(np.where(on, u, np.nan))
    return np.stack(columns, axis=1)


def _swept(profile: list[tuple[float, float]], length: float, T: Array) -> list[Rectangle]:
    """Rectangles over the edges of an (x, z) profile running towards +x, swept along y; outward is up."""
    rotation, translation = T[:3, :3], T[:3, 3]
    along = rotation @ np.array([0.0, length, 0.0])
    points = [rotation @ np.array([x, -length / 2, z]) + translation for x, z in profile]
    return [Rectangle(start, end - start, along) for start, end in pairwise(points)]


def _basis(n: Array) -> tuple[Array, Array]:
    """Two unit vectors that make an orthonormal frame with n."""
    e1 = np.cross(n, np.eye(3)[np.argmin(np.abs(n))])
    e1 /= np.linalg.norm(e1)
    return e1, np.cross(n, e1)


def _carried(H: Array, conic: Array) -> Array:
    """A conic of sheet coordinates in normalised image coordinates, H^-T C H^-1 (Hartley & Zisserman 2004, 2.14)."""
    inverse = np.linalg.inv(H)
    return np.asarray(inverse.T @ conic @ inverse)


def _row(K: Array, v: Array | float) -> Array:
    return np.asarray((np.asarray(v) - K[1, 2]) / K[1, 1])


def _column(K: Array, x: Array, y: Array) -> Array:
    return np.asarray(K[0, 0] * x + K[0, 1] * y + K[0, 2])


def _rays(K: Array, u: Array | float, v: Array | float) -> Array:
    """(..., 3) K^-1 (u, v, 1) of an upper triangular K."""
    y = _row(K, v)
    x = (np.asarray(u, dtype=np.float64) - K[0, 2] - K[0, 1] * y) / K[0, 0]
    return np.stack(np.broadcast_arrays(x, y, 1.0), axis=-1)
