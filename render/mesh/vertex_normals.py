"""Normals at the corners of triangles, so that a faceted surface is shaded as the curved one that it stands for."""

from __future__ import annotations

import math

import numba
import numpy as np

from render.base.arrays import Float, Float32, Int


def corner_normals(vertices: Float, triangles: Int, crease_angle: float) -> Float32:
    """(v, 3) m, (t, 3) -> (t, 3, 3) unit normals of each triangle's corners.

    The mean of the facets that meet there, weighted by their angles (Thuermer, Wuethrich 1998), over those within
    crease_angle (rad) of the corner's own facet. Vertices at the same position count as one.
    """
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    facets = np.cross(b - a, c - a)
    facets /= np.maximum(np.linalg.norm(facets, axis=1, keepdims=True), 1e-300)
    weights = np.stack([_angle(b - a, c - a), _angle(c - b, a - b), _angle(a - c, b - c)], axis=1)
    _, place = np.unique(vertices, axis=0, return_inverse=True)
    corners = place.reshape(-1)[triangles].ravel()
    order = np.argsort(corners, kind="stable").astype(np.int64)
    starts = np.flatnonzero(np.diff(corners[order], prepend=-1)).astype(np.int64)
    normals = np.empty((len(triangles), 3, 3), dtype=np.float32)
    _gather(facets, weights.ravel(), order, np.append(starts, len(order)), math.cos(crease_angle), normals)
    return normals


def _angle(x: Float, y: Float) -> Float:
    return np.arctan2(np.linalg.norm(np.cross(x, y), axis=1), np.einsum("ij,ij->i", x, y))


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _gather(facets: Float, weights: Float, order: Int, starts: Int, least: float, normals: Float32) -> None:
    """Corners `order`, by places that begin at `starts` -> normals."""
    mean = np.empty(3)
    for place in range(starts.shape[0] - 1):
        first, last = starts[place], starts[place + 1]
        mean[:] = 0.0
        for j in range(first, last):
            mean += weights[order[j]] * facets[order[j] // 3]
        mean /= max(math.sqrt(mean[0] ** 2 + mean[1] ** 2 + mean[2] ** 2), 1e-300)
        # where all lie within half the angle of the mean, all are within the angle of each other
        worst = 1.0
        for j in range(first, last):
            n = facets[order[j] // 3]
            worst = min(worst, n[0] * mean[0] + n[1] * mean[1] + n[2] * mean[2])
        together = 2.0 * worst * worst - 1.0 >= least and worst > 0.0
        for j in range(first, last):
            t, corner = order[j] // 3, order[j] % 3
            own = facets[t]
            if not together:
                mean[:] = 0.0
                for k in range(first, last):
                    n = facets[order[k] // 3]
                    if n[0] * own[0] + n[1] * own[1] + n[2] * own[2] >= least - 1e-12:
                        mean += weights[order[k]] * n
                mean /= max(math.sqrt(mean[0] ** 2 + mean[1] ** 2 + mean[2] ** 2), 1e-300)
            cosine = mean[0] * own[0] + mean[1] * own[1] + mean[2] * own[2]
            for axis in range(3):
                # a mean that points away from its own facet is replaced by the facet's normal
                normals[t, corner, axis] = mean[axis] if cosine > 0.0 else own[axis]
