"""Polygons cut into triangles that cover them and nothing else."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from render.base.arrays import Float

Int = NDArray[np.int64]

TOLERANCE = 1e-6
"""Of a polygon's area: float32 coordinates put corners of one line beside it by less."""


def fan(corners: int) -> Int:
    """(corners - 2, 3) indices of the triangles around the first corner."""
    second = np.arange(1, corners - 1)
    return np.stack([np.zeros_like(second), second, second + 1], axis=1)


def fan_covers(points: Float) -> NDArray[np.bool_]:
    """(m,) whether the fan around its first corner covers each of m polygons of n corners, (m, n, 3), exactly.

    It does where every triangle of it turns the polygon's way, and all together less than once around the corner.
    A polygon without any area counts as covered.
    """
    spokes = points[:, 1:] - points[:, :1]
    normals = np.cross(spokes[:, :-1], spokes[:, 1:])
    whole = normals.sum(axis=1)
    sizes = np.linalg.norm(normals, axis=2)
    along = np.einsum("mtc,mc->mt", normals, whole)
    area = np.einsum("mc,mc->m", whole, whole)
    turn = np.arctan2(sizes, np.einsum("mtc,mtc->mt", spokes[:, :-1], spokes[:, 1:])).sum(axis=1)
    flat = np.einsum("mnc,mnc->mn", spokes, spokes).max(axis=1) * TOLERANCE
    # two halves of a figure of eight cancel, but are not small
    one_way = (along >= -TOLERANCE * area[:, None]).all(axis=1) & (area > (TOLERANCE * sizes.sum(axis=1)) ** 2)
    return np.asarray((one_way & (turn < 2.0 * np.pi + TOLERANCE)) | (sizes.sum(axis=1) <= flat))


def ear_cut(points: Float) -> Int | None:
    """(n - 2, 3) indices of triangles that cover one polygon, (n, 3), or None where none do: it crosses itself."""
    from vtkmodules.vtkCommonCore import vtkIdList
    from vtkmodules.vtkCommonDataModel import vtkPolygon

    polygon, found = vtkPolygon(), vtkIdList()
    polygon.GetPoints().SetNumberOfPoints(len(points))
    polygon.GetPointIds().SetNumberOfIds(len(points))
    for i, point in enumerate((points - points[0]).tolist()):
        polygon.GetPoints().SetPoint(i, *point)
        polygon.GetPointIds().SetId(i, i)
    if not polygon.EarCutTriangulation(found):
        return None
    triangles = np.array([found.GetId(i) for i in range(found.GetNumberOfIds())], dtype=np.int64).reshape(-1, 3)
    a, b, c = (points[triangles[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    whole = np.cross(points - points[0], np.roll(points, -1, axis=0) - points[0]).sum(axis=0)
    one_way = (normals @ whole >= -TOLERANCE * (whole @ whole)).all()
    return triangles if len(triangles) == len(points) - 2 and one_way else None
