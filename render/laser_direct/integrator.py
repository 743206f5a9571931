"""Direct light of a laser: each lit pixel's mean radiance under a box filter.

A pixel is sampled by one ray through its centre first (`render.laser_direct.centre_ray`). Where that is not enough
(edges, shadows, strong curvature, texture) it is divided into n x n cells with one jittered ray each
(`render.laser_direct.shading`). Each ray also predicts the mean over its whole pixel; the spread of these predictions
is the error estimate, from which `render.laser_direct.adaptive_sampling` computes the cells that each pixel needs. This
is repeated until the image's error is below the target. Through a thin lens each ray has its own point of the aperture;
`render.laser_direct.aperture` removes the noise of these points.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import partial

import numba
import numpy as np
from numpy.typing import NDArray

from render.base.arrays import Float, Float32, Int
from render.base.pose import invert
from render.base.threads import map_chunks
from render.camera.camera import Camera
from render.camera.rays import LensRays, camera_rays, lens_rays
from render.laser.laser import LineLaser
from render.laser_direct.adaptive_sampling import cells_needed, grade_neighbours, raise_neighbour_errors
from render.laser_direct.aperture import gather_aperture
from render.laser_direct.centre_ray import estimate_errors, gather_centre_rays
from render.laser_direct.rasterise import rasterise_sheet
from render.laser_direct.shading import (
    CellRays,
    ShadowRays,
    Sheet,
    gather,
    shade_diffuse,
    shade_diffuse_lens,
    shade_glossy,
    shade_glossy_lens,
    write_pixels,
)
from render.material.material import reflectance_weights
from render.run import Run
from render.sampling.low_discrepancy import pair_table
from render.world.triangles import Surface, has_gloss
from render.world.world import World

Indices = NDArray[np.int64]

RAYS_PER_JOB = 1 << 13
"""Large enough to hide Python's overhead, small enough to balance the threads and to stay in the processor's cache."""
SAFETY = 0.9
"""Fraction of the target that is aimed at: lower costs rays, higher more rounds where an estimate was too low."""
NEGLIGIBLE_ERROR = 0.25
"""Fraction of its equal share of the target below which a pixel is not refined further."""
MAX_GROWTH = 4
"""Largest factor by which a pixel's cells a side grow in a round: more would save rounds, but trust few rays."""
EDGE_ORDER, APERTURE_ORDER = 3.0, 2.25
"""Powers of the cells a side with which the variance falls: at an edge, and at an edge seen through an aperture."""
EDGE_ERROR, EDGE_ERROR_ORDER = 0.3, 5.0
"""Error of a neighbour of one cell whose corner may lie beyond the edge unseen, as a fraction of the jump at the edge;
and the power of its cells a side with which the variance falls.
"""
BORDER_ERROR = 0.35
"""RMS area beyond an edge along a pixel's border that no ray met, times the square of the cells a side."""
NEIGHBOUR_ERROR_RATIO = 0.2
"""Lower bound on the neighbours' errors, as a fraction of a pixel's own at equal cells: the few rays of a pixel seen
through an aperture may agree by chance.
"""


@dataclass(frozen=True)
class DirectImage:
    """Direct radiance of one laser, how well it is known, and what it took."""

    radiance: Float32
    """(h, w) W/(m^2 sr)."""
    error: float
    """Estimated relative RMS error over the lit pixels."""
    pixels: int
    """Number of lit pixels."""
    samples: int
    """Number of camera rays."""
    invalid: int
    """Number of contributions that were NaN, infinite or negative, and count as 0."""
    reached: Int
    """(n,) ascending flat indices of the pixels that the sheet may reach; all others are known to be dark."""
    standard_error: Float
    """(n,) estimated, of those, W/(m^2 sr)."""

    @property
    def known_error(self) -> Float:
        """(n,) `standard_error`, 0 of the pixels that are invalid."""
        known = (self.standard_error >= 0.0) & np.isfinite(self.standard_error)
        return np.where(known, self.standard_error, 0.0)


