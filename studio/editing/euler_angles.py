"""Rotation vectors as three angles for people: about the fixed axes x, then y, then z (R = Rz Ry Rx), degrees.

A project stores the rotation vector, which two triples of angles or, with y at 90 degrees, a whole family of them
describe. `euler_angles` returns the triple nearest to the one that was shown before, so that nothing jumps.
"""

from __future__ import annotations

import math

from render.base.model import Vector3

Quaternion = tuple[float, float, float, float]

SAME = 1e-9
"""rad; rotations closer than this are the same one, told twice."""
LOCKED = 1e-8
"""About cos(y); below this only the sum or the difference of x and z is known."""


def rotation_from_euler(angles: Vector3) -> Vector3:
    """Angles x, y, z (deg) -> rotation vector (rad), of length <= pi."""
    return _vector(_quaternion_of_angles(angles))


def euler_angles(rotation: Vector3, near: Vector3 | None = None) -> Vector3:
    """Rotation vector (rad) -> angles x, y, z (deg).

    near: the angles shown until now. Where they still give this rotation they are returned unchanged; else, of all
    triples that give it, the nearest.
    """
    q = _quaternion_of_vector(rotation)
    if near is not None and _between(q, _quaternion_of_angles(near)) < SAME:
        return near
    w, x, y, z = q
    # half-angle sums, which stay exact near y = 90 degrees (Bernardes and Viollet 2022)
    difference, total = math.hypot(w + y, x - z), math.hypot(w - y, x + z)
    second = 2.0 * math.atan2(difference, total) - math.pi / 2
    half_difference, half_total = math.atan2(x - z, w + y), math.atan2(x + z, w - y)
    if min(difference, total) < LOCKED:
        third = math.radians(near[2]) if near is not None else 0.0
        first = third + 2.0 * half_difference if difference > total else 2.0 * half_total - third
        return _nearest((first, second, third), near)
    first, third = half_total + half_difference, half_total - half_difference
    one = _nearest((first, second, third), near)
    if near is None:
        return one
    other = _nearest((first + math.pi, math.pi - second, third + math.pi), near)
    return min((one, other), key=lambda triple: sum(abs(a - b) for a, b in zip(triple, near, strict=True)))


def _nearest(radians: tuple[float, float, float], near: Vector3 | None) -> Vector3:
    """Degrees, each by whole turns as near as possible to the angle shown before (to zero)."""
    before = near or (0.0, 0.0, 0.0)
    degrees = []
    for angle, shown in zip(radians, before, strict=True):
        value = math.degrees(angle)
        degrees.append(value - 360.0 * round((value - shown) / 360.0))
    return degrees[0], degrees[1], degrees[2]


def _quaternion_of_angles(angles: Vector3) -> Quaternion:
    (cx, sx), (cy, sy), (cz, sz) = ((math.cos(h), math.sin(h)) for h in (math.radians(a) / 2 for a in angles))
    return (
        cz * cy * cx + sz * sy * sx,
        cz * cy * sx - sz * sy * cx,
        cz * sy * cx + sz * cy * sx,
        sz * cy * cx - cz * sy * sx,
    )


def _quaternion_of_vector(vector: Vector3) -> Quaternion:
    angle = math.hypot(*vector)
    factor = 0.5 if angle == 0.0 else math.sin(angle / 2) / angle
    return math.cos(angle / 2), factor * vector[0], factor * vector[1], factor * vector[2]


def _vector(q: Quaternion) -> Vector3:
    w, x, y, z = q if q[0] >= 0 else (-q[0], -q[1], -q[2], -q[3])
    sine = math.hypot(x, y, z)
    factor = 2.0 if sine == 0.0 else 2.0 * math.atan2(sine, w) / sine
    return factor * x, factor * y, factor * z


def _between(a: Quaternion, b: Quaternion) -> float:
    """Angle between two rotations, rad; the sign of a quaternion does not matter."""
    sign = 1.0 if sum(x * y for x, y in zip(a, b, strict=True)) >= 0 else -1.0
    return 2.0 * math.dist(a, tuple(sign * x for x in b))
