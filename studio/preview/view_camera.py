"""From where the 3D view looks: rays through pixels, points to pixels, turning about as on a turntable (z is up)."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from render.base.arrays import Float

STEEPEST = 89.99
"""Degrees: straight down still has a direction to the right."""
ANGLE = 30.0
"""Vertical field of view, degrees."""
STANDARD = {"front": (-90.0, 0.0), "left": (180.0, 0.0), "top": (-90.0, STEEPEST), "iso": (-60.0, 30.0)}
"""Azimuth and elevation, degrees, of where the eye stands."""


@dataclass(frozen=True)
class Eye:
    """Looks along -`back`; `centre` is what it turns about."""

    centre: Float
    """(3,) m."""
    distance: float
    rotation: Float
    """(3, 3): columns right, up, back."""
    angle: float = ANGLE
    """Vertical field of view, degrees."""
    parallel: bool = False

    @classmethod
    def standing(cls, centre: Float, distance: float, azimuth: float, elevation: float) -> Eye:
        """At azimuth and elevation (degrees) from the centre."""
        return cls(np.asarray(centre, dtype=np.float64), distance, turntable(azimuth, elevation))

    @property
    def position(self) -> Float:
        return np.asarray(self.centre + self.distance * self.rotation[:, 2])

    @property
    def half_height(self) -> float:
        """Half of what is seen at the centre, m."""
        return self.distance * math.tan(math.radians(self.angle / 2))

    def ray(self, x: float, y: float, size: tuple[int, int]) -> tuple[Float, Float]:
        """Origin and unit direction through a point of a widget of `size`; x right, y down from the top left."""
        right = (2.0 * x / size[0] - 1.0) * self.half_height * size[0] / size[1]
        up = (1.0 - 2.0 * y / size[1]) * self.half_height
        offset = self.rotation[:, 0] * right + self.rotation[:, 1] * up
        forward = -self.rotation[:, 2]
        if self.parallel:
            return self.position + offset, forward
        direction = self.distance * forward + offset
        return self.position, direction / np.linalg.norm(direction)

    def project(self, points: Float, size: tuple[int, int]) -> Float:
        """(n, 3) m -> (n, 2) x, y in the widget; NaN behind the eye."""
        local = (np.atleast_2d(points) - self.position) @ self.rotation
        depth = -local[:, 2]
        with np.errstate(divide="ignore", invalid="ignore"):
            scale = np.full(len(local), 1.0) if self.parallel else np.where(depth > 0, self.distance / depth, np.nan)
        unit = size[1] / (2.0 * self.half_height)
        return np.stack([size[0] / 2 + unit * scale * local[:, 0], size[1] / 2 - unit * scale * local[:, 1]], axis=1)

    def sides(self, corners: tuple[tuple[float, float], tuple[float, float]], size: tuple[int, int]) -> Float:
        """Two opposite corners (x, y) of a rectangle in the widget -> (4, 4) planes: a point (x, y, z, 1) m is seen
        within it where its product with each is at least 0."""
        (left, top), (right, bottom) = corners
        around = [(left, top), (right, top), (right, bottom), (left, bottom)]
        rays = [self.ray(x, y, size) for x, y in around]
        origin, direction = self.ray(0.5 * (left + right), 0.5 * (top + bottom), size)
        middle, planes = origin + self.distance * direction, []
        for (first, along), (second, its) in zip(rays, rays[1:] + rays[:1], strict=True):
            far = first + self.distance * along
            normal = np.cross(far - first, second + self.distance * its - first)
            normal /= np.linalg.norm(normal) * np.sign(normal @ (middle - first))
            planes.append((*normal, -normal @ first))
        return np.array(planes)

    def metres_per_pixel(self, point: Float, size: tuple[int, int]) -> float:
        """Length, across the line of sight at a point, of one pixel."""
        depth = self.distance if self.parallel else float((self.position - point) @ self.rotation[:, 2])
        return 2.0 * max(depth, 1e-9) * math.tan(math.radians(self.angle / 2)) / size[1]

    def orbit(self, right: float, up: float) -> Eye:
        """Turn about the centre by degrees, as if the scene were dragged."""
        azimuth, elevation = angles(self.rotation)
        elevation = min(max(elevation + up, -STEEPEST), STEEPEST)
        return replace(self, rotation=turntable(azimuth - right, elevation))

    def pan(self, x: float, y: float, size: tuple[int, int]) -> Eye:
        """Move so that the scene at the centre follows the mouse by x, y pixels."""
        unit = 2.0 * self.half_height / size[1]
        return replace(self, centre=self.centre + unit * (y * self.rotation[:, 1] - x * self.rotation[:, 0]))

    def zoom(self, factor: float, x: float, y: float, size: tuple[int, int]) -> Eye:
        """Get nearer by a factor above 1, towards what lies under the mouse in the plane of the centre."""
        origin, direction = self.ray(x, y, size)
        back = self.rotation[:, 2]
        target = origin + direction * float((self.centre - origin) @ back / (direction @ back))
        distance = min(max(self.distance / factor, 1e-4), 1e4)
        return replace(self, centre=target + (self.centre - target) * (distance / self.distance), distance=distance)

    def framed(self, low: Float, high: Float, size: tuple[int, int], margin: float = 1.15) -> Eye:
        """The same direction, with a box (m) just in view."""
        radius = max(float(np.linalg.norm(np.subtract(high, low))) / 2, 1e-3)
        half = math.atan(math.tan(math.radians(ANGLE / 2)) * min(1.0, size[0] / size[1]))
        centre = np.add(low, high) / 2
        return replace(self, centre=centre, distance=margin * radius / math.sin(half), angle=ANGLE)


def turntable(azimuth: float, elevation: float) -> Float:
    """(3, 3) right, up, back of an eye at azimuth and elevation, degrees, upright."""
    a, e = math.radians(azimuth), math.radians(elevation)
    back = np.array([math.cos(e) * math.cos(a), math.cos(e) * math.sin(a), math.sin(e)])
    right = np.array([-math.sin(a), math.cos(a), 0.0])
    return np.stack([right, np.cross(back, right), back], axis=1)


def angles(rotation: Float) -> tuple[float, float]:
    """Azimuth and elevation, degrees, of the upright eye that looks the same way."""
    back = rotation[:, 2]
    elevation = math.degrees(math.asin(min(max(float(back[2]), -1.0), 1.0)))
    if abs(elevation) < STEEPEST - 1e-3:
        return math.degrees(math.atan2(back[1], back[0])), elevation
    # straight up or down: what is to the right decides
    right = rotation[:, 0]
    return math.degrees(math.atan2(-right[0], right[1])), elevation


def through(T_world_b: Float, distance: float, angle: float) -> Eye:
    """The eye of a camera or laser: z forward, y down (OpenCV); angle: vertical field of view, degrees."""
    rotation = T_world_b[:3, :3] @ np.diag([1.0, -1.0, -1.0])
    return Eye(T_world_b[:3, 3] + distance * T_world_b[:3, 2], distance, rotation, angle)