def direct_image(
    world: World,
    camera: Camera,
    laser: LineLaser,
    T_world_camera: Float,
    T_world_laser: Float,
    *,
    target: float = 0.01,
    run: Run = Run(),
) -> DirectImage:
    """Direct radiance of one laser to a target relative RMS error over the lit pixels. Raises Cancelled."""
    pixels = rasterise_sheet(world, camera, laser, T_world_camera, T_world_laser, run.threads)
    image = np.zeros(camera.height * camera.width, dtype=np.float32)
    # one ray samples one point of the aperture only, so centre rays do not do
    aperture = bool(camera.view(T_world_camera).lens[0] > 0.0)
    order = APERTURE_ORDER if aperture else EDGE_ORDER
    n = len(pixels)
    cells, wanted = np.zeros(n, np.int32), np.full(n, 2 if aperture else 1, np.int32)
    centre_rays = 0 if aperture else n
    surface = world.surface_at((laser.wavelength_nm,) * 3)
    weights = np.array(reflectance_weights(laser.wavelength_nm))
    sheet = Sheet(invert(T_world_laser), T_world_laser[:3, 3].copy(), laser.packed(), weights)
    task = _Task(
        world,
        surface,
        camera,
        T_world_camera,
        run.seed,
        has_gloss(surface),
        sheet,
        pixels,
        np.zeros(n),
        np.zeros(n),
        np.zeros(n),
        np.empty((centre_rays, 4)),
        np.empty(centre_rays),
    )
    samples, left = 0, 1.0

    while True:
        jobs, rays = schedule(cells, wanted)
        # the number of rounds is unknown: each reports half of the progress that is left
        run.between(1.0 - left, 1.0 - 0.5 * left).map(partial(task.run, jobs), len(jobs), 1)
        if samples == 0 and not aperture:
            map_chunks(task.predict_errors, n, max(1024, math.ceil(n / 4)), run.threads)
        samples += rays
        cells = wanted
        bounds = (
            (task.neighbour_error, APERTURE_ORDER, task.mean, 0.0)
            if aperture
            else (task.neighbour_error, EDGE_ERROR_ORDER, task.mean, BORDER_ERROR)
        )
        raise_neighbour_errors(task.error, *bounds, cells, pixels, camera.width)
        count, power, variance = sum_squares(task.mean, task.error)
        signal = math.sqrt(power / max(count, 1))
        relative = math.sqrt(variance / count) / signal if count else 0.0
        if relative > target:
            allowed, least = (SAFETY * target * signal) ** 2 * count, NEGLIGIBLE_ERROR * target * signal
            wanted = cells_needed(task.error, cells, allowed, least, order, MAX_GROWTH)
            wanted = grade_neighbours(wanted, cells, pixels, camera.width)
        if relative <= target or np.array_equal(wanted, cells):
            invalid = sum(task.invalid) + write_pixels(pixels, task.mean, image)
            radiance = image.reshape(camera.height, camera.width)
            return DirectImage(radiance, relative, count, samples, invalid, pixels, task.error)
        left *= 0.5


def schedule(cells: Int, wanted: Int) -> tuple[list[tuple[int, Indices]], int]:
    """Jobs of about RAYS_PER_JOB rays for the pixels that want more cells than they have, the finest first.

    A job is the cells a side and the indices of its pixels among the (n,). Also returns the number of rays.
    """
    jobs, rays = [], 0
    for level in range(int(wanted.max(initial=1)), 0, -1):
        if level & (level - 1):
            continue
        chosen = np.flatnonzero((wanted == level) & (cells < level))
        pieces = math.ceil(len(chosen) * level**2 / RAYS_PER_JOB)
        jobs += [(level, piece) for piece in np.array_split(chosen, pieces)] if pieces else []
        rays += len(chosen) * level**2
    return jobs, rays


