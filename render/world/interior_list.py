"""The interior list of a path: the overlapping transparent bodies that it is inside, one bit each.

Schmidt and Budge (2002) carry a list of interiors with priorities. Here bodies are ranked by priority, and the list is
an integer, `interior`, whose bit k is the body of rank k + 1; the highest bit is the substance at that point. At a
boundary between two bodies the relative index is that of the one over that of the other. A boundary inside a body of a
higher rank is hidden: paths and shadow rays pass through it unchanged.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numba
import numpy as np
from numpy.typing import NDArray

from render.base.arrays import Float, Float32, Int, Long
from render.base.vectors import along, dot, minus, plus, store, vector
from render.material.bsdf import DIELECTRIC, ROW, SUBSURFACE
from render.world.embree import RayScene
from render.world.enclosure import objects_around
from render.world.triangles import Surface, off_surface, plane_of

if TYPE_CHECKING:
    from render.world.world import World


RANK, RANKED = ROW, ROW + 1
"""Columns after a material's row. RANK: rank of its body from 1, or 0 if it overlaps none. RANKED, in row k: the
material of the body of rank k + 1.
"""
COLUMNS = ROW + 2


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def bit_of(rows: Float, slot: int) -> int:
    """The bit of a material's body in an interior list; 0: it overlaps no other."""
    rank = int(rows[slot, RANK])
    return 1 << (rank - 1) if rank > 0 else 0


@numba.njit(nogil=True, cache=True, error_model="numpy")
def substance(rows: Float, interior: int) -> int:
    """The material at the end of a path: that of the highest bit; -1: none of the overlapping bodies."""
    rank = -1
    while interior > 0:
        interior >>= 1
        rank += 1
    return int(rows[rank, RANKED]) if rank >= 0 else -1


@numba.njit(nogil=True, cache=True, error_model="numpy")
def medium_within(rows: Float, interior: int) -> int:
    """The material at the end of a path if it is a scattering medium; else -1."""
    slot = substance(rows, interior)
    return slot if slot >= 0 and rows[slot, 0] == SUBSURFACE else -1


@numba.njit(nogil=True, cache=True, error_model="numpy")
def index_beside(rows: Float, outside: int) -> float:
    """Refractive index on the outer side of a boundary; outside: the interior list there, without the body itself."""
    slot = substance(rows, outside)
    return float(rows[slot, 3]) if slot >= 0 else 1.0


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def is_hidden(rows: Float, slot: int, interior: int) -> bool:
    """A boundary of this material is inside a body of a higher rank."""
    bit = bit_of(rows, slot)
    return bit > 0 and (interior & ~bit) > bit


@numba.njit(nogil=True, cache=True, error_model="numpy")
def hidden_hits(surface: Surface, triangle: Int, interior: Long) -> Long:
    """(n,) hit triangles, -1 for none, of rays with (n,) interior lists -> (m,) indices of those that are hidden."""
    out, count = np.empty(triangle.shape[0], np.int64), 0
    for r in range(triangle.shape[0]):
        t = triangle[r]
        if t >= 0 and is_hidden(surface.rows, surface.object_id[t], interior[r]):
            out[count] = r
            count += 1
    return out[:count].copy()


@numba.njit(nogil=True, cache=True, error_model="numpy")
def cross_boundary(surface: Surface, t: int, centre: Float, offset: float, origin: Any, direction: Any) -> int:
    """Move a ray's origin (3,), relative to `centre`, to the far side of triangle t; returns the bit that this changes.

    Positive: the ray has entered the body; negative: it has left it.
    """
    a0, a1, a2, n0, n1, n2 = plane_of(surface, t)
    normal, middle, d = (n0, n1, n2), vector(centre), vector(direction)
    o = plus(vector(origin), middle)
    cosine = dot(normal, d)
    s = dot(normal, minus((a0, a1, a2), o)) / cosine if cosine != 0.0 else 0.0
    beyond = off_surface(along(o, s, d), normal, offset if cosine > 0.0 else -offset)
    store(origin, minus(beyond, middle))
    bit = bit_of(surface.rows, surface.object_id[t])
    return bit if cosine < 0.0 else -bit


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def changed(interior: int, bit: int) -> int:
    """The interior list after `cross_boundary` returned this bit."""
    return interior | bit if bit > 0 else interior & ~(-bit)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def cross_all(
    surface: Surface, triangle: Int, centre: Float, offset: float, start: Float32, direction: Float32, interior: Long
) -> Float:
    """Move rays (m, 3) to the far side of the triangles (m,) that they hit; returns the distances moved, (m,) m."""
    moved = np.empty(triangle.shape[0])
    for r in range(triangle.shape[0]):
        o0, o1, o2 = float(start[r, 0]), float(start[r, 1]), float(start[r, 2])
        interior[r] = changed(interior[r], cross_boundary(surface, triangle[r], centre, offset, start[r], direction[r]))
        moved[r] = math.sqrt((start[r, 0] - o0) ** 2 + (start[r, 1] - o1) ** 2 + (start[r, 2] - o2) ** 2)
    return moved


