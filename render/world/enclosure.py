"""Which bodies enclose a point, by the winding number of their surface (Van Oosterom and Strackee 1983)."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from render.base.arrays import Float, Int

if TYPE_CHECKING:
    from render.world.world import World


CLOSED = 0.9
"""Least winding number of a point inside a body: a closed surface gives an integer, an open one a fraction."""


def objects_around(world: World, items: Iterable[int], point: Float) -> list[int]:
    """Those of the objects `items` whose closed surface encloses the point (3,), world, m."""
    # only objects whose box holds the point can enclose it
    low, high = world.boxes
    inside = np.all((low <= point) & (point <= high), axis=1)
    boxed = [item for item in items if item < len(inside) and inside[item]]
    around = []
    for item in boxed:
        if abs(winding_number(world.vertices, world.triangles[world.object_id == item], point)) > CLOSED:
            around.append(item)
    return around


def winding_number(vertices: Float, triangles: Int, point: Float) -> float:
    """How often a surface (v, 3), (t, 3) goes around a point (3,): 1 inside a closed one wound outwards, 0 outside."""
    a, b, c = np.moveaxis(vertices[triangles] - point, 1, 0)
    la, lb, lc = (np.linalg.norm(x, axis=1) for x in (a, b, c))
    triple = np.einsum("ij,ij->i", a, np.cross(b, c))
    dots = np.einsum("ij,ij->i", a, b) * lc + np.einsum("ij,ij->i", b, c) * la + np.einsum("ij,ij->i", c, a) * lb
    return float(np.sum(2.0 * np.arctan2(triple, la * lb * lc + dots))) / (4.0 * math.pi)
