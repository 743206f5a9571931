"""What the 3D view draws of a rig, as plain points and lines: frustum, fan, lit curve, working volume, lamps, a
turntable's axis, grid."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from render.base.arrays import Float
from render.base.pose import transform_points
from render.camera.camera import Camera
from render.frame import LaserCurve
from render.laser.laser import LineLaser
from render.scene.lights import Light, RectangleLight
from render.scene.motion import Turntable
from render.scene.scene import Scene
from studio.editing.placement import depths_ahead, rounded, working_distance
from studio.preview.preview import Fan

Int = NDArray[np.int64]

CLOSE_STEPS = 8.0
"""Points of neighbouring scan lines farther apart than this many usual steps are not joined."""
MOST_JOINS = 3
"""Crossings of one scan line that a join may step over."""
FAR_CORNERS = 4.0
"""Working distances to which the frustum's edges are drawn where nothing is in focus."""
BEYOND = 2.0
"""Times the distance of the farthest object that a rig is drawn for: a sheet that is aimed past all of them may meet
the camera's axis at any distance, where there is nothing."""
ARC_POINTS = 37
"""Of three quarters of a circle."""


def drawn_distance(scene: Scene) -> float:
    """The working distance, m, by which everything of a rig is drawn, as far as there is something."""
    return min(working_distance(scene), BEYOND * max(depths_ahead(scene), default=np.inf))


def image_corners(camera: Camera, depth: float) -> Float:
    """(4, 3) corners of the image at a depth, camera frame; clockwise from the upper left."""
    u, v = camera.width - 0.5, camera.height - 0.5
    rays, valid = camera.rays(np.array([[-0.5, -0.5], [u, -0.5], [u, v], [-0.5, v]]))
    flat = rays[:, :2] / rays[:, 2:]
    if not valid.all():
        # the lens has no ray there: the pinhole's corner does for a drawing
        flat[~valid] = ((np.array([[0, 0], [u, 0], [u, v], [0, v]]) - (camera.cx, camera.cy)) / camera.fx)[~valid]
    return np.concatenate([flat * depth, np.full((4, 1), depth)], axis=1)


def focus_corners(scene: Scene) -> Float:
    """(4, 3) where the image's corners meet the plane of focus, which a tilted sensor tilts (`render.camera.lens`).

    A corner that meets it nowhere, or far beyond the work, ends at a few working distances.
    """
    camera, distance = scene.camera, drawn_distance(scene)
    plane, corners = camera.focus_plane, image_corners(camera, 1.0)
    if not plane[:3].any():
        return corners * distance
    vergence = corners @ plane[:3]
    most = FAR_CORNERS * max(distance, camera.lens.focus_distance or 0.0)
    return np.asarray(corners / np.maximum(vergence, 1.0 / most)[:, None])


def frustum(scene: Scene) -> tuple[Float, list[tuple[int, int]]]:
    """Points, camera frame, and lines: the edges out to the plane in focus (or the working distance), and its frame."""
    points = np.concatenate([np.zeros((1, 3)), focus_corners(scene)])
    return points, [(0, 1), (0, 2), (0, 3), (0, 4), (1, 2), (2, 3), (3, 4), (4, 1)]


def image_plane(scene: Scene) -> Float:
    """(7, 3) a small image plane before the camera, camera frame, and over its upper edge a triangle that says "up"."""
    corners = image_corners(scene.camera, 0.14 * drawn_distance(scene))
    width = np.linalg.norm(corners[1] - corners[0])
    middle, up = (corners[0] + corners[1]) / 2, np.array([0.0, -1.0, 0.0])
    along = np.array([1.0, 0.0, 0.0])
    tip = [middle - 0.18 * width * along, middle + 0.18 * width * along, middle + 0.2 * width * up]
    return np.concatenate([corners, np.array(tip) + 0.06 * width * up])