def has_overlaps(surface: Surface) -> bool:
    """Some transparent bodies overlap."""
    return bool(np.any(surface.rows[:, RANK] > 0.0))


def surroundings(world: World, surface: Surface, point: Float) -> tuple[int, float]:
    """Interior list and refractive index at the point where paths begin, (3,) world, m."""
    bodies = np.flatnonzero(np.isin(surface.rows[:, 0], (DIELECTRIC, SUBSURFACE)))
    around = objects_around(world, bodies.tolist(), point)
    interior = sum(bit_of(surface.rows, item) for item in around)
    # a body that overlaps no other is the only one there
    slot = substance(surface.rows, interior) if interior else next(iter(around), -1)
    return interior, float(surface.rows[slot, 3]) if slot >= 0 else 1.0


def pass_hidden(
    surface: Surface, rays: RayScene, origin: Float32, direction: Float32, triangle: Int, interior: Long
) -> None:
    """Replace the hits (n,) of rays (n, 3), scene-centred, by their first hits that are not hidden.

    triangle and interior (n,) are changed in place; origins are not, so that distances stay those from the origin.
    """
    hidden = hidden_hits(surface, triangle, interior)
    start, towards = origin[hidden], direction[hidden]
    while len(hidden):
        within = interior[hidden]
        cross_all(surface, triangle[hidden], rays.centre, rays.surface_offset, start, towards, within)
        interior[hidden] = within
        triangle[hidden] = rays.intersect(start, towards)[0]
        again = hidden_hits(surface, triangle[hidden], within)
        hidden, start, towards = hidden[again], start[again], towards[again]


def cross_hidden(
    surface: Surface,
    rays: RayScene,
    which: Int,
    origin: Any,
    direction: Any,
    triangle: Int,
    interior: Long,
    centre: Float,
) -> Int:
    """Move those of the rays `which` that hit a hidden boundary beyond it; returns their indices.

    origin, relative to `centre` (3,), and interior (n, ...) are changed in place.
    """
    hidden = which[hidden_hits(surface, triangle[which], interior[which])]
    start, within = origin[hidden], interior[hidden]
    cross_all(surface, triangle[hidden], centre, rays.surface_offset, start, direction[hidden], within)
    origin[hidden], interior[hidden] = start, within
    return hidden


def occluded_by_visible(
    surface: Surface, rays: RayScene, origin: Float32, direction: Float32, far: Float32, interior: Long
) -> NDArray[np.bool_]:
    """Shadow rays (n, 3), scene-centred, of length (n,), with (n,) interior lists -> (n,) blocked by a visible hit."""
    blocked = rays.occluded(origin, direction, far.copy())
    at = np.flatnonzero(blocked)
    start, towards, left, within = origin[at], direction[at], far[at].astype(np.float64), interior[at]
    while len(at):
        triangle, _ = rays.intersect(start, towards, left.astype(np.float32))
        blocked[at] = triangle >= 0
        hidden = hidden_hits(surface, triangle, within)
        at, start, towards, left, within = at[hidden], start[hidden], towards[hidden], left[hidden], within[hidden]
        left = left - cross_all(surface, triangle[hidden], rays.centre, rays.surface_offset, start, towards, within)
        ended = left <= 0.0
        blocked[at[ended]] = False
        at, start, towards, left, within = (part[~ended] for part in (at, start, towards, left, within))
    return blocked
