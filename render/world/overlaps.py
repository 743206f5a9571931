"""Which transparent bodies overlap or touch, and their ranks: where bodies overlap, the highest priority counts.

Where bodies overlap, as water drawn a little into the wall of its glass, priorities decide which substance is there
(Schmidt and Budge 2002, "Simple nested dielectrics in ray traced images"). Only bodies that overlap another have a
rank; the others cost nothing. Touching surfaces are refused, since rounding decides which of them a ray hits first.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from render.base.arrays import Float, Int
from render.material.material import Glass, Subsurface
from render.world.embree import RayScene
from render.world.enclosure import winding_number

if TYPE_CHECKING:
    from render.world.world import World


MOST_BODIES = 62
"""Largest number of overlapping bodies in a scene: one bit each of the interior list, an int64."""
INSET = 0.02
"""Fraction of the way from a triangle's corners to its middle at which its contact with a body is tested."""
PARALLEL = 1.0 - 1e-4
"""Least cosine between the normals of two touching facets, which tells contact from crossing."""


@dataclass(frozen=True)
class Nesting:
    """The transparent bodies that overlap or touch others, by the index of their object."""

    overlapping: tuple[tuple[int, int], ...]
    """Pairs of overlapping bodies, the smaller index first."""
    touching: tuple[tuple[int, int], ...]
    """Pairs of bodies with facets that coincide, or lie nearer than the offset of rays."""
    ranked: tuple[int, ...]
    """The overlapping bodies in ascending priority: where several are, the last counts."""


def nesting_of(world: World) -> Nesting:
    """Overlaps and contacts of all pairs of transparent bodies: of glass or with a subsurface medium."""
    overlapping, touching = [], []
    boxes = {
        item: _corners(world, item)
        for item, material in enumerate(world.materials)
        if isinstance(material, Glass | Subsurface)
    }
    bodies: dict[int, _Body] = {}
    # a little more than the offset of rays, which is known only once the whole scene's BVH is built
    margin = 2e-6 * float(np.ptp(world.vertices, axis=0).max()) if len(boxes) > 1 else 0.0
    for a, b in combinations(boxes, 2):
        if np.any(np.maximum(boxes[a][0], boxes[b][0]) > np.minimum(boxes[a][1], boxes[b][1]) + margin):
            continue
        near = world.rays.surface_offset
        for item in (a, b):
            if item not in bodies:
                bodies[item] = _Body.of(world, item)
        if bodies[a].touches(bodies[b], near) or bodies[b].touches(bodies[a], near):
            touching.append((a, b))
        if bodies[a].overlaps(bodies[b]):
            overlapping.append((a, b))
    found = {item for pair in overlapping for item in pair}
    return Nesting(tuple(overlapping), tuple(touching), tuple(sorted(found, key=lambda i: (priority_of(world, i), i))))


def priority_of(world: World, item: int) -> int:
    """Priority of a transparent body; 0 for every other object."""
    material = world.materials[item]
    return material.priority if isinstance(material, Glass | Subsurface) else 0


@dataclass(frozen=True)
class _Body:
    """One closed surface, ready for rays."""

    vertices: Float
    triangles: Int
    rays: RayScene

    @classmethod
    def of(cls, world: World, item: int) -> _Body:
        used, index = np.unique(world.triangles[world.object_id == item], return_inverse=True)
        vertices, triangles = world.vertices[used], np.asarray(index.reshape(-1, 3), dtype=np.int32)
        return cls(vertices, triangles, RayScene(vertices, triangles))

    def overlaps(self, other: _Body) -> bool:
        """The surfaces cross, or one body is within the other."""
        if self.crosses(other) or other.crosses(self):
            return True
        inside = winding_number(other.vertices, other.triangles, self.vertices[0])
        around = winding_number(self.vertices, self.triangles, other.vertices[0])
        return max(abs(inside), abs(around)) > 0.5

    def crosses(self, other: _Body) -> bool:
        """Some edge passes through the other's surface."""
        edges = np.sort(self.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
        start, end = np.moveaxis(self.vertices[np.unique(edges, axis=0)], 1, 0)
        low, high = other.vertices.min(axis=0), other.vertices.max(axis=0)
        near = np.all((np.minimum(start, end) <= high) & (np.maximum(start, end) >= low), axis=1)
        start, end = start[near], end[near]
        length = np.linalg.norm(end - start, axis=1)
        start, end, length = start[length > 0.0], end[length > 0.0], length[length > 0.0]
        towards = ((end - start) / length[:, None]).astype(np.float32)
        far = length.astype(np.float32)
        return bool(np.any(other.rays.occluded((start - other.rays.centre).astype(np.float32), towards, far)))

    def touches(self, other: _Body, near: float) -> bool:
        """Some facet lies on one of the other's, within `near` m."""
        corners = self.vertices[self.triangles]
        low, high = other.vertices.min(axis=0) - near, other.vertices.max(axis=0) + near
        corners = corners[np.all((corners.min(axis=1) <= high) & (corners.max(axis=1) >= low), axis=1)]
        normals = _unit_normals(corners)
        middle = corners.mean(axis=1, keepdims=True)
        points = np.concatenate([middle, (1.0 - INSET) * corners + INSET * middle], axis=1)
        along = np.repeat(normals, points.shape[1], axis=0)
        start = (points.reshape(-1, 3) + near * along - other.rays.centre).astype(np.float32)
        far = np.full(len(start), 2.0 * near, np.float32)
        triangle, _ = other.rays.intersect(start, (-along).astype(np.float32), far)
        hit = triangle >= 0
        theirs = _unit_normals(other.vertices[other.triangles[triangle[hit]]])
        return bool(np.any(np.abs(np.einsum("ij,ij->i", theirs, along[hit])) > PARALLEL))


def _corners(world: World, item: int) -> tuple[Float, Float]:
    """Lowest and highest corner of an object's box."""
    used = world.triangles[world.object_id == item]
    # an object's vertices are contiguous
    points = world.vertices[used.min() : used.max() + 1]
    return points.min(axis=0), points.max(axis=0)


def _unit_normals(corners: Float) -> Float:
    """(n, 3, 3) corners -> (n, 3), 0 for triangles without area."""
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return np.asarray(normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300))