def fan_points(fan: Fan, reach: float) -> Float:
    """(n + 1, 3) the laser and the ends of its rays: where they are stopped, or at `reach`."""
    distance = np.where(np.isfinite(fan.distance), fan.distance, reach)
    return np.concatenate([fan.origin[None], fan.origin + distance[:, None] * fan.direction])


def reach_of(scene: Scene, fans: list[Fan]) -> float:
    """How far to draw light that hits nothing."""
    hits = [float(fan.distance[np.isfinite(fan.distance)].max(initial=0.0)) for fan in fans]
    return max(1.2 * drawn_distance(scene), *hits, 0.0)


def joined(curve: LaserCurve) -> Int:
    """(m, 2) pairs of points of a lit curve that are neighbours on it."""
    n = len(curve.index)
    pairs, lengths = [], []
    for k in range(1, MOST_JOINS + 1):
        i = np.flatnonzero(curve.index[k:] - curve.index[:-k] == 1) if n > k else np.zeros(0, np.int64)
        pairs.append(np.stack([i, i + k], axis=1))
        lengths.append(np.linalg.norm(curve.point[i + k] - curve.point[i], axis=1))
    pair, length = np.concatenate(pairs), np.concatenate(lengths)
    if len(length) == 0:
        return pair
    return np.asarray(pair[length <= CLOSE_STEPS * np.median(length) + 1e-12])


def hidden_line(fan: Fan) -> tuple[Float, Int]:
    """Points (n, 3) and pairs (m, 2) of the lit line that the camera does not see."""
    points = fan.origin + np.where(np.isfinite(fan.distance), fan.distance, 0.0)[:, None] * fan.direction
    dark = np.isfinite(fan.distance) & ~fan.seen
    i = np.flatnonzero(dark[:-1] & dark[1:])
    steps = np.linalg.norm(points[i + 1] - points[i], axis=1)
    usual = np.median(steps) if len(steps) else 0.0
    i = i[steps <= CLOSE_STEPS * usual + 1e-12]
    return points, np.stack([i, i + 1], axis=1)


def working_volume(camera: Camera, laser: LineLaser, T_camera_laser: Float, reach: float) -> Float:
    """(n, 3) polygon, camera frame: the part of the sheet, up to `reach` along the fan, that the camera sees."""
    y = reach * laser.tan_half_fan
    polygon = transform_points(T_camera_laser, np.array([[0.0, 0.0, 0.0], [0.0, y, reach], [0.0, -y, reach]]))
    corners = image_corners(camera, 1.0)
    for i in range(4):
        inward = np.cross(corners[(i + 1) % 4], corners[i])
        if inward @ corners[(i + 2) % 4] < 0:
            inward = -inward
        polygon = _clipped(polygon, inward)
    return polygon


def laser_body(size: float) -> Float:
    """(8, 3) a box behind the laser's origin, laser frame: narrow across the sheet."""
    a, b, c = 0.5 * size, 0.9 * size, 2.2 * size
    return np.array([(x, y, z) for z in (-c, 0.0) for x, y in ((-a, -b), (a, -b), (a, b), (-a, b))])


def camera_body(size: float) -> Float:
    """(8, 3) a box behind the camera's centre, camera frame."""
    a, c = 0.9 * size, 2.0 * size
    return np.array([(x, y, z) for z in (-c, 0.0) for x, y in ((-a, -a), (a, -a), (a, a), (-a, a))])


BOX_FACES = np.array([[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]])


def lamp(light: Light, size: float) -> tuple[Float, list[tuple[int, int]]]:
    """Points, light frame, and lines: a rectangle with its direction, or a star of rays."""
    if isinstance(light, RectangleLight):
        x, y = light.width / 2, light.height / 2
        points = np.array([[-x, -y, 0], [x, -y, 0], [x, y, 0], [-x, y, 0], [0, 0, 0], [0, 0, 2.5 * size]])
        return points, [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (0, 2), (1, 3)]
    grid = [np.array(p, dtype=float) for p in np.ndindex(3, 3, 3) if p != (1, 1, 1)]
    rays = [(p - 1) / np.linalg.norm(p - 1) for p in grid]
    points = np.array([end * ray * size for ray in rays for end in (0.4, 1.2)])
    return points, [(2 * i, 2 * i + 1) for i in range(len(rays))]


