"""Signed distance from points to a mesh, in float64: positive on the camera's side of the surface it sees."""

from __future__ import annotations

import weakref
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from render.base.arrays import Float, Int

FEW = 50_000
"""Points: more are found sooner by Open3D, which takes a second to be loaded and a twelfth of VTK's time a point."""
SLIT = 1e-12
"""Of the mesh's extent: how far beside a triangle a ray still meets it."""


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
    return _tree_for(len(points), vertices, triangles).nearest(points)


class _Locator:
    """VTK's buckets of a mesh, in float64: ready in a tenth of the time of Open3D's tree, but asked point by point."""

    last: ClassVar[_Locator | None] = None
    """The one that was made last: several methods, lasers and steps measure the same mesh."""

    def __init__(self, vertices: Float, triangles: Int) -> None:
        from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
        from vtkmodules.vtkCommonCore import vtkPoints
        from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData, vtkStaticCellLocator

        self.mesh = weakref.ref(vertices, _forget), weakref.ref(triangles, _forget)
        corners, cells, mesh = vtkPoints(), vtkCellArray(), vtkPolyData()
        corners.SetData(numpy_to_vtk(np.ascontiguousarray(vertices, dtype=np.float64), deep=1))
        cells.SetData(3, numpy_to_vtkIdTypeArray(np.ascontiguousarray(triangles, dtype=np.int64).ravel(), deep=1))
        mesh.SetPoints(corners)
        mesh.SetPolys(cells)
        self.extent = float(np.linalg.norm(np.ptp(vertices, axis=0)))
        self.middle = (vertices.min(axis=0) + vertices.max(axis=0)) / 2
        self.locator: Any = vtkStaticCellLocator()
        self.locator.SetDataSet(mesh)
        self.locator.BuildLocator()

    def nearest(self, points: Float) -> NDArray[np.int64]:
        """(m, 3) -> (m,) triangle."""
        from vtkmodules.vtkCommonCore import mutable
        from vtkmodules.vtkCommonDataModel import vtkGenericCell

        number: Any = mutable(0)
        cell, part, squared, there = vtkGenericCell(), mutable(0), mutable(0.0), [0.0, 0.0, 0.0]
        found = np.empty(len(points), np.int64)
        for i, point in enumerate(points.tolist()):
            self.locator.FindClosestPoint(point, there, cell, number, part, squared)
            found[i] = number.get()
        return found

    def seen(self, origins: Float, directions: Float) -> NDArray[np.int64]:
        """(m, 3) rays without an end -> (m,) first triangle, or -1."""
        from vtkmodules.vtkCommonCore import mutable
        from vtkmodules.vtkCommonDataModel import vtkGenericCell

        number: Any = mutable(0)
        cell, part, share, spots = vtkGenericCell(), mutable(0), mutable(0.0), [[0.0] * 3, [0.0] * 3]
        reach = self.extent + np.linalg.norm(origins - self.middle, axis=1)
        ends = origins + directions * (reach / np.linalg.norm(directions, axis=1))[:, None]
        found = np.full(len(origins), -1, np.int64)
        for i, (start, end) in enumerate(zip(origins.tolist(), ends.tolist(), strict=True)):
            # what slips between two triangles for rounding is caught by one of them
            if self.locator.IntersectWithLine(start, end, SLIT * self.extent, share, *spots, part, number, cell):
                found[i] = number.get()
        return found


class _Raycasting:
    """Open3D's tree of a mesh, about the mesh's own centre, as it computes in float32: quick for many points."""

    last: ClassVar[_Raycasting | None] = None
    """As `_Locator.last`."""

    def __init__(self, vertices: Float, triangles: Int) -> None:
        import open3d as o3d

        self.mesh = weakref.ref(vertices, _forget), weakref.ref(triangles, _forget)
        self.centre = (vertices.min(axis=0) + vertices.max(axis=0)) / 2
        self.scene: Any = o3d.t.geometry.RaycastingScene()
        corners = o3d.core.Tensor.from_numpy((vertices - self.centre).astype(np.float32))
        self.scene.add_triangles(corners, o3d.core.Tensor.from_numpy(triangles.astype(np.uint32)))

    def nearest(self, points: Float) -> NDArray[np.int64]:
        """As `_Locator.nearest`."""
        import open3d as o3d

        local = o3d.core.Tensor.from_numpy((points - self.centre).astype(np.float32))
        return np.asarray(self.scene.compute_closest_points(local)["primitive_ids"].numpy().astype(np.int64))

    def seen(self, origins: Float, directions: Float) -> NDArray[np.int64]:
        """As `_Locator.seen`."""
        import open3d as o3d

        rays = np.concatenate([origins - self.centre, directions], axis=1)
        seen = self.scene.cast_rays(o3d.core.Tensor.from_numpy(rays.astype(np.float32)))["primitive_ids"].numpy()
        return np.where(seen == o3d.t.geometry.RaycastingScene.INVALID_ID, -1, seen.astype(np.int64))


def _tree_for(points: int, vertices: Float, triangles: Int) -> _Locator | _Raycasting:
    """Of these very arrays, which nobody changes."""
    kind: type[_Locator | _Raycasting] = _Locator if points <= FEW else _Raycasting
    last = kind.last
    if last is None or last.mesh[0]() is not vertices or last.mesh[1]() is not triangles:
        last = kind(vertices, triangles)
        kind.last = last
    return last


def _forget(_: object) -> None:
    """The mesh is gone, and so its trees."""
    _Locator.last = _Raycasting.last = None


def _signed_distance(
    points: Float, vertices: Float, triangles: Int, camera_centre: Float
) -> tuple[Float, NDArray[np.int64]]:
    tree = _tree_for(len(points), vertices, triangles)
    nearest = tree.nearest(points)
    seen = tree.seen(np.broadcast_to(camera_centre, points.shape), points - camera_centre)
    distance = point_triangle_distance(points, vertices[triangles[nearest]])
    hit = seen >= 0
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
