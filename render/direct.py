"""Direct light of a laser: each lit pixel's mean radiance under a box filter.

A pixel is seen by one ray first (`render.first_look`). Where that is not enough (edges, shadows, strong curvature,
texture) it is divided into n x n cells with one jittered ray each (`render.direct_shade`). Each ray also predicts its
whole pixel; the spread of these predictions is the error estimate, and pixels that need it get twice the cells a side
until the image's error is below the target. Through a thin lens each ray has its own point of the aperture, and
`render.direct_lens` takes the noise of that away.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numba
import numpy as np
from numpy.typing import NDArray

from render.camera import Camera
from render.camera_rays import camera_rays, lens_rays
from render.direct_lens import gather_aperture, worst_enough
from render.direct_shade import (
    gather,
    place,
    shade_diffuse,
    shade_diffuse_lens,
    shade_glossy,
    shade_glossy_lens,
)
from render.embree import CHUNK
from render.first_look import gather_first, look_around
from render.footprint import reachable_pixels
from render.laser import LineLaser
from render.material import reflectance_weights
from render.neighbours import with_neighbours
from render.pose import invert
from render.sequence import pair_table
from render.surface import Surface, has_gloss
from render.threads import Cancel, Progress, map_chunks
from render.world import World

Float = NDArray[np.float64]
Float32 = NDArray[np.float32]
Int = NDArray[np.int32]

MOST_CELLS = 32


@dataclass(frozen=True)
class DirectImage:
    """(h, w) float32 radiance W/(m^2 sr); the estimated relative RMS error over the lit pixels; what it took."""

    radiance: Float32
    error: float
    pixels: int
    samples: int


def direct_image(
    world: World,
    camera: Camera,
    laser: LineLaser,
    T_world_camera: Float,
    T_world_laser: Float,
    *,
    target: float = 0.01,
    seed: int = 0,
    threads: int | None = None,
    cancelled: Cancel | None = None,
    progress: Progress | None = None,
) -> DirectImage:
    """Direct radiance of one laser to a target relative RMS error over the lit pixels. Raises Cancelled."""
    pixels = reachable_pixels(world, camera, laser, T_world_camera, T_world_laser, threads)
    image = np.zeros(camera.height * camera.width, dtype=np.float32)
    shape = camera.height, camera.width
    radiance, error = np.empty(len(pixels)), np.empty(len(pixels))
    todo = np.arange(len(pixels))
    surface = world.surface_at((laser.wavelength_nm,) * 3)
    # through an aperture one ray knows but one point of it
    samples, cells = 0, 2 if camera.view(T_world_camera).lens[0] > 0.0 else 1
    left = 1.0

    def part(done: float) -> None:
        # how many levels there will be is not known: each takes half of what is left
        if progress is not None:
            progress(1.0 - left * (1.0 - 0.5 * done))

    while len(todo):
        mean, spread = np.empty(len(todo)), np.empty(len(todo))
        first = len(todo) if cells == 1 else 0
        planes, middle = np.empty((first, 4)), np.empty(first)
        poses = T_world_camera, T_world_laser
        task = _Task(
            world, surface, camera, laser, *poses, pixels[todo], cells, seed, mean, spread, planes, middle, image
        )
        # several chunks a worker, so that none waits for the last one
        chunk = min(CHUNK // cells**2, max(1024 // cells**2 + 128, math.ceil(len(todo) / 16)))
        map_chunks(task.run, len(todo), chunk, threads, cancelled, part)
        if cells == 1:
            map_chunks(task.look, len(todo), 4 * chunk, threads)
        radiance[todo], error[todo] = mean, spread
        samples += len(todo) * cells**2
        count, power, variance = tally(radiance, error)
        if count == 0:
            return DirectImage(image.reshape(shape), 0.0, 1, samples)
        signal = math.sqrt(power / count)
        relative = math.sqrt(variance / count) / signal
        if relative <= target or cells >= MOST_CELLS:
            return DirectImage(image.reshape(shape), relative, count, samples)
        # a pixel below half of its equal share cannot keep the image from its target
        rough = error > 0.5 * target * signal
        if camera.lens.model == "thin-lens":
            rough &= worst_enough(error, (0.8 * target * signal) ** 2 * count)
        # all rays may miss the edge of a shadow that cuts a pixel's corner: its neighbours tell
        todo = np.flatnonzero(with_neighbours(rough, pixels, camera.width))
        cells *= 2
        left *= 0.5
    return DirectImage(image.reshape(shape), 0.0, 0, samples)


@numba.njit(nogil=True, cache=True)
def tally(radiance: Float, error: Float) -> tuple[int, float, float]:
    """Of (n,) pixels: how many are lit, the sum of their squares, and the sum of all squared errors."""
    count, power, variance = 0, 0.0, 0.0
    for i in range(radiance.shape[0]):
        if radiance[i] > 0.0:
            count += 1
            power += radiance[i] * radiance[i]
        variance += error[i] * error[i]
    return count, power, variance


@dataclass(frozen=True)
class _Task:
    """One refinement level: `run` does the pixels start..stop, each chunk with its own buffers."""

    world: World
    surface: Surface
    camera: Camera
    laser: LineLaser
    T_world_camera: Float
    T_world_laser: Float
    pixels: Int
    cells: int
    seed: int
    mean: Float
    error: Float
    planes: Float
    """(n, 4) at the first look, or (0, 4)."""
    middle: Float
    """(n,) at the first look, or (0,)."""
    image: Float32

    def look(self, start: int, stop: int) -> None:
        """After the first look has run: the errors it leaves."""
        around = self.planes, self.middle, self.mean, self.error
        look_around(start, stop, self.pixels, self.camera.width, *around)
        place(self.pixels[start:stop], self.mean[start:stop], self.image)

    def run(self, start: int, stop: int) -> None:
        rays, n = self.world.rays, self.cells**2
        count = (stop - start) * n
        view, surface = self.camera.view(self.T_world_camera), self.surface
        aperture = bool(view.lens[0] > 0.0)
        normalised, offsets = np.empty((count, 2)), np.empty((count, 2), np.float32)
        directions = np.empty((count, 3), np.float32)
        lens, planes = np.empty((count if aperture else 0, 2)), self.planes[start:stop]
        if aperture:
            planes = np.empty((count, 5))
        pixels = self.pixels[start:stop]
        if aperture:
            origins = np.empty((count, 3), np.float32)
            look = (rays.centre, normalised, offsets, lens, origins, directions)
            lens_rays(view, pair_table(), pixels, self.cells, self.seed, *look)
            triangle, _ = rays.intersect(origins, directions)
        else:
            camera_rays(view, pixels, self.cells, self.seed, self.cells > 1, normalised, offsets, directions)
            triangle = rays.from_point(self.T_world_camera[:3, 3], directions)
        values = np.empty((count, 2))
        origins, towards = np.empty((count, 3), np.float32), np.empty((count, 3), np.float32)
        far, sample = np.empty(count, np.float32), np.empty(count, np.int32)
        if aperture:
            shade = shade_glossy_lens if has_gloss(surface) else shade_diffuse_lens
        else:
            shade = shade_glossy if has_gloss(surface) else shade_diffuse
        shadows = shade(
            surface,
            view,
            triangle,
            normalised,
            offsets,
            lens,
            self.cells,
            invert(self.T_world_laser),
            self.T_world_laser[:3, 3].copy(),
            self.laser.packed(),
            np.array(reflectance_weights(self.laser.wavelength_nm)),
            rays.centre,
            rays.surface_offset,
            values,
            planes,
            origins,
            towards,
            far,
            sample,
        )
        blocked = rays.occluded(origins[:shadows], towards[:shadows], far[:shadows])
        result = self.mean[start:stop], self.error[start:stop]
        if aperture:
            gather_aperture(values, planes, lens, view.lens[0], blocked, sample, shadows, self.cells, *result)
        elif self.cells == 1:
            gather_first(values, blocked, sample, shadows, planes, self.middle[start:stop])
            return
        else:
            gather(values, blocked, sample, shadows, self.cells, *result)
        place(pixels, self.mean[start:stop], self.image)
