"""Lasers placed by what is meant: the point that they light, and the angle at which the camera sees it."""

from __future__ import annotations

import math

import numpy as np

from render.base.arrays import Float
from render.base.pose import Pose, rotation_matrix
from studio.editing.placement import vector

MOSTLY = math.cos(math.radians(2.0))
"""Cosine from which a laser is turned about its fan's axis alone, so that a rig that was built straight stays so."""


def aimed(pose: Pose, point: Float) -> Pose:
    """A laser turned where it is, by the least angle that takes its axis through a point (3,), in the rig's frame."""
    matrix = pose.matrix.copy()
    towards = point - matrix[:3, 3]
    axis, length = matrix[:3, 2], float(np.linalg.norm(towards))
    if length < 1e-9:
        return pose
    matrix[:3, :3] = least_turn(axis, towards / length) @ matrix[:3, :3]
    return _rounded(matrix)


def at_angle(pose: Pose, camera: Float, point: Float, angle: float) -> Pose:
    """A laser turned about a point (3,) in the plane of laser, point and camera (3,) until they enclose an angle, rad.

    It keeps its distance from the point, and lights it as before; all in the rig's frame. Where its fan stands nearly
    across that plane it turns about the fan's own axis, and stays as straight as it was.
    """
    matrix = pose.matrix.copy()
    to_camera, to_laser = camera - point, matrix[:3, 3] - point
    normal = np.cross(to_camera, to_laser)
    sine = float(np.linalg.norm(normal))
    if sine < 1e-12:  # they see the point from one side: away along the sheet's normal
        normal, sine = np.cross(to_camera, matrix[:3, 0]), 0.0
    now = math.atan2(sine, float(to_camera @ to_laser))
    axis = _fan_axis(matrix, normal / np.linalg.norm(normal))
    turn = rotation_matrix(axis * (angle - now))
    matrix[:3, :3] = turn @ matrix[:3, :3]
    matrix[:3, 3] = point + turn @ to_laser
    return _rounded(matrix)


def at_baseline(pose: Pose, camera: Float, point: Float, baseline: float) -> Pose:
    """A laser moved along the line from the camera (3,) to it, to that distance, m, and aimed at a point as before.

    The sheet goes on meeting the point: it turns about its fan's axis, or as the direction to the point does.
    """
    matrix = pose.matrix.copy()
    offset = matrix[:3, 3] - camera
    length = float(np.linalg.norm(offset))
    direction = offset / length if length > 1e-9 else matrix[:3, 0]
    place = camera + baseline * direction
    turn = _turn(matrix, point - matrix[:3, 3], point - place)
    matrix[:3, :3] = turn @ matrix[:3, :3]
    matrix[:3, 3] = place
    return _rounded(matrix)


def turned_to(pose: Pose, before: Float, after: Float) -> Pose:
    """A laser turned where it is, about its fan's axis if that will do, from a point (3,) that it meets to another."""
    matrix = pose.matrix.copy()
    ends = before - matrix[:3, 3], after - matrix[:3, 3]
    if min(float(np.linalg.norm(end)) for end in ends) < 1e-9:
        return pose
    matrix[:3, :3] = _turn(matrix, *ends) @ matrix[:3, :3]
    return _rounded(matrix)


def _turn(matrix: Float, before: Float, after: Float) -> Float:
    """(3, 3) about the fan's axis from one direction (3,) to another, or the least where one of them runs along it."""
    across = matrix[:3, 1]
    flat = [end - across * (across @ end) for end in (before, after)]
    shares = [
        float(np.linalg.norm(part) / np.linalg.norm(end)) for part, end in zip(flat, (before, after), strict=True)
    ]
    ends = flat if min(shares) > MOSTLY else [before, after]
    return least_turn(*(end / np.linalg.norm(end) for end in ends))


def _fan_axis(matrix: Float, normal: Float) -> Float:
    """The fan's axis, on the side of a unit normal (3,), where they are nearly the same; else the normal."""
    along = float(matrix[:3, 1] @ normal)
    return matrix[:3, 1] * math.copysign(1.0, along) if abs(along) > MOSTLY else normal


def least_turn(a: Float, b: Float) -> Float:
    """(3, 3) the least rotation that takes one unit vector to another."""
    axis = np.cross(a, b)
    sine = float(np.linalg.norm(axis))
    if sine < 1e-15:
        return np.eye(3) if a @ b > 0.0 else -np.eye(3) + 2.0 * np.outer(_across(a), _across(a))
    return np.asarray(rotation_matrix(axis / sine * math.atan2(sine, float(a @ b))))


def _across(a: Float) -> Float:
    """A unit vector at right angles to another."""
    found = np.cross(a, np.eye(3)[int(np.argmin(np.abs(a)))])
    return np.asarray(found / np.linalg.norm(found))


def _rounded(matrix: Float) -> Pose:
    pose = Pose.from_matrix(matrix)
    return Pose(translation=vector(np.array(pose.translation)), rotation=vector(np.array(pose.rotation)))
