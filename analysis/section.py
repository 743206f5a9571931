"""A plane through surfaces and clouds: where it cuts the one, and what lies near it of the other, in its own axes."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from render.base.arrays import Float, Int
from render.base.errors import InputError

UPRIGHT = math.cos(math.radians(5.0))
"""Of a normal's z: steeper planes have no up in them."""
CLOSE = 1e-9
"""m; ends of pieces that are one place."""


@dataclass(frozen=True)
class Plane:
    """Where a section is taken."""

    point: tuple[float, float, float]
    """m, world frame; any of the plane."""
    normal: tuple[float, float, float]
    """Of any length but zero."""

    @property
    def axes(self) -> Float:
        """(3, 3) rows: across, up, normal; unit, right-handed. Up is the world's z as far as the plane allows, else y.

        InputError: the normal has no direction.
        """
        normal = np.asarray(self.normal, dtype=np.float64)
        length = float(np.linalg.norm(normal))
        if not (math.isfinite(length) and length > 1e-12):
            raise InputError("the plane has no direction", found=str(self.normal), allowed="any normal but zero")
        normal = normal / length
        pole = np.array([0.0, 0.0, 1.0]) if abs(normal[2]) < UPRIGHT else np.array([0.0, 1.0, 0.0])
        across = np.cross(pole, normal)
        across /= np.linalg.norm(across)
        return np.stack([across, np.cross(normal, across), normal])

    @property
    def origin(self) -> Float:
        """(3,) m: the place nearest to the world's, so that heights in an upright section are those of the world."""
        normal = self.axes[2]
        return np.asarray((normal @ np.asarray(self.point)) * normal)

    def local(self, points: Float) -> Float:
        """(n, 3) m -> across, up, and how far off the plane."""
        return np.asarray((points - self.origin) @ self.axes.T)

    def world(self, local: Float) -> Float:
        """(n, 2) or (n, 3) m of its own axes -> (n, 3)."""
        return np.asarray(self.origin + local @ self.axes[: local.shape[1]])

    def sheet(self, low: Float, high: Float) -> Float:
        """(4, 3) corners of the least rectangle of it, along its axes, before and behind which the box (3,) (3,) is."""
        corners = np.stack(np.meshgrid(*np.stack([low, high], axis=1), indexing="ij"), axis=-1).reshape(-1, 3)
        (left, down), (right, up) = (edge(self.local(corners)[:, :2], axis=0) for edge in (np.min, np.max))
        return self.world(np.array([[left, down], [right, down], [right, up], [left, up]]))


def cut(vertices: Float, triangles: Int, plane: Plane) -> list[Float]:
    """Polylines (n, 2) across and up, m, in which a plane cuts (v, 3), (t, 3); closed ones end where they begin.

    By VTK's cutter, whose pieces are joined where they meet.
    """
    import pyvista

    if len(triangles) == 0:
        return []
    # in the plane's own axes: the cutter then works about the place, in double precision
    local = plane.local(vertices)
    mesh = pyvista.PolyData.from_regular_faces(local, np.asarray(triangles, dtype=np.int64))
    lines = mesh.slice(normal=(0.0, 0.0, 1.0), origin=(0.0, 0.0, 0.0), generate_triangles=False)
    if lines.n_cells == 0:
        return []
    places, ends = _merged(np.asarray(lines.points, dtype=np.float64), lines.lines.reshape(-1, 3)[:, 1:])
    pieces = np.column_stack([np.full(len(ends), 2), ends]).astype(np.int64)
    joined = pyvista.PolyData(places, lines=pieces.ravel()).strip(join=True, max_length=10_000_000)
    places = np.asarray(joined.points, dtype=np.float64)[:, :2]
    cells, at, made = np.asarray(joined.lines), 0, []
    while at < len(cells):
        count = int(cells[at])
        made.append(places[cells[at + 1 : at + 1 + count]])
        at += count + 1
    return made


def _merged(places: Float, ends: Int) -> tuple[Float, Int]:
    """Places (n, 3) and pieces (m, 2) between them, with one for all that are CLOSE; pieces of no length left out.

    VTK's own way took 48 s for the 7,000 pieces along the seam of the sample.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    pairs = cKDTree(places).query_pairs(CLOSE, output_type="ndarray")
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(places), len(places)))
    _, label = connected_components(graph, directed=False)
    _, first = np.unique(label, return_index=True)
    merged = label[ends]
    return places[first], merged[merged[:, 0] != merged[:, 1]]


def near(points: Float, plane: Plane, thickness: float) -> tuple[NDArray[np.intp], Float]:
    """The (k,) points of (n, 3) within half of `thickness` m of a plane, and their (k, 3) `Plane.local`."""
    local = plane.local(points)
    here = np.flatnonzero(np.abs(local[:, 2]) <= 0.5 * thickness)
    return here, local[here]
