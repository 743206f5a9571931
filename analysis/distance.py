"""Signed distance from points to a mesh, in float64: positive on the camera's side of the surface it sees."""

from __future__ import annotations

import weakref
from typing import Any

import numpy as np
from numpy.typing import NDArray

from render.base.arrays import Float, Int


def signed_distance(
    points: Float, vertices: Float, triangles: Int, camera_centre: Float
) -> tuple[Float, NDArray[np.int64]]:
    """Distance of (m, 3) points to a mesh, (v, 3) and (t, 3), with the triangle that is nearest; m, world frame.

    The sign asks what the camera sees: negative when the ray from `camera_centre`, (3,) or one for each point, meets
    the surface before the point. It needs neither a closed mesh nor consistent winding, and is right at edges, where
    the normal of the nearest triangle is not (Baerentzen & Aanaes 2005). Exact to float64 unless two triangles are
    equally near to float32 (within 0.1 um at 1 m), when either may be taken. Points with NaN, or an empty mesh, give
    NaN and -1.
    """
    distance, nearest = np.full(len(points), np.nan), np.full(len(points), -1, dtype=np.int64)
    here = np.all(np.isfinite(points), axis=1)
    if not np.any(here) or len(triangles) == 0:
        return distance, nearest
    centre = camera_centre if camera_centre.ndim == 1 else camera_centre[here]
    distance[here], nearest[here] = _signed_distance(points[here], vertices, triangles, centre)
    return distance, nearest


def nearest_triangle(points: Float, vertices: Float, triangles: Int) -> NDArray[np.int64]:
    """(m,) index of the triangle that is nearest to each of (m, 3) finite points."""
    import open3d as o3d

    built = _Scene.of(vertices, triangles)
    local = o3d.core.Tensor.from_numpy((points - built.centre).astype(np.float32))
    return np.asarray(built.scene.compute_closest_points(local)["primitive_ids"].numpy().astype(np.int64))


class _Scene:
    """Open3D's tree of a mesh, about the mesh's own centre."""

    last: _Scene | None = None
    """The one that was made last: several methods, lasers and steps measure the same mesh."""

    def __init__(self, vertices: Float, triangles: Int) -> None:
        import open3d as o3d

        self.centre = (vertices.min(axis=0) + vertices.max(axis=0)) / 2
        self.scene: Any = o3d.t.geometry.RaycastingScene()
        corners = o3d.core.Tensor.from_numpy((vertices - self.centre).astype(np.float32))
        self.scene.add_triangles(corners, o3d.core.Tensor.from_numpy(triangles.astype(np.uint32)))
        self.mesh = weakref.ref(vertices, _forget), weakref.ref(triangles, _forget)

    @classmethod
    def of(cls, vertices: Float, triangles: Int) -> _Scene:
        """Of these very arrays, which nobody changes."""
        last = cls.last
        if last is None or last.mesh[0]() is not vertices or last.mesh[1]() is not triangles:
            last = cls.last = cls(vertices, triangles)
        return last


def _forget(_: object) -> None:
    """The mesh is gone, and so its tree."""
    _Scene.last = None


def _signed_distance(
    points: Float, vertices: Float, triangles: Int, camera_centre: Float
) -> tuple[Float, NDArray[np.int64]]:
    import open3d as o3d

    # open3d computes in float32: near the origin it names the right triangles, and float64 does the rest
    built = _Scene.of(vertices, triangles)
    scene, centre = built.scene, built.centre
    nearest = nearest_triangle(points, vertices, triangles)
    towards = points - camera_centre
    rays = np.concatenate([np.broadcast_to(camera_centre - centre, points.shape), towards], axis=1)
    seen = scene.cast_rays(o3d.core.Tensor.from_numpy(rays.astype(np.float32)))["primitive_ids"].numpy()
    distance = point_triangle_distance(points, vertices[triangles[nearest]])
    hit = seen != o3d.t.geometry.RaycastingScene.INVALID_ID
    a, b, c = np.moveaxis(vertices[triangles[np.where(hit, seen, 0)]], 1, 0)
    normal = np.cross(b - a, c - a)
    from_camera = np.einsum("ij,ij->i", a - camera_centre, normal)
    from_point = np.einsum("ij,ij->i", a - points, normal)
    return np.where(hit & (from_camera * from_point < 0.0), -distance, distance), nearest


def point_triangle_distance(points: Float, corners: Float) -> Float:
    """(m, 3) points, (m, 3, 3) corners -> (m,) distance from each point to its own triangle."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    best = np.minimum(np.minimum(_segment(points, a, b), _segment(points, b, c)), _segment(points, c, a))
    normal = np.cross(b - a, c - a)
    length = np.linalg.norm(normal, axis=1)
    flat = length > 0.0
    unit = normal / np.where(flat, length, 1.0)[:, None]
    inside = flat
    for start, end in ((a, b), (b, c), (c, a)):
        inside = inside & (np.einsum("ij,ij->i", np.cross(end - start, points - start), unit) >= 0.0)
    height = np.abs(np.einsum("ij,ij->i", points - a, unit))
    return np.where(inside, height, best)


def _segment(points: Float, start: Float, end: Float) -> Float:
    along = end - start
    squared = np.einsum("ij,ij->i", along, along)
    t = np.einsum("ij,ij->i", points - start, along) / np.where(squared > 0.0, squared, 1.0)
    return np.asarray(np.linalg.norm(points - start - np.clip(t, 0.0, 1.0)[:, None] * along, axis=1))


def triangle_normals(vertices: Float, triangles: NDArray[np.int32], which: NDArray[np.int64]) -> Float:
    """(m, 3) unit normals of triangles, NaN for -1."""
    normals = np.full((len(which), 3), np.nan)
    here = which >= 0
    corners = vertices[triangles[which[here]]]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(cross, axis=1, keepdims=True)
    normals[here] = cross / np.where(length > 0.0, length, np.nan)
    return normals
