"""Dents and scratches pressed into a mesh, whose triangles are made finer where they lie.

A mark is a capsule about a segment (a dent: about a point). Within its radius the surface moves against the normal at
the mark's place, all of it the same way, so that a closed mesh stays closed.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from render.base.arrays import Bool, Float, Long
from render.base.errors import InputError
from render.mesh.mesh import Mesh
from render.scene.wear import Wear

ACROSS = 6
"""Edges across a dent or scratch, at least."""
MOST_TRIANGLES = 2_000_000
MOST_PASSES = 40
"""Of halving: from the largest mesh to the finest mark."""


@dataclasses.dataclass(frozen=True)
class Marks:
    """Capsules on a surface, m."""

    start: Float
    """(n, 3)"""
    end: Float
    """(n, 3)"""
    radius: Float
    """(n,)"""
    push: Float
    """(n, 3) how far the middle moves."""
    ridged: Bool
    """(n,) the section is a V, that of a scratch; else it is a smooth bowl."""


def worn(mesh: Mesh, wear: Wear, where: str) -> Mesh:
    """The mesh with its marks; without shading normals, which no longer fit.

    InputError: the marks are too fine for the mesh, as they would take more than MOST_TRIANGLES.
    """
    points, place = np.unique(mesh.vertices, axis=0, return_inverse=True)
    corners = place.reshape(-1)[mesh.triangles].astype(np.int64)  # a seam of the file must not open
    uv = None if mesh.uv is None else mesh.uv.astype(np.float64)
    marks = drawn_marks(points[corners], wear)
    _check_count(marks, where)
    points, corners, uv = refined(points, corners, uv, marks, where)
    return dataclasses.replace(
        mesh,
        vertices=np.ascontiguousarray(points + displacement(points, marks)),
        triangles=np.ascontiguousarray(corners, dtype=np.int32),
        uv=None if uv is None else np.ascontiguousarray(uv, dtype=np.float32),
        normals=None,
        smooth_normals=False,
    )


def drawn_marks(triangles: Float, wear: Wear) -> Marks:
    """Marks on triangles (t, 3, 3), each place as likely by area; scratches in all directions along the surface."""
    chance = np.random.default_rng(wear.seed)
    count = wear.dents + wear.scratches
    a, b, c = (triangles[:, k] for k in range(3))
    normals = np.cross(b - a, c - a)
    areas = np.linalg.norm(normals, axis=1)
    sums = np.cumsum(areas)
    drawn = chance.random((count, 4))
    chosen = np.minimum(np.searchsorted(sums, drawn[:, 0] * sums[-1], side="right"), len(areas) - 1)
    # uniform in a triangle by the root of one number (Turk 1990)
    root, other = np.sqrt(drawn[:, 1:2]), drawn[:, 2:3]
    middle = (1 - root) * a[chosen] + root * (1 - other) * b[chosen] + root * other * c[chosen]
    normal = normals[chosen] / np.maximum(areas[chosen, None], 1e-300)
    along = np.cross(normal, np.eye(3)[np.abs(normal).argmin(axis=1)])
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-300)
    angle = 2.0 * np.pi * drawn[:, 3:4]
    direction = np.cos(angle) * along + np.sin(angle) * np.cross(normal, along)
    scratch = np.arange(count) >= wear.dents
    half = np.where(scratch, wear.scratch_length / 2, 0.0)[:, None]
    radius = np.where(scratch, wear.scratch_width / 2, wear.dent_radius)
    depth = np.where(scratch, wear.scratch_depth, wear.dent_depth)[:, None]
    return Marks(middle - half * direction, middle + half * direction, radius, -depth * normal, scratch)


def displacement(points: Float, marks: Marks) -> Float:
    """(v, 3) points -> (v, 3) how far each moves, m; marks add up."""
    moved = np.zeros_like(points)
    for k in range(len(marks.radius)):
        off = _distance(points, marks.start[k], marks.end[k]) / marks.radius[k]
        near = off < 1.0
        share = 1.0 - off[near] if marks.ridged[k] else (1.0 - off[near] ** 2) ** 2
        moved[near] += share[:, None] * marks.push[k]
    return moved


def refined(
    points: Float, corners: Long, uv: Float | None, marks: Marks, where: str
) -> tuple[Float, Long, Float | None]:
    """Points (v, 3), triangles (t, 3) and uv (t, 3, 2) with every edge at a mark at most 1 / ACROSS of its width.

    Edges that are too long are halved, and each triangle is cut by which of its edges are, so that neighbours fit.
    """
    for _ in range(MOST_PASSES):
        ends = np.sort(np.stack([corners, np.roll(corners, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
        keys, edge_of = np.unique(ends[:, 0] * len(points) + ends[:, 1], return_inverse=True)
        edges = np.stack(np.divmod(keys, len(points)), axis=1)
        halved = _too_long(points[edges], marks)
        if not halved.any():
            return points, corners, uv
        middles = np.full(len(edges), -1)
        middles[halved] = len(points) + np.arange(int(halved.sum()))
        points = np.concatenate([points, points[edges[halved]].mean(axis=1)])
        corners, uv = _cut(corners, middles[edge_of.reshape(-1, 3)], uv, points)
        if len(corners) > MOST_TRIANGLES:
            break
    raise _too_fine(where)


def _check_count(marks: Marks, where: str) -> None:
    """InputError: the marks alone take too many triangles, which is known before any is cut."""
    length = np.linalg.norm(marks.end - marks.start, axis=1)
    area = 2.0 * marks.radius * length + np.pi * marks.radius**2
    if float(np.sum(2.0 * area / (2.0 * marks.radius / ACROSS) ** 2)) > MOST_TRIANGLES:
        raise _too_fine(where)


def _too_fine(where: str) -> InputError:
    return InputError(
        "the dents or scratches are too fine for the object",
        where=f"{where}: wear",
        found=f"more than {MOST_TRIANGLES} triangles",
        cure="make them wider or fewer",
    )


def _too_long(ends: Float, marks: Marks) -> Bool:
    """(e, 2, 3) ends of edges -> (e,) True where one meets a mark for which it is too long."""
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    middle = ends.mean(axis=1)
    halved = np.zeros(len(ends), np.bool_)
    for k in range(len(marks.radius)):
        longest = 2.0 * marks.radius[k] / ACROSS
        asked = np.flatnonzero(~halved & (length > longest))
        off = _distance(middle[asked], marks.start[k], marks.end[k])
        halved[asked[off < marks.radius[k] + length[asked] / 2]] = True
    return halved


def _cut(corners: Long, middle: Long, uv: Float | None, points: Float) -> tuple[Long, Float | None]:
    """Triangles (t, 3) cut at the middles (t, 3) of their edges, from each corner to the next; -1: not halved."""
    count = (middle >= 0).sum(axis=1)
    # so turned that a single halved edge is the first, and of two the one that is whole is the last
    turn = np.where(count == 1, np.argmax(middle >= 0, axis=1), np.where(count == 2, np.argmin(middle, axis=1) + 1, 0))
    order = (turn[:, None] + np.arange(3)) % 3
    corner, half = np.take_along_axis(corners, order, axis=1), np.take_along_axis(middle, order, axis=1)
    six = np.concatenate([corner, half], axis=1)
    place = None
    if uv is not None:
        place = np.take_along_axis(uv, order[..., None], axis=1)
        place = np.concatenate([place, (place + np.roll(place, -1, axis=1)) / 2], axis=1)
    first_shorter = np.zeros(len(corners), np.bool_)
    two = np.flatnonzero(count == 2)
    diagonals = points[six[two][:, [3, 4]]] - points[six[two][:, [2, 0]]]
    first_shorter[two] = np.diff(np.linalg.norm(diagonals, axis=2), axis=1)[:, 0] > 0.0
    pieces: list[tuple[Bool, list[list[int]]]] = [
        (count == 0, [[0, 1, 2]]),
        (count == 1, [[0, 3, 2], [3, 1, 2]]),
        ((count == 2) & first_shorter, [[3, 1, 4], [0, 3, 2], [3, 4, 2]]),
        ((count == 2) & ~first_shorter, [[3, 1, 4], [0, 3, 4], [0, 4, 2]]),
        (count == 3, [[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]]),
    ]
    triangles = np.concatenate([six[kept][:, piece] for kept, cut in pieces for piece in cut])
    if place is None:
        return triangles, None
    return triangles, np.concatenate([place[kept][:, piece] for kept, cut in pieces for piece in cut])


def _distance(points: Float, start: Float, end: Float) -> Float:
    """(v, 3) points -> (v,) distance from a segment."""
    along = end - start
    square = float(along @ along)
    if square == 0.0:
        return np.asarray(np.linalg.norm(points - start, axis=1))
    share = np.clip((points - start) @ along / square, 0.0, 1.0)
    return np.asarray(np.linalg.norm(points - start - share[:, None] * along, axis=1))