def turning(motion: Turntable, low: Float, high: Float, size: float) -> tuple[Float, list[tuple[int, int]]]:
    """Points, world frame, and lines: a turntable's axis through a box (3,), (3,) and beyond it, about it an arrow.

    The arrow goes the way that things turn; there is none where a step turns by nothing.
    """
    axis, centre = np.asarray(motion.axis) / np.linalg.norm(motion.axis), np.asarray(motion.centre)
    along = (np.array(np.meshgrid(*np.stack([low, high]).T)).reshape(3, -1).T - centre) @ axis
    foot, top = float(along.min()) - 2.0 * size, float(along.max()) + 9.0 * size
    points = [centre + foot * axis, centre + top * axis]
    lines = [(0, 1)]
    if motion.angle_step != 0.0:
        across = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
        across /= np.linalg.norm(across)
        ahead = math.copysign(1.0, motion.angle_step) * np.cross(axis, across)
        middle, radius = points[1] - 3.0 * size * axis, 3.0 * size
        turns = np.linspace(0.0, 1.5 * np.pi, ARC_POINTS)
        first = len(points)
        points += [middle + radius * (math.cos(turn) * across + math.sin(turn) * ahead) for turn in turns]
        lines += [(i, i + 1) for i in range(first, first + ARC_POINTS - 1)]
        # the arc ends opposite to where it would go on, so that its way there is along `across`
        points += [points[-1] - 0.6 * radius * across + side * 0.35 * radius * ahead for side in (-1.0, 1.0)]
        lines += [(first + ARC_POINTS - 1, len(points) - k) for k in (1, 2)]
    return np.array(points), lines


def grid(low: Float, high: Float) -> tuple[float, Float]:
    """Spacing (m) and lines (n, 2, 3) of a ground grid on z = 0 under a box; the axes themselves are left out."""
    extent = max(float(np.max((high - low)[:2])), 1e-3)
    step = rounded(extent / 6.0)
    first, last = np.floor(low[:2] / step).astype(int) - 2, np.ceil(high[:2] / step).astype(int) + 2
    first, last = np.minimum(first, -1), np.maximum(last, 1)
    lines = []
    for i in range(first[0], last[0] + 1):
        lines.append([[i * step, first[1] * step, 0.0], [i * step, last[1] * step, 0.0]])
    for j in range(first[1], last[1] + 1):
        lines.append([[first[0] * step, j * step, 0.0], [last[0] * step, j * step, 0.0]])
    return step, np.array(lines)


def _clipped(polygon: Float, inward: Float) -> Float:
    """The part of a polygon (n, 3) on the inner side of a plane through the origin."""
    kept = []
    side = polygon @ inward
    for i in range(len(polygon)):
        j = (i + 1) % len(polygon)
        if side[i] >= 0:
            kept.append(polygon[i])
        if (side[i] >= 0) != (side[j] >= 0):
            kept.append(polygon[i] + side[i] / (side[i] - side[j]) * (polygon[j] - polygon[i]))
    return np.array(kept).reshape(-1, 3)


def glyph_size(scene: Scene) -> float:
    """m; half the width of the boxes that stand for camera and lasers."""
    return max(0.018 * drawn_distance(scene), 1e-4)


def bounds_of(points: Float) -> tuple[Float, Float]:
    """Lowest and highest coordinates of (n, 3), of the unit box where there are none."""
    known = points[np.isfinite(points).all(axis=1)]
    if len(known) == 0:
        half = math.sqrt(1 / 12)
        return np.full(3, -half), np.full(3, half)
    return known.min(axis=0), known.max(axis=0)
