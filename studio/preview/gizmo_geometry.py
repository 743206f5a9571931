"""The arithmetic of a gizmo: which handle is under the mouse, and how far a drag moves or turns, from the view's rays.

A drag asks where the ray through the mouse comes nearest to the axis (or meets the plane), at its start and now: what
is under the mouse stays under the mouse.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from render.base.arrays import Float
from render.base.pose import rotation_matrix
from studio.preview.view_camera import Eye

Kind = Literal["axis", "plane", "ring"]

ARM_PX, RING_PX, PLANE_PX = 92.0, 74.0, 26.0
"""Lengths of the handles on the screen."""
REACH_PX, TOUCH_PX = 8.0, 3.0
"""How near the mouse must be; nearer than the second, a line goes before a square."""
EDGE_ON = 0.12
"""A plane or ring seen at less than this sine is not offered: the mouse could not say how far."""


@dataclass(frozen=True)
class Handle:
    """axis: move along it; plane: move across it; ring: turn about it. `axis` is 0, 1 or 2."""

    kind: Kind
    axis: int


HANDLES = tuple(Handle(kind, axis) for kind in ("axis", "plane", "ring") for axis in range(3))


@dataclass(frozen=True)
class Frame:
    """Where the gizmo stands: centre (3,) m, axes (3, 3) as columns, and the length of one pixel there, m."""

    centre: Float
    axes: Float
    pixel: float


def plane_corners(frame: Frame, axis: int) -> Float:
    """(4, 3) the small square of a plane handle."""
    a, b = frame.axes[:, (axis + 1) % 3], frame.axes[:, (axis + 2) % 3]
    near, far = 0.9 * PLANE_PX * frame.pixel, 1.7 * PLANE_PX * frame.pixel
    return np.array([frame.centre + s * a + t * b for s, t in ((near, near), (far, near), (far, far), (near, far))])


def ring_points(frame: Frame, axis: int, count: int = 73) -> Float:
    """(n, 3) a closed circle about an axis."""
    a, b = frame.axes[:, (axis + 1) % 3], frame.axes[:, (axis + 2) % 3]
    turn = np.linspace(0.0, 2.0 * math.pi, count)[:, None]
    return np.asarray(frame.centre + RING_PX * frame.pixel * (np.cos(turn) * a + np.sin(turn) * b))


def arm_end(frame: Frame, axis: int) -> Float:
    """(3,) tip of an axis handle."""
    return np.asarray(frame.centre + ARM_PX * frame.pixel * frame.axes[:, axis])


def offered(frame: Frame, eye: Eye, handle: Handle) -> bool:
    """Whether the mouse can say how far, from where the eye stands."""
    sight = eye.rotation[:, 2] if eye.parallel else eye.position - frame.centre
    along = abs(float(frame.axes[:, handle.axis] @ sight) / float(np.linalg.norm(sight)))
    return math.sqrt(max(1.0 - along * along, 0.0)) > EDGE_ON if handle.kind == "axis" else along > EDGE_ON


def handle_at(
    frame: Frame, eye: Eye, x: float, y: float, size: tuple[int, int], handles: tuple[Handle, ...] = HANDLES
) -> Handle | None:
    """The handle under the mouse: a line that it touches, else the square it is in, else the nearest line in reach."""
    mouse = np.array([x, y])
    best, line, square = REACH_PX, None, None
    for handle in handles:
        if not offered(frame, eye, handle):
            continue
        if handle.kind == "plane":
            if square is None and _inside(eye.project(plane_corners(frame, handle.axis), size), mouse):
                square = handle
            continue
        if handle.kind == "axis":
            # not from the very centre, where all three begin
            ends = np.stack([0.15 * arm_end(frame, handle.axis) + 0.85 * frame.centre, arm_end(frame, handle.axis)])
            distance = _to_line(eye.project(ends, size), mouse)
        else:
            distance = _to_line(eye.project(ring_points(frame, handle.axis), size), mouse)
        if distance < best:
            best, line = distance, handle
    return line if line is not None and (best <= TOUCH_PX or square is None) else square


def turned_about(frame: Frame, axis: int, angle: float) -> Float:
    """(4, 4) motion in the world: by an angle, rad, about an axis through the centre."""
    motion = np.eye(4)
    motion[:3, :3] = rotation_matrix(frame.axes[:, axis] * angle)
    motion[:3, 3] = frame.centre - motion[:3, :3] @ frame.centre
    return motion


class Drag:
    """One drag of a handle, from the ray at its start."""

    def __init__(self, frame: Frame, handle: Handle, origin: Float, direction: Float) -> None:
        self.frame, self.handle = frame, handle
        self._start = self._value(origin, direction)
        self._angle = 0.0
        self.angle = 0.0
        """rad; how far a ring has been turned."""

    def to(self, origin: Float, direction: Float, move_step: float = 0.0, turn_step: float = 0.0) -> Float | None:
        """(4, 4) motion in the world since the start, in steps (m, rad) if asked; None: the ray says nothing."""
        now = self._value(origin, direction)
        if now is None or self._start is None:
            return None
        motion = np.eye(4)
        if self.handle.kind == "ring":
            # the way round that is nearer to the angle so far, so that a drag can turn more than once
            change = float(now[0] - self._start[0]) - self._angle
            self._angle += math.remainder(change, 2.0 * math.pi)
            self.angle = _stepped(self._angle, turn_step)
            motion = turned_about(self.frame, self.handle.axis, self.angle)
        else:
            directions = [self.handle.axis] if self.handle.kind == "axis" else self._across
            for value, k in zip(now - self._start, directions, strict=True):
                motion[:3, 3] += _stepped(float(value), move_step) * self.frame.axes[:, k]
        return motion

    @property
    def _across(self) -> list[int]:
        return [(self.handle.axis + 1) % 3, (self.handle.axis + 2) % 3]

    def _value(self, origin: Float, direction: Float) -> Float | None:
        """Metres along the axis, along the plane's two axes, or the angle about the ring's axis."""
        axis, centre = self.frame.axes[:, self.handle.axis], self.frame.centre
        if self.handle.kind == "axis":
            # the point of the axis nearest to the ray
            cosine = float(axis @ direction)
            sine2 = 1.0 - cosine * cosine
            if sine2 < 1e-6:
                return None
            offset = origin - centre
            return np.array([(float(axis @ offset) - cosine * float(direction @ offset)) / sine2])
        facing = float(axis @ direction)
        if abs(facing) < 1e-3:
            return None
        t = float(axis @ (centre - origin)) / facing
        if t <= 0.0:
            return None
        inside = (origin + t * direction - centre) @ self.frame.axes[:, self._across]
        return np.array([math.atan2(inside[1], inside[0])]) if self.handle.kind == "ring" else np.asarray(inside)


def _stepped(value: float, step: float) -> float:
    return round(value / step) * step if step > 0.0 else value


def _to_line(points: Float, mouse: Float) -> float:
    """Least distance of the mouse to a polyline (n, 2), px."""
    a, step = points[:-1], np.diff(points, axis=0)
    length2 = np.maximum(np.einsum("ij,ij->i", step, step), 1e-12)
    t = np.clip(np.einsum("ij,ij->i", mouse - a, step) / length2, 0.0, 1.0)
    distance = np.linalg.norm(a + t[:, None] * step - mouse, axis=1)
    distance = distance[np.isfinite(distance)]
    return float(distance.min()) if len(distance) else math.inf


def _inside(corners: Float, mouse: Float) -> bool:
    """Mouse within a convex polygon (n, 2)."""
    edge, towards = np.roll(corners, -1, axis=0) - corners, mouse - corners
    side = edge[:, 0] * towards[:, 1] - edge[:, 1] * towards[:, 0]
    return bool(np.all(side > 0) or np.all(side < 0))
