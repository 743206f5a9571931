"""Paths from the camera through a scene, in wavefronts: intersect, shade, connect, until none is left."""

from __future__ import annotations

import threading
from dataclasses import dataclass, field

import numpy as np

from render.ambient.directions import Draws
from render.ambient.light_sampling import Lights, pack_lights
from render.ambient.path_kernels import Bounce, Film, shade_diffuse, shade_glossy
from render.ambient.path_state import PathState, Samples, ShadowRays, accumulate_unoccluded, camera_rays
from render.ambient.random_walk import random_walk_step
from render.base.arrays import Float, Float32, Int
from render.base.errors import Cancelled
from render.base.threads import Cancel
from render.camera.view import View
from render.material.medium import MOST_STEPS
from render.sampling.low_discrepancy import pair_table
from render.scene.scene import Scene
from render.world.embree import RayScene
from render.world.interior_list import cross_hidden, has_overlaps, occluded_by_visible, pass_hidden, surroundings
from render.world.triangles import Surface, has_gloss, has_medium
from render.world.world import World

WAVEFRONT = 1 << 15
"""Most paths that go together: their states stay in the cache, and a room full of mirrors is left in time when
cancelled. Chosen, not tuned."""
UNBOUNDED = 1 << 30


class FirstWays:
    """Where the paths of a wavefront, each with a slot of its own, go from their first surface."""

    def __init__(self, slots: int) -> None:
        self.direction = np.zeros((slots, 3), np.float32)
        self.pdf = np.zeros(slots, np.float32)
        """1/sr; as in `PathState`, and 0 where a path ends."""
        self.before = np.zeros(slots)
        """The sum over R, G, B of what they have seen so far."""

    def take(self, paths: PathState, n: int, sums: Float) -> None:
        """Of the first n paths, and what all have added to sums (slots, 4)."""
        slots = paths.pixel_slot[:n]
        self.direction[slots], self.pdf[slots] = paths.direction[:n], paths.bsdf_pdf[:n]
        self.before[:] = sums[:, :3].sum(axis=1)