@numba.njit(nogil=True, cache=True)
def sum_squares(radiance: Float, error: Float) -> tuple[int, float, float]:
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
    """The (n,) pixels of an image and their estimates so far: `run` traces some, each job with its own buffers."""

    world: World
    surface: Surface
    camera: Camera
    T_world_camera: Float
    seed: int
    glossy: bool
    sheet: Sheet
    pixels: Int
    mean: Float
    error: Float
    neighbour_error: Float
    """(n,) error that a pixel with several rays predicts for its neighbours, as for `raise_neighbour_errors`."""
    planes: Float
    """(n, 4) where centre rays are traced first, or (0, 4)."""
    middle: Float
    """(n,) where centre rays are traced first, or (0,)."""
    invalid: list[int] = field(default_factory=list)

    def predict_errors(self, start: int, stop: int) -> None:
        """Fill mean and error of pixels start..stop once every pixel has its centre ray."""
        around = self.planes, self.middle, self.mean, self.error
        estimate_errors(start, stop, self.pixels, self.camera.width, *around)

    def run(self, jobs: list[tuple[int, Indices]], start: int, stop: int) -> None:
        for cells, chosen in jobs[start:stop]:
            self._trace(cells, chosen)

    def _trace(self, cells: int, chosen: Indices) -> None:
        rays, n, pixels = self.world.rays, cells**2, self.pixels[chosen]
        count = len(pixels) * n
        view, surface = self.camera.view(self.T_world_camera), self.surface
        aperture = bool(view.lens[0] > 0.0)
        normalised, offsets = np.empty((count, 2)), np.empty((count, 2), np.float32)
        directions = np.empty((count, 3), np.float32)
        lens, planes = np.empty((count if aperture else 0, 2)), np.empty((0, 4))
        if aperture:
            planes = np.empty((count, 5))
            origins = np.empty((count, 3), np.float32)
            outputs = LensRays(normalised, offsets, lens, origins, directions)
            lens_rays(view, pair_table(), pixels, cells, self.seed, rays.centre, outputs)
            triangle, _ = rays.intersect(origins, directions, coherent=True)
        else:
            if cells == 1:
                planes = np.empty((count, 4))
            camera_rays(view, pixels, cells, self.seed, cells > 1, normalised, offsets, directions)
            triangle = rays.from_point(self.T_world_camera[:3, 3], directions)
        values = np.empty((count, 2))
        origins, towards = np.empty((count, 3), np.float32), np.empty((count, 3), np.float32)
        far, sample = np.empty(count, np.float32), np.empty(count, np.int32)
        if aperture:
            shade = shade_glossy_lens if self.glossy else shade_diffuse_lens
        else:
            shade = shade_glossy if self.glossy else shade_diffuse
        buffers = ShadowRays(rays.centre, rays.surface_offset, origins, towards, far, sample)
        cell_rays = CellRays(triangle, normalised, offsets, lens, cells)
        shadows, invalid = shade(surface, view, cell_rays, self.sheet, buffers, values, planes)
        self.invalid.append(invalid)
        blocked = rays.occluded(origins[:shadows], towards[:shadows], far[:shadows], coherent=True)
        mean, error, jump = (np.empty(len(pixels)) for _ in range(3))
        if aperture:
            gather_aperture(values, planes, lens, view.lens[0], blocked, sample, shadows, cells, mean, error)
            self.neighbour_error[chosen] = NEIGHBOUR_ERROR_RATIO * error * cells ** (0.5 * APERTURE_ORDER)
        elif cells == 1:
            gather_centre_rays(values, blocked, sample, shadows, planes, mean)
            self.planes[chosen], self.middle[chosen] = planes, mean
            return
        else:
            gather(values, blocked, sample, shadows, cells, mean, error, jump)
            self.neighbour_error[chosen] = EDGE_ERROR * jump
        self.mean[chosen], self.error[chosen] = mean, error
