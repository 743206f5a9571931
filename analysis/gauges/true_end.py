"""Where a surface of the part itself ends: along the mesh in the section, whatever scan lines meet it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from render.base.arrays import Float
from render.base.pose import transform_points
from render.frame import LaserCurve

CLOSE = 1e-9
"""m; ends of pieces that are one place."""
AT_FAN = 1.0 - 1e-9
"""Of the tangent of half the fan, from which on a piece ends there."""
STEEP = 5.0
"""Rise over run against the surface, from which on a piece is of a wall: along a flatter one points make no jump."""
STRAIGHT, CORNER = math.radians(1.0), math.radians(30.0)
"""Turns from piece to piece: below the one a surface or a wall goes straight on, above the other it has a corner."""
ROOM = 1.5
"""Distances of scan lines, from the last on the surface, within which it ends: the next one does not meet it."""
HITS = 8
"""Scan lines from the edge inwards, of which the first may meet the wall."""
NOT_KNOWN = "no truth: where the surface ends in the region {!r} is not known"
GOES_ON = "no truth: the surface goes on where its points end in the region {!r}, hidden, unlit or outside the image"
FAN_ENDS = "no truth: the laser's fan ends in the region {!r}, and not the part"
BENDS = "no truth: the surface bends away in the region {!r} before it ends, and has its edge nowhere in particular"


@dataclass(frozen=True)
class TrueSection:
    """What the sheet cuts of the mesh, in a profile's coordinates, hidden or not; m."""

    pieces: Float = field(default_factory=lambda: np.zeros((0, 2, 2)))
    """(k, 2, 2): both ends of each, across the fan and height."""
    clipped: NDArray[np.bool_] = field(default_factory=lambda: np.zeros((0, 2), dtype=np.bool_))
    """(k, 2) whether an end is one of the laser's fan."""


def true_section(curve: LaserCurve, T_section_world: Float, T_laser_world: Float, tan_half_fan: float) -> TrueSection:
    """Of the exact line of a laser. Poses (4, 4)."""
    there = transform_points(T_section_world, curve.segments)
    laser = transform_points(T_laser_world, curve.segments)
    clipped = np.abs(laser[..., 1]) >= AT_FAN * tan_half_fan * laser[..., 2]
    return TrueSection(np.stack([there[..., 1], -there[..., 2]], axis=-1), clipped)


def surface_end(
    section: TrueSection, hits: Float, foot: Float, outwards: Float, reach: float, pitch: float
) -> Float | str:
    """(2,) m, where the surface ends beyond (n, 2) points of it, from the edge inwards; or why that is not known.

    foot: (2,) of the first point on the surface's line; outwards: (2,) unit, along that to the end; reach: m, within
    which what is beside the line still is of the surface; pitch: m, from point to point. The words have a place for the
    region's name.
    """
    axes = np.stack([outwards, [-outwards[1], outwards[0]]])
    local = (section.pieces - foot) @ axes.T
    for hit in (hits[:HITS] - foot) @ axes.T:
        under = [k for k in np.flatnonzero(_distance(local, hit) <= CLOSE).tolist() if not _is_wall(local[k])]
        if under:
            found = _followed(local, section.clipped, under[0], reach, ROOM * pitch)
            if isinstance(found, str):
                return found
            return foot + found @ axes if found[0] >= -reach else NOT_KNOWN
    return NOT_KNOWN


def _followed(local: Float, clipped: NDArray[np.bool_], first: int, reach: float, room: float) -> Float | str:
    """(2,) the end of a surface, followed outwards from one of the pieces (k, 2, 2), along and off its line.

    It ends where its pieces do, or where a wall begins that leads away from it.
    """
    left = np.ones(len(local), dtype=np.bool_)
    k, far = first, int(np.argmax(local[first, :, 0]))
    direction, wall, bend, turned = np.array([1.0, 0.0]), None, local[first, far], 0.0
    while True:
        left[k] = False
        start, end = local[k, 1 - far], local[k, far]
        turn = _angle(direction, end - start)
        if turn > STRAIGHT:
            bend, turned = start, turn
        direction = end - start
        steep = direction[0] <= 0.0 or _is_wall(local[k])
        wall = (start if wall is None else wall) if steep else None
        if abs(end[1]) > reach:
            gone = bend if wall is None else wall
            return BENDS if wall is None and turned < CORNER else gone
        if clipped[k, far]:
            return FAN_ENDS
        if wall is None and end[0] > room:
            return GOES_ON
        on = np.argwhere(left[:, None] & (np.linalg.norm(local - end, axis=2) <= CLOSE))
        if len(on) == 0:
            return end if wall is None else wall
        turns = [_angle(direction, local[i, 1 - side] - local[i, side]) for i, side in on.tolist()]
        k, far = int(on[int(np.argmin(turns)), 0]), 1 - int(on[int(np.argmin(turns)), 1])


def _is_wall(piece: Float) -> bool:
    run, rise = np.abs(piece[1] - piece[0])
    return bool(rise >= STEEP * run)


def _angle(a: Float, b: Float) -> float:
    return abs(math.atan2(a[0] * b[1] - a[1] * b[0], float(a @ b)))


def _distance(pieces: Float, place: Float) -> Float:
    """(k,) m, from (k, 2, 2) pieces to a place (2,)."""
    along = pieces[:, 1] - pieces[:, 0]
    length = np.maximum(np.einsum("ij,ij->i", along, along), CLOSE**2)
    t = np.clip(np.einsum("ij,ij->i", place - pieces[:, 0], along) / length, 0.0, 1.0)
    return np.asarray(np.linalg.norm(pieces[:, 0] + t[:, None] * along - place, axis=1))
