"""Triangles of the primitives: plane, box, sphere, cylinder, step block and V groove, outward and with UV."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from render.base.arrays import Float
from render.mesh.mesh import Mesh
from render.scene.shape import Box, Cylinder, Plane, Primitive, Sphere, StepBlock, VGroove

Int = NDArray[np.int64]


def primitive_mesh(shape: Primitive) -> Mesh:
    """Mesh of a primitive, m, in the frame that its description in render/scene/shape.py gives."""
    match shape:
        case Plane():
            return plane(shape)
        case Box():
            return box(shape)
        case Sphere():
            return sphere(shape)
        case Cylinder():
            return cylinder(shape)
        case StepBlock():
            return step_block(shape)
        case VGroove():
            return v_groove(shape)


def triangle_count(shape: Primitive) -> int:
    """How many triangles `primitive_mesh` makes of a shape."""
    match shape:
        case Plane():
            return 2
        case Box():
            return 12
        case Sphere():
            return 2 * shape.segments * (max(4, shape.segments // 2) - 1)
        case Cylinder():
            return 4 * shape.segments
        case StepBlock():
            return 12 * shape.steps
        case VGroove():
            return 24


def mesh(vertices: Float, triangles: Int, uv: Float) -> Mesh:
    """Mesh of (v, 3) m, (t, 3) and (t, 3, 2), in the types that the kernels are compiled for."""
    return Mesh(
        np.ascontiguousarray(vertices, dtype=np.float64),
        np.ascontiguousarray(triangles, dtype=np.int32),
        np.ascontiguousarray(uv, dtype=np.float32),
    )


def plane(shape: Plane) -> Mesh:
    """Two triangles; u along x, v along y."""
    uv = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    vertices = np.zeros((4, 3))
    vertices[:, :2] = (uv - 0.5) * (shape.width, shape.height)
    triangles = np.array([[0, 1, 2], [0, 2, 3]])
    return mesh(vertices, triangles, uv[triangles])


def box(shape: Box) -> Mesh:
    """A prism along y."""
    corners = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]]) * (shape.size_x, shape.size_z)
    return prism(corners, np.array([[0, 1, 2], [0, 2, 3]]), shape.size_y)


def sphere(shape: Sphere) -> Mesh:
    """A UV sphere with fans at the poles; u is longitude from +x, v latitude from the pole at -z."""
    around, up = shape.segments, max(4, shape.segments // 2)
    longitude = 2.0 * np.pi * np.arange(around) / around
    latitude = np.pi * (np.arange(1, up) / up - 0.5)
    ring = np.stack([np.cos(longitude), np.sin(longitude)], axis=1)
    vertices = np.empty((2 + (up - 1) * around, 3))
    vertices[0], vertices[-1] = (0.0, 0.0, -1.0), (0.0, 0.0, 1.0)
    vertices[1:-1, :2] = (np.cos(latitude)[:, None, None] * ring).reshape(-1, 2)
    vertices[1:-1, 2] = np.repeat(np.sin(latitude), around)

    i = np.arange(around)
    j = (i + 1) % around
    first, last = 1, 1 + (up - 2) * around
    south = np.stack([np.zeros_like(i), first + j, first + i], axis=1)
    north = np.stack([last + i, last + j, np.full_like(i, len(vertices) - 1)], axis=1)
    lower = first + np.arange(up - 2)[:, None] * around
    a, b, c, d = (np.ravel(lower + k) for k in (i, j, j + around, i + around))
    triangles = np.concatenate([south, np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1), north])

    # Longitude per corner, so that the last column of triangles ends at u = 1 and a pole lies between its neighbours.
    u0, u1 = i / around, (i + 1) / around
    middle = (u0 + u1) / 2
    rows = (np.arange(1, up - 1) / up)[:, None]
    v0, v1 = np.ravel(rows + 0.0 * u0), np.ravel(rows + 1.0 / up + 0.0 * u0)
    w0, w1 = np.tile(u0, up - 2), np.tile(u1, up - 2)
    uv = np.concatenate(
        [
            corners_uv((middle, 0.0 * u0), (u1, 0.0 * u0 + 1.0 / up), (u0, 0.0 * u0 + 1.0 / up)),
            corners_uv((w0, v0), (w1, v0), (w1, v1)),
            corners_uv((w0, v0), (w1, v1), (w0, v1)),
            corners_uv((u0, 0.0 * u0 + 1.0 - 1.0 / up), (u1, 0.0 * u0 + 1.0 - 1.0 / up), (middle, 0.0 * u0 + 1.0)),
        ]
    )
    return mesh(vertices * shape.radius, triangles, uv)


def cylinder(shape: Cylinder) -> Mesh:
    """Closed by fans; on the side u is the angle from +x and v runs along z, a cap has the disc in the unit square."""
    n = shape.segments
    angle = 2.0 * np.pi * np.arange(n) / n
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    vertices = np.zeros((2 * n + 2, 3))
    vertices[:n, :2] = vertices[n : 2 * n, :2] = ring * shape.radius
    vertices[:n, 2], vertices[n : 2 * n, 2] = -shape.length / 2, shape.length / 2
    vertices[2 * n, 2], vertices[2 * n + 1, 2] = -shape.length / 2, shape.length / 2

    i = np.arange(n)
    j = (i + 1) % n
    bottom, top = np.full(n, 2 * n), np.full(n, 2 * n + 1)
    groups = [(i, j, j + n), (i, j + n, i + n), (bottom, j, i), (top, i + n, j + n)]
    triangles = np.concatenate([np.stack(group, axis=1) for group in groups])
    u0, u1, zero, one = i / n, (i + 1) / n, np.zeros(n), np.ones(n)
    disc = 0.5 + 0.5 * ring
    centre, rim_i, rim_j = (0.5 * one, 0.5 * one), (disc[i, 0], disc[i, 1]), (disc[j, 0], disc[j, 1])
    uv = np.concatenate(
        [
            corners_uv((u0, zero), (u1, zero), (u1, one)),
            corners_uv((u0, zero), (u1, one), (u0, one)),
            corners_uv(centre, rim_j, rim_i),
            corners_uv(centre, rim_i, rim_j),
        ]
    )
    return mesh(vertices, triangles, uv)


def step_block(shape: StepBlock) -> Mesh:
    """A prism along y; the first tread is the top of the base, so tread i lies at z = (i + 1) rise."""
    n = shape.steps
    x = (np.arange(n + 1) - n / 2) * shape.tread
    z = (np.arange(n) + 1.0) * shape.rise
    # Counter-clockwise: along the bottom towards +x, then down the stairs from the highest tread.
    floor = np.stack([x, np.zeros(n + 1)], axis=1)
    stairs = np.stack([np.repeat(x, 2)[1:-1], np.repeat(z, 2)], axis=1)[::-1]
    profile = np.concatenate([floor, stairs])
    # One column a tread, its left edge split where the tread below ends, so that no vertex lies within an edge.
    i = np.arange(n)
    right_top = n + 1 + 2 * (n - 1 - i)
    left_top, left_below = right_top + 1, right_top + 2
    caps = np.concatenate(
        [
            np.stack([i + 1, right_top, left_top], axis=1),
            np.stack([i + 1, left_top, i], axis=1)[:1],
            np.stack([i + 1, left_top, left_below], axis=1)[1:],
            np.stack([i + 1, left_below, i], axis=1)[1:],
        ]
    )
    return prism(profile, caps, shape.width)


def v_groove(shape: VGroove) -> Mesh:
    """A prism along y."""
    half, opening = shape.width / 2, shape.depth * math.tan(shape.angle / 2)
    profile = np.array(
        [
            [-half, -shape.thickness],
            [half, -shape.thickness],
            [half, 0.0],
            [opening, 0.0],
            [0.0, -shape.depth],
            [-opening, 0.0],
            [-half, 0.0],
        ]
    )
    caps = np.array([[1, 2, 3], [1, 3, 4], [0, 1, 4], [0, 4, 5], [0, 5, 6]])
    return prism(profile, caps, shape.length)


def prism(profile: Float, caps: Int, length: float) -> Mesh:
    """A closed prism along y, centred on y = 0.

    profile (n, 2): x and z, m, counter-clockwise seen from -y. caps (m, 3): triangles of the profile, likewise.
    UV: on the sides u along y and v along the perimeter; on the ends the bounding rectangle in the unit square.
    """
    n = len(profile)
    vertices = np.empty((2, n, 3))
    vertices[:, :, 0], vertices[:, :, 2] = profile[:, 0], profile[:, 1]
    vertices[:, :, 1] = np.array([[-length / 2], [length / 2]])

    i = np.arange(n)
    j = (i + 1) % n
    triangles = np.concatenate(
        [np.stack([i, i + n, j + n], axis=1), np.stack([i, j + n, j], axis=1), caps, caps[:, ::-1] + n]
    )
    edges = np.linalg.norm(profile[j] - profile, axis=1)
    v1 = np.cumsum(edges) / edges.sum()
    v0 = np.concatenate([[0.0], v1[:-1]])
    zero, one = np.zeros(n), np.ones(n)
    square = (profile - profile.min(axis=0)) / np.ptp(profile, axis=0)
    uv = np.concatenate(
        [
            corners_uv((zero, v0), (one, v0), (one, v1)),
            corners_uv((zero, v0), (one, v1), (zero, v1)),
            square[caps],
            square[caps[:, ::-1]],
        ]
    )
    return mesh(vertices.reshape(-1, 3), triangles, uv)


def corners_uv(*corners: tuple[Float, Float]) -> Float:
    """(t, 3, 2) from the (u, v) arrays, (t,) each, of the three corners."""
    return np.stack([np.stack(corner, axis=1) for corner in corners], axis=1)