@dataclass(frozen=True)
class CameraPaths:
    """A scene and a camera, ready to be sampled."""

    surface: Surface
    rays: RayScene
    lights: Lights
    view: View
    surfaces: int
    """The most that light may meet, counted as in `render.ambient.path_kernels`."""
    clamp: float
    """The most radiance that a contribution by way of two and more surfaces may add; infinite: no clamp."""
    seed: int
    interior: int
    """The overlapping bodies that the camera is within (`render.world.interior_list`)."""
    immersed: float
    """What radiance gains where the camera is: the square of the refractive index there."""
    _scratch: threading.local = field(default_factory=threading.local, repr=False, compare=False)

    def add(
        self,
        pixels: Int,
        first: Int,
        count: Int,
        film: Film,
        cancelled: Cancel | None,
        draws: Draws | None = None,
        ways: FirstWays | None = None,
    ) -> None:
        """Samples first .. first + count, (m, 2) for both halves, of the pixels (m,), at most WAVEFRONT in all.

        What they see is added to the film. draws: in place of numbers that follow from the pixels, and no guide; ways:
        filled where there is one sample of each half. Raises Cancelled.
        """
        paths, shadow_rays = self._arrays()
        rays, glossy, media = self.rays, has_gloss(self.surface), has_medium(self.surface)
        shade = shade_glossy if glossy else shade_diffuse
        keys, guide = Draws(pixels) if draws is None else draws
        samples, (sums, counts) = Samples(pair_table(), self.seed, keys, guide), film
        n = camera_rays(self.view, samples, pixels, first, count, rays.centre, paths)
        nested = has_overlaps(self.surface)
        paths.interior[:n] = self.interior
        if self.immersed != 1.0:
            paths.throughput[:n] *= self.immersed
        depth = 0
        while n > 0:
            if cancelled is not None and cancelled():
                raise Cancelled
            # only rays of neighbouring pixels go much the same way, and those from where they meet a surface to a lamp
            side_by_side = depth == 0
            triangle, distance = rays.intersect(paths.origin[:n], paths.direction[:n], coherent=side_by_side)
            if media:
                self._walk(paths, n, depth, samples, triangle, distance, cancelled)
            if nested:
                ahead = paths.origin[:n], paths.direction[:n], triangle, paths.interior[:n]
                pass_hidden(self.surface, rays, *ahead)
            bounce = Bounce(rays.centre, rays.surface_offset, depth, self.surfaces, self.clamp)
            n, connected = shade(self.surface, self.lights, bounce, samples, triangle, paths, shadow_rays, film)
            if connected:
                ends = shadow_rays.origin[:connected], shadow_rays.direction[:connected], shadow_rays.far[:connected]
                if nested:
                    blocked = occluded_by_visible(self.surface, rays, *ends, shadow_rays.interior[:connected])
                else:
                    blocked = rays.occluded(*ends, coherent=side_by_side)
                accumulate_unoccluded(shadow_rays, blocked, self.clamp if depth > 0 else np.inf, sums, counts)
            if ways is not None and depth == 0:
                ways.take(paths, n, sums)
            depth += 1

    def _walk(
        self,
        paths: PathState,
        n: int,
        depth: int,
        samples: Samples,
        triangle: Int,
        distance: Float32,
        cancelled: Cancel | None,
    ) -> None:
        """Take every path within a medium to its boundary."""
        walking = np.flatnonzero(paths.medium[:n]).astype(np.int32)
        distance, nested = distance[walking], has_overlaps(self.surface)
        for step in range(MOST_STEPS):
            before = walking.copy() if nested else walking
            left = random_walk_step(walking, distance, self.surface.rows, samples, depth, step, paths, triangle)
            walking = walking[:left]
            if nested:
                # a flight that ends on a hidden boundary goes on beyond it, as if it had begun there
                ended = np.setdiff1d(before, walking, assume_unique=True)
                ahead = paths.origin, paths.direction, triangle, paths.interior, self.rays.centre
                walking = np.append(walking, cross_hidden(self.surface, self.rays, ended, *ahead))
            if not len(walking):
                break
            if cancelled is not None and cancelled():
                raise Cancelled
            triangle[walking], distance = self.rays.intersect(paths.origin[walking], paths.direction[walking])

    def _arrays(self) -> tuple[PathState, ShadowRays]:
        """Of this thread: fresh ones would cost as much as tracing, in pages that the system must clear."""
        arrays: tuple[PathState, ShadowRays] | None = getattr(self._scratch, "arrays", None)
        if arrays is None:
            m = 2 * WAVEFRONT
            paths = PathState(
                origin=np.empty((WAVEFRONT, 3), np.float32),
                direction=np.empty((WAVEFRONT, 3), np.float32),
                throughput=np.empty((WAVEFRONT, 3), np.float32),
                bsdf_pdf=np.empty(WAVEFRONT, np.float32),
                pixel_slot=np.empty(WAVEFRONT, np.int32),
                sample=np.empty(WAVEFRONT, np.int32),
                medium=np.empty(WAVEFRONT, np.int32),
                interior=np.empty(WAVEFRONT, np.int64),
            )
            shadow_rays = ShadowRays(
                origin=np.empty((m, 3), np.float32),
                direction=np.empty((m, 3), np.float32),
                far=np.empty(m, np.float32),
                light=np.empty((m, 3), np.float32),
                pixel_slot=np.empty(m, np.int32),
                interior=np.empty(m, np.int64),
            )
            arrays = self._scratch.arrays = paths, shadow_rays
        return arrays


def camera_paths(
    world: World,
    scene: Scene,
    view: View,
    *,
    surfaces: int | None = 1,
    clamp: float | None = None,
    seed: int = 0,
) -> CameraPaths:
    """surfaces: None for as many as roulette lets a path meet; clamp in W/(m^2 sr)."""
    surface = world.surface
    interior, index = surroundings(world, surface, view.T_world_camera[:3, 3])
    return CameraPaths(
        surface,
        world.rays,
        pack_lights(scene, surface),
        view,
        UNBOUNDED if surfaces is None else surfaces,
        np.inf if clamp is None else clamp,
        seed,
        interior,
        index * index,
    )
