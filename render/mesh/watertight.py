"""Whether a surface is closed with its normals outwards, as glass and media need, which fill what it encloses."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from render.base.arrays import Float
from render.base.errors import InputError
from render.mesh.mesh import Mesh

Int = NDArray[np.int64]

GAP = 1e-6
"""Distance, as a fraction of the mesh's size, below which vertices count as one."""


def closed_outward(mesh: Mesh, where: str) -> Mesh:
    """The mesh, turned inside out where its normals point inwards. InputError: open, or not consistently wound."""
    alone, unlike, edges = _loose_edges(mesh.triangles, mesh.vertices)
    if alone or unlike:
        size = float(np.ptp(mesh.vertices, axis=0).max())
        alone, unlike, edges = _loose_edges(mesh.triangles, np.rint(mesh.vertices / (GAP * size)))
    if alone or unlike:
        found = f"{alone} of {edges} edges are of one triangle only or of more than two" if alone else ""
        found = found or f"{unlike} of {edges} edges lie between triangles that face opposite ways"
        raise InputError(
            "a transparent or translucent material needs a closed surface, as it fills what that encloses",
            where=where,
            found=found,
            allowed="every edge shared by two triangles that face the same way",
            cure="close the holes (give a sheet a thickness), or choose an opaque material such as coated",
        )
    if signed_volume(mesh.vertices, mesh.triangles) >= 0.0:
        return mesh
    swap = [0, 2, 1]
    return dataclasses.replace(
        mesh,
        triangles=np.ascontiguousarray(mesh.triangles[:, swap]),
        uv=None if mesh.uv is None else np.ascontiguousarray(mesh.uv[:, swap]),
        normals=None if mesh.normals is None else np.ascontiguousarray(-mesh.normals[:, swap]),
    )


def signed_volume(vertices: Float, triangles: NDArray[np.int32]) -> float:
    """Volume that a closed surface encloses, m^3; negative if its normals point inwards."""
    a, b, c = (vertices[triangles[:, k]] - vertices[0] for k in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6.0


def _loose_edges(triangles: NDArray[np.int32], points: Float) -> tuple[int, int, int]:
    """Numbers of edges: not shared by two triangles; shared by two of inconsistent winding; in all."""
    _, place = np.unique(points, axis=0, return_inverse=True)
    corners = place.reshape(-1)[triangles].astype(np.int64)
    start, end = corners.ravel(), corners[:, [1, 2, 0]].ravel()
    kept = start != end
    start, end = start[kept], end[kept]
    count = int(place.max()) + 1
    edge = np.minimum(start, end) * count + np.maximum(start, end)
    order = np.argsort(edge)
    edge, forward = edge[order], (start < end)[order]
    first = np.flatnonzero(np.diff(edge, prepend=-1))
    uses = np.diff(first, append=len(edge))
    ahead = np.add.reduceat(forward.astype(np.int64), first)
    paired = uses == 2
    return int(np.count_nonzero(~paired)), int(np.count_nonzero(paired & (ahead != 1))), len(first)
