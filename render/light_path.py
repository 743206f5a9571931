"""Laser light that met two or more surfaces: paths from the laser, each later surface connected to the camera.

Light that met one surface only is left to `render.direct`, so nothing is counted twice. The fan is narrowed to the part
that can hit anything; across and along the sheet, and for the first bounce, the paths follow a low-discrepancy sequence
with a random start of its own for each pass, so that the spread of the passes is an honest error.

A photon of power Phi that meets a surface adds  Phi f cos(to the camera) A  to the radiance of the pixel it is seen in,
A being the image area of a patch there (`render.lens.lens_project`), through one point of the aperture drawn by chance.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numba
import numpy as np
from numpy.typing import NDArray

from render.bsdf import evaluate, is_boundary, sample
from render.camera import Camera
from render.distortion import tilt_matrix
from render.emission import SEQUENCE, Paths, emit, fan_span
from render.laser import LineLaser
from render.lens import lens_point, lens_position, lens_project
from render.random import uniform
from render.surface import Surface, View, scattering, to_local, to_world
from render.threads import Cancel, Progress, map_chunks, thread_count
from render.world import World

Float = NDArray[np.float64]
Float32 = NDArray[np.float32]
Int = NDArray[np.int32]

PASS_PATHS = 1 << 18
PATHS_A_CHUNK = 1 << 15
"""Short enough to be cancelled within a tenth of a second."""
FEWEST_PASSES = 4
MOST_BOUNCES = 64
ROULETTE_AFTER = 3
"""Surfaces met before a path may be ended by chance."""


@dataclass(frozen=True)
class IndirectImage:
    """(h, w) float32 radiance, W/(m^2 sr); the estimated relative RMS error; the paths it took."""

    radiance: Float32
    error: float
    paths: int


@numba.njit(nogil=True, cache=True, error_model="numpy")
def bounce(
    surface: Surface,
    view: View,
    height: int,
    seed: int,
    start: Float,
    depth: int,
    paths: Paths,
    triangle: Int,
    centre: Float,
    surface_offset: float,
    weights: Float,
    following: Paths,
    origins: Float32,
    directions: Float32,
    far: Float32,
    pixel: Int,
    worth: Float,
) -> tuple[int, int]:
    """Connect each path's hit to the camera (from the second surface on) and scatter it into `following`.

    Returns the number of connections, and of paths that go on. A connection, if clear, adds `worth` to its `pixel`.
    """
    tilt = tilt_matrix(view.distortion[12], view.distortion[13])
    distorted = bool(np.any(view.distortion))
    vertices, triangles = surface.vertices, surface.triangles
    o, i, f, rgb, frame = np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty((3, 3))
    connections = going = 0
    for r in range(triangle.shape[0]):
        t = triangle[r]
        if t < 0:
            continue
        ia, ib, ic = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        a0, a1, a2 = vertices[ia, 0], vertices[ia, 1], vertices[ia, 2]
        ab0, ab1, ab2 = vertices[ib, 0] - a0, vertices[ib, 1] - a1, vertices[ib, 2] - a2
        ac0, ac1, ac2 = vertices[ic, 0] - a0, vertices[ic, 1] - a1, vertices[ic, 2] - a2
        n0, n1, n2 = ab1 * ac2 - ab2 * ac1, ab2 * ac0 - ab0 * ac2, ab0 * ac1 - ab1 * ac0
        length = math.sqrt(n0 * n0 + n1 * n1 + n2 * n2)
        n0, n1, n2 = n0 / length, n1 / length, n2 / length
        d0, d1, d2 = paths.direction[r, 0], paths.direction[r, 1], paths.direction[r, 2]
        b0, b1, b2 = paths.origin[r, 0], paths.origin[r, 1], paths.origin[r, 2]
        cosine = n0 * d0 + n1 * d1 + n2 * d2
        if cosine == 0.0:
            continue
        s = (n0 * (a0 - b0) + n1 * (a1 - b1) + n2 * (a2 - b2)) / cosine
        p0, p1, p2 = b0 + s * d0, b1 + s * d1, b2 + s * d2
        side = -1.0 if cosine > 0.0 else 1.0
        n0, n1, n2 = side * n0, side * n1, side * n2
        number = paths.number[r]
        slot = scattering(surface, t, p0, p1, p2, uniform(seed, number, depth, 3), rgb)
        row = surface.rows[slot]
        rho = weights[0] * rgb[0] + weights[1] * rgb[1] + weights[2] * rgb[2]
        rgb[0] = rgb[1] = rgb[2] = rho
        to_local(surface, t, row, n0, n1, n2, frame)
        for axis in range(3):
            o[axis] = -(frame[axis, 0] * d0 + frame[axis, 1] * d1 + frame[axis, 2] * d2)
        if depth > 0:
            a, b = lens_point(view.lens[0], uniform(seed, number, depth, 5), uniform(seed, number, depth, 6))
            e0, e1, e2 = lens_position(view, a, b)
            e0, e1, e2 = e0 - p0, e1 - p1, e2 - p2
            distance = math.sqrt(e0 * e0 + e1 * e1 + e2 * e2)
            e0, e1, e2 = e0 / distance, e1 / distance, e2 / distance
            facing = n0 * e0 + n1 * e1 + n2 * e2
            if facing > 0.0:
                u, v, image_area = lens_project(view, tilt, distorted, p0, p1, p2, a, b)
                if image_area > 0.0 and -0.5 <= u < view.width - 0.5 and -0.5 <= v < height - 0.5:
                    for axis in range(3):
                        i[axis] = frame[axis, 0] * e0 + frame[axis, 1] * e1 + frame[axis, 2] * e2
                    evaluate(row, rgb, o[0], o[1], o[2], i[0], i[1], i[2], f)
                    if f[0] > 0.0:
                        worth[connections] = paths.power[r] * f[0] * facing * image_area
                        pixel[connections] = int(math.floor(v + 0.5)) * view.width + int(math.floor(u + 0.5))
                        origins[connections, 0] = p0 - centre[0] + n0 * surface_offset
                        origins[connections, 1] = p1 - centre[1] + n1 * surface_offset
                        origins[connections, 2] = p2 - centre[2] + n2 * surface_offset
                        directions[connections, 0], directions[connections, 1] = e0, e1
                        directions[connections, 2] = e2
                        far[connections] = distance
                        connections += 1
        if depth + 1 >= MOST_BOUNCES:
            continue
        if depth == 0:
            choice = (start[2] + number * SEQUENCE[2]) % 1.0
            r1, r2 = (start[3] + number * SEQUENCE[3]) % 1.0, (start[4] + number * SEQUENCE[4]) % 1.0
        else:
            choice = uniform(seed, number, depth, 0)
            r1, r2 = uniform(seed, number, depth, 1), uniform(seed, number, depth, 2)
        if sample(row, rgb, o[0], o[1], o[2], choice, r1, r2, i, f) == 0.0:
            continue
        # what enters a substance is not followed here
        if is_boundary(row) and i[2] < 0.0:
            continue
        power = paths.power[r] * f[0]
        if depth >= ROULETTE_AFTER:
            stay = min(f[0], 0.95)
            if uniform(seed, number, depth, 4) >= stay:
                continue
            power /= stay
        if power <= 0.0:
            continue
        out = 1.0 if i[2] > 0.0 else -1.0
        to_world(frame, i)
        following.origin[going, 0] = p0 + out * n0 * surface_offset
        following.origin[going, 1] = p1 + out * n1 * surface_offset
        following.origin[going, 2] = p2 + out * n2 * surface_offset
        for axis in range(3):
            following.direction[going, axis] = i[axis]
        following.power[going], following.number[going] = power, number
        going += 1
    return connections, going


@numba.njit(nogil=True, cache=True)
def splat(pixel: Int, worth: Float, occluded: NDArray[np.bool_], count: int, image: Float) -> None:
    """Add the clear connections to the flat image."""
    for j in range(count):
        if not occluded[j]:
            image[pixel[j]] += worth[j]


@numba.njit(nogil=True, cache=True)
def gather_pass(image: Float, paths: int, total: Float, squares: Float) -> tuple[float, float]:
    """Fold a pass into the running sums and clear it; returns the sums of total^2 and of squares."""
    first = second = 0.0
    for j in range(image.shape[0]):
        value = image[j] / paths
        if value != 0.0:
            total[j] += value
            squares[j] += value * value
            image[j] = 0.0
        first += total[j] * total[j]
        second += squares[j]
    return first, second


def indirect_image(
    world: World,
    camera: Camera,
    laser: LineLaser,
    T_world_camera: Float,
    T_world_laser: Float,
    *,
    target: float = 0.1,
    most_paths: int = 1 << 23,
    seed: int = 0,
    threads: int | None = None,
    cancelled: Cancel | None = None,
    progress: Progress | None = None,
) -> IndirectImage:
    """Radiance of one laser's light after two or more surfaces, to a target relative RMS error. Raises Cancelled.

    The error is that of the whole image: sqrt(sum of variances / sum of squares). `most_paths` ends it in any case.
    """
    low, high, reach = fan_span(world, laser, T_world_laser)
    pixels = camera.width * camera.height
    total, squares = np.zeros(pixels), np.zeros(pixels)
    if high <= low:
        return IndirectImage(np.zeros((camera.height, camera.width), np.float32), 0.0, 0)
    surface = world.surface_at((laser.wavelength_nm,) * 3)
    task = _Task(world, surface, camera, laser, T_world_camera, T_world_laser, (low, high, reach), seed)
    passes, error = 0, math.inf
    parts = [np.zeros(pixels) for _ in range(2)]
    while passes * PASS_PATHS < most_paths:
        # two passes at a time, one a worker, each into its own image: the same sums for any number of threads
        def work(start: int, stop: int, base: int = passes) -> None:
            for number in range(start, stop):
                task.run(base + number, parts[number], cancelled)

        map_chunks(work, len(parts), 1, min(len(parts), thread_count(threads)), cancelled)
        for part in parts:
            first, second = gather_pass(part, PASS_PATHS, total, squares)
            passes += 1
        if passes >= FEWEST_PASSES:
            variance = max(second - first / passes, 0.0) / (passes - 1) / passes
            mean_square = max(first / passes**2 - variance, 1e-300)
            error = math.sqrt(variance / mean_square) if first > 0.0 else 0.0
            if error <= target:
                break
        if progress is not None:
            # the error falls with the root of the passes, at least
            wanted = passes * (error / target) ** 2 if math.isfinite(error) else math.inf
            progress(min(0.99, passes / min(wanted, most_paths / PASS_PATHS)))
    image = (total / passes).astype(np.float32).reshape(camera.height, camera.width)
    return IndirectImage(image, error, passes * PASS_PATHS)


def indirect_flux(
    world: World,
    camera: Camera,
    laser: LineLaser,
    T_world_camera: Float,
    T_world_laser: Float,
    *,
    passes: int = 4,
    paths: int = 1 << 13,
    seed: int = 0,
    cancelled: Cancel | None = None,
) -> tuple[float, float]:
    """Sum over the image of the indirect radiance, and its standard error: a pilot of a few short passes."""
    low, high, reach = fan_span(world, laser, T_world_laser)
    if high <= low:
        return 0.0, 0.0
    surface = world.surface_at((laser.wavelength_nm,) * 3)
    task = _Task(world, surface, camera, laser, T_world_camera, T_world_laser, (low, high, reach), seed)
    sums = []
    for number in range(passes):
        image = np.zeros(camera.width * camera.height)
        task.run(number, image, cancelled, paths)
        sums.append(float(image.sum()) / paths)
    return float(np.mean(sums)), float(np.std(sums, ddof=1) / math.sqrt(passes))


@dataclass(frozen=True)
class _Task:
    """Traces one pass: its photons in chunks, one after the other, into one image."""

    world: World
    surface: Surface
    camera: Camera
    laser: LineLaser
    T_world_camera: Float
    T_world_laser: Float
    span: tuple[float, float, float]
    seed: int

    def run(self, number: int, image: Float, cancelled: Cancel | None, count: int = PASS_PATHS) -> None:
        from render.errors import Cancelled
        from render.material import reflectance_weights

        rays, view = self.world.rays, self.camera.view(self.T_world_camera)
        low, high, reach = self.span
        weights = np.array(reflectance_weights(self.laser.wavelength_nm))
        seed = self.seed * 1_000_003 + number
        start = np.array([uniform(seed, 0, dimension, 99) for dimension in range(5)])
        for first in range(0, count, PATHS_A_CHUNK):
            if cancelled is not None and cancelled():
                raise Cancelled
            paths = _empty(min(PATHS_A_CHUNK, count - first))
            emit(first, seed, start, low, high, reach, self.laser.packed(), self.T_world_laser, paths)
            depth = 0
            while len(paths.number):
                n = len(paths.number)
                triangle, _ = rays.intersect(
                    (paths.origin - rays.centre).astype(np.float32), paths.direction.astype(np.float32)
                )
                following = _empty(n)
                origins, towards = np.empty((n, 3), np.float32), np.empty((n, 3), np.float32)
                far, pixel, worth = np.empty(n, np.float32), np.empty(n, np.int32), np.empty(n)
                connections, going = bounce(
                    self.surface,
                    view,
                    self.camera.height,
                    seed,
                    start,
                    depth,
                    paths,
                    triangle,
                    rays.centre,
                    rays.surface_offset,
                    weights,
                    following,
                    origins,
                    towards,
                    far,
                    pixel,
                    worth,
                )
                if connections:
                    blocked = rays.occluded(origins[:connections], towards[:connections], far[:connections])
                    splat(pixel, worth, blocked, connections, image)
                paths = Paths(
                    following.origin[:going],
                    following.direction[:going],
                    following.power[:going],
                    following.number[:going],
                )
                depth += 1


def _empty(n: int) -> Paths:
    return Paths(np.empty((n, 3)), np.empty((n, 3)), np.empty(n), np.empty(n, np.int64))
