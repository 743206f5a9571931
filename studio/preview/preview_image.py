"""A quick low-resolution picture of what the camera sees: shape by a light at the camera, and every laser's line.

The line's radiance is that of a finished frame, averaged over the larger pixels, one ray each; the shape's shading is
for the eye only.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from render.base.arrays import Float, Float32, Int
from render.base.pose import invert, transform_points
from render.base.threads import map_chunks, thread_count
from render.camera.camera import Camera
from render.material.material import reflectance_weights
from render.scene.scene import Scene
from render.world.preview_shading import shade_pixels

if TYPE_CHECKING:
    from studio.preview.preview import Placed

Clear = Callable[[Float, Float, Float], NDArray[np.bool_]]

SCALES = (1.0, 0.5, 1 / 3, 0.25, 0.2, 1 / 6, 1 / 8, 0.1, 1 / 12, 1 / 16, 1 / 24, 1 / 32, 1 / 48, 1 / 64)
FEWEST_PIXELS = 2000
ANY_CAMERA = Camera(width=1, height=1, fx=1.0, fy=1.0, cx=0.0, cy=0.0)


@dataclass(frozen=True)
class PreviewImage:
    """Arrays (h, w) of the camera `scale` times as large a side; pixel centres as in `Camera.scaled`."""

    scale: float
    camera: Camera
    shade: Float32
    """(h, w, 3) RGB albedo times the cosine between facet and view, 0 where nothing is hit."""
    laser: tuple[Float32, ...]
    """For each laser (h, w) radiance, W/(m^2 sr), mean over the pixel."""
    depth_z: Float32
    """(h, w) m, NaN where nothing is hit."""
    object_id: Int
    """(h, w) index into `scene.visible_objects`, -1 for none."""
    seconds: float


class Speed:
    """How many pixels a second this machine makes of this scene; learned from every picture."""

    def __init__(self) -> None:
        self.pixels_per_second = 2e6
        self._last = 0.0

    def learn(self, pixels: int, seconds: float) -> None:
        self.pixels_per_second += 0.3 * (pixels / max(seconds, 1e-6) - self.pixels_per_second)

    def scale(self, scene: Scene, seconds: float) -> float:
        """The largest of SCALES that fits; the one before is kept until clearly wrong, so that nothing flickers."""
        pixels = scene.camera.width * scene.camera.height
        allowed = max(self.pixels_per_second * seconds, FEWEST_PIXELS)
        if self._last and 0.5 * allowed < self._last**2 * pixels < 1.2 * allowed:
            return self._last
        self._last = next((s for s in SCALES if s * s * pixels <= allowed), SCALES[-1])
        return self._last


def preview_image(
    scene: Scene,
    step: int,
    placed: Sequence[Placed],
    clear: Clear,
    scale: float,
    speed: Speed,
    threads: int | None = None,
) -> PreviewImage:
    """One ray a pixel of the scaled camera, against each object in its own frame."""
    start_time = time.perf_counter()
    camera = scene.camera.scaled(scale)
    n = camera.width * camera.height
    normalised = pixel_rays(camera.width, camera.height, *_optics(camera)) if placed else np.zeros((n, 2))
    shade, far = np.zeros((n, 3), np.float32), np.full(n, np.inf, np.float32)
    triangle, owner = np.full(n, -1, np.int32), np.full(n, -1, np.int32)
    light = np.zeros((len(scene.lasers), n), np.float32)
    views = [_View(item, scene, step) for item in placed]
    pixel = np.array([1.0 / camera.fx, 1.0 / camera.fy])
    beams = np.array([laser.packed() for laser in scene.lasers]).reshape(-1, 8)
    weights = np.array([reflectance_weights(laser.wavelength_nm) for laser in scene.lasers]).reshape(-1, 3)

    def work(begin: int, end: int) -> None:
        mine = slice(begin, end)
        _trace(views, normalised[mine], far[mine], triangle[mine], owner[mine])
        for k, view in enumerate(views):
            hit = np.where(owner[mine] == k, triangle[mine], np.int32(-1))
            if (hit >= 0).any():
                part = np.zeros((len(scene.lasers), end - begin), np.float32)
                shade_pixels(
                    view.item.body.surface,
                    view.T_object_camera,
                    pixel,
                    view.directions(normalised[mine]),
                    hit,
                    far[mine],
                    view.T_laser_object,
                    beams,
                    weights,
                    shade[mine],
                    part,
                )
                light[:, mine] += part

    if placed:
        map_chunks(work, n, max(4096, -(-n // (2 * thread_count(threads)))), threads)
    for i in range(len(scene.lasers)):
        _shadow(light[i], views, normalised, triangle, owner, scene.T_world_laser(i, step)[:3, 3], clear)
    depth = np.where(owner >= 0, far, np.float32(np.nan))
    index = np.array([*(item.index for item in placed), -1], dtype=np.int32)
    seconds = time.perf_counter() - start_time
    if placed:
        speed.learn(n, seconds)
    shape = (camera.height, camera.width)
    return PreviewImage(
        scale,
        camera,
        shade.reshape(*shape, 3),
        tuple(image.reshape(shape) for image in light),
        depth.reshape(shape),
        index[owner].reshape(shape),
        seconds,
    )


def pixel_rays(width: int, height: int, optics: tuple[float, ...], distortion: tuple[float, ...]) -> Float:
    """(h w, 2) undistorted (X/Z, Y/Z) of every pixel centre, NaN where there is no ray; read-only."""
    return _pixel_rays(width, height, optics, distortion)


@lru_cache(maxsize=4)
def _pixel_rays(width: int, height: int, optics: tuple[float, ...], distortion: tuple[float, ...]) -> Float:
    fx, fy, cx, cy, skew = optics
    # unchecked, as a scaled camera may have fewer pixels of focal length than one may be set up with
    values = {"width": width, "height": height, "fx": fx, "fy": fy, "cx": cx, "cy": cy, "skew": skew}
    camera = ANY_CAMERA.model_copy(update={**values, "distortion": distortion})
    pixels = np.stack(np.meshgrid(np.arange(width), np.arange(height)), axis=-1).astype(np.float64)
    normalised = camera.normalise(pixels)[0].reshape(-1, 2)
    normalised.flags.writeable = False
    return normalised


def _optics(camera: Camera) -> tuple[tuple[float, ...], tuple[float, ...]]:
    return (camera.fx, camera.fy, camera.cx, camera.cy, camera.skew), camera.distortion


class _View:
    """The camera in an object's frame, and the part of the image that the object's box can cover."""

    def __init__(self, item: Placed, scene: Scene, step: int) -> None:
        self.item = item
        self.T_object_camera = item.T_object_world @ scene.T_world_camera(step)
        self.T_laser_object = np.zeros((len(scene.lasers), 4, 4))
        for i in range(len(scene.lasers)):
            self.T_laser_object[i] = invert(scene.T_world_laser(i, step)) @ item.T_world_object
        corners = np.stack(np.meshgrid(*item.body.bounds.T), axis=-1).reshape(-1, 3)
        points = transform_points(invert(self.T_object_camera), corners)
        self.behind = bool(points[:, 2].max() <= 0.0)
        self.low, self.high = np.full(2, -np.inf), np.full(2, np.inf)
        if points[:, 2].min() > 1e-6:
            flat = points[:, :2] / points[:, 2:]
            margin = 1e-6 + 1e-3 * np.ptp(flat, axis=0)
            self.low, self.high = flat.min(axis=0) - margin, flat.max(axis=0) + margin

    def directions(self, normalised: Float) -> Float32:
        """(n, 2) -> (n, 3) in the object's frame, not unit: a hit's distance is then depth_z."""
        R = self.T_object_camera[:3, :3]
        return np.ascontiguousarray(normalised @ R[:, :2].T + R[:, 2], dtype=np.float32)


def _trace(views: list[_View], normalised: Float, far: Float32, triangle: Int, owner: Int) -> None:
    """Nearest hit of each ray over all objects, in place."""
    has_ray = np.isfinite(normalised[:, 0])
    for k, view in enumerate(views):
        if view.behind:
            continue
        with np.errstate(invalid="ignore"):
            some = np.flatnonzero(np.all((normalised >= view.low) & (normalised <= view.high), axis=1) & has_ray)
        if len(some) == 0:
            continue
        rays = view.item.body.rays
        origin = np.broadcast_to((view.T_object_camera[:3, 3] - rays.centre).astype(np.float32), (len(some), 3))
        hit, distance = rays.intersect(origin, view.directions(normalised[some]), far[some], coherent=True)
        found = np.flatnonzero(hit >= 0)
        chosen = some[found]
        far[chosen], triangle[chosen], owner[chosen] = distance[found], hit[found], k


def _shadow(
    light: Float32,
    views: list[_View],
    normalised: Float,
    triangle: Int,
    owner: Int,
    laser: Float,
    clear: Clear,
) -> None:
    """Darken, in place, the pixels that something keeps the laser from."""
    lit = np.flatnonzero(light)
    points, normals = np.empty((len(lit), 3)), np.empty((len(lit), 3))
    for k, view in enumerate(views):
        mine = np.flatnonzero(owner[lit] == k)
        surface, T = view.item.body.surface, view.item.T_world_object
        direction = normalised[lit[mine]] @ view.T_object_camera[:3, :2].T + view.T_object_camera[:3, 2]
        origin = view.T_object_camera[:3, 3]
        corners = surface.vertices[surface.triangles[triangle[lit[mine]]]]
        facet = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        facing = np.einsum("ij,ij->i", facet, direction)
        # in float64, or a rounded point lies in its own shadow
        distance = np.einsum("ij,ij->i", facet, corners[:, 0] - origin) / facing
        points[mine] = transform_points(T, origin + distance[:, None] * direction)
        facet *= -np.sign(facing)[:, None]
        normals[mine] = facet / np.linalg.norm(facet, axis=1, keepdims=True) @ T[:3, :3].T
    light[lit[~clear(points, normals, laser - points)]] = 0.0
