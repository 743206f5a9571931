"""One pass: a batch of paths from the laser and from the camera, each surface of the ones joined to the others.

A wavefront: all rays of a chunk are traced, their vertices joined, and scattered, until none is left.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numba
import numpy as np
from numpy.typing import NDArray

from render.base.errors import Cancelled
from render.base.pose import invert
from render.base.threads import Cancel
from render.camera.camera import Camera
from render.camera.distortion import tilt_matrix
from render.camera.lens import chief_ray, lens_direction, lens_position
from render.camera.view import View
from render.laser.laser import LineLaser
from render.laser_indirect.connection_buffer import Joints, Lit, Take, count_joints, no_joints
from render.laser_indirect.connections import (
    begin_camera,
    begin_light,
    hint_at,
    join_camera,
    join_laser,
    joinable,
    path_lens_point,
)
from render.laser_indirect.guiding import Guide, any_clear, draw_paths
from render.laser_indirect.path_vertex import (
    BENT,
    CLEAR,
    DVC,
    DVCM,
    LONE,
    MEDIUM,
    MOST_BOUNCES,
    NUMBER,
    PART,
    PIXEL,
    POWER,
    STATE,
    UNJOINED,
    VERTEX,
    interact,
    scatter,
)
from render.laser_indirect.photon_emission import Fan, Paths, emit
from render.laser_indirect.photon_merging import SHRINK, Photons, merge, photons
from render.laser_indirect.random_walk import scatter_inside
from render.laser_indirect.ris import join_light
from render.material.material import reflectance_weights
from render.material.medium import MOST_STEPS
from render.sampling.random import uniform, wrapped
from render.world.triangles import Surface
from render.world.world import World

Float = NDArray[np.float64]
Int = NDArray[np.int32]

CHUNK_PATHS = 1 << 13
"""Short enough to be cancelled within a tenth of a second."""
CANDIDATES, LATER_CANDIDATES = 8, 2
"""Light vertices weighed against each other at the first surface that the camera sees, and at those after it."""
CAMERA_SEED = 0x5DEECE66D
KINDS = 5


@dataclass(frozen=True)
class LightPass:
    """What all passes of a render have in common; `run` makes one."""

    world: World
    surface: Surface
    view: View
    height: int
    beam: Float
    weights: Float
    T_world_laser: Float
    T_laser_world: Float
    reach: float
    """Middle distance of the part from the laser, m."""
    seed: int
    kinds: int
    """Of light that is wanted, besides plain interreflection."""
    clear: bool
    """Some material is a mirror or clear glass."""

    @classmethod
    def of(
        cls,
        world: World,
        camera: Camera,
        laser: LineLaser,
        T_world_camera: Float,
        T_world_laser: Float,
        reach: float,
        seed: int,
        kinds: int,
    ) -> LightPass:
        surface = world.surface_at((laser.wavelength_nm,) * 3)
        return cls(
            world,
            surface,
            camera.view(T_world_camera),
            camera.height,
            laser.packed(),
            np.array(reflectance_weights(laser.wavelength_nm)),
            T_world_laser,
            invert(T_world_laser),
            reach,
            seed,
            kinds,
            bool(kinds & BENT) and any_clear(surface),
        )

    def run(
        self,
        number: int,
        paths: int,
        fan: Fan,
        samples: Float,
        looked_at: Int,
        guide: Guide,
        take: Take,
        cancelled: Cancel | None,
        hints: NDArray[np.bool_] | None = None,
    ) -> None:
        """Pass `number`: light paths, and camera paths, samples (pixels,) to be expected. Raises Cancelled.

        looked_at: the pixels that may have a camera path, in order.
        """
        seed = wrapped(self.seed * 1_000_003 + number)
        pixels, starts = draw_paths(samples, looked_at, seed ^ CAMERA_SEED)
        found: list[tuple[int, Float, Float]] = []
        for first in range(0, paths, CHUNK_PATHS):
            joined = len(pixels) > 0 or hints is not None
            count = min(CHUNK_PATHS, paths - first)
            found += self.light(seed, first, count, paths, fan, samples, take, joined, cancelled)
        for _, vertex, state in found if hints is not None else ():
            _stop(cancelled)
            hint_at(vertex, state, self.view, self.height, hints, paths, take)
        if not len(pixels):
            return
        _stop(cancelled)
        merged = self.photons(found, number, paths) if self.clear and self.kinds & UNJOINED else None
        near = _lit([part for part in found if part[0] == 0], True, paths)
        later = _lit([part for part in found if part[0] > 0], False, paths)
        chunks = np.searchsorted(starts, np.arange(0, starts[-1] + CHUNK_PATHS, CHUNK_PATHS))
        for a, b in pairwise(np.minimum(chunks, len(pixels))):
            self.eye(
                seed ^ CAMERA_SEED,
                pixels[a:b],
                samples,
                starts[a : b + 1],
                near,
                later,
                merged,
                paths,
                fan,
                guide,
                take,
                cancelled,
            )

    def light(
        self,
        seed: int,
        first: int,
        count: int,
        paths: int,
        fan: Fan,
        samples: Float,
        take: Take,
        wanted: bool,
        cancelled: Cancel | None = None,
    ) -> list[tuple[int, Float, Float]]:
        """Trace light paths, join them to the camera; if wanted their joinable vertices and states, by depth.

        Raises Cancelled.
        """
        rays, rows = self.world.rays, self.surface.rows
        start = np.array([uniform(seed, 0, dimension, 99) for dimension in range(5)])
        long = np.empty((2, count), np.int64)
        emitted = Paths(np.empty((count, 3)), np.empty((count, 3)), np.empty(count), long[0], long[1])
        emit(first, paths, start, fan, self.reach, self.beam, self.T_world_laser, emitted)
        origin, direction = emitted.origin, emitted.direction
        state = np.zeros((count, STATE))
        state[:, POWER], state[:, LONE], state[:, NUMBER] = emitted.power, 1.0, emitted.number
        state[:, PART] = emitted.part
        joints = no_joints(count)
        kept = []
        for depth in range(MOST_BOUNCES):
            _stop(cancelled)
            vertex, state = self.meet(seed, depth, origin, direction, state)
            if not len(vertex):
                break
            if depth == 0:
                begin_light(vertex, state, self.T_laser_world, self.beam, fan)
            else:
                joined = join_camera(
                    vertex,
                    state,
                    rows,
                    self.view,
                    self.height,
                    samples,
                    paths,
                    seed,
                    depth,
                    rays.centre,
                    rays.surface_offset,
                    joints,
                )
                self.count(joints, joined, 1.0 / paths, take)
            if wanted:
                kept.append((depth, *joinable(vertex, state, rows)))
            n = scatter(
                vertex,
                state,
                rows,
                seed,
                depth,
                start[2:],
                True,
                self.kinds,
                rays.surface_offset,
                origin,
                direction,
            )
            origin, direction, state = origin[:n], direction[:n], state[:n]
        return kept

    def eye(
        self,
        seed: int,
        pixels: Int,
        samples: Float,
        starts: Int,
        near: Lit,
        later: Lit,
        merged: Photons | None,
        paths: int,
        fan: Fan,
        guide: Guide,
        take: Take,
        cancelled: Cancel | None,
    ) -> None:
        """Trace camera paths of pixels numbered from `starts`; join them to the laser and to light vertices.

        Raises Cancelled.
        """
        rays, rows = self.world.rays, self.surface.rows
        count = int(starts[-1] - starts[0])
        origin, direction, state = np.empty((count, 3)), np.empty((count, 3)), np.zeros((count, STATE))
        pixel_rays(self.view, pixels, samples, starts, seed, origin, direction, state)
        joints = no_joints(count)
        unused = np.zeros(3)
        for depth in range(MOST_BOUNCES):
            _stop(cancelled)
            vertex, state = self.meet(seed, depth, origin, direction, state)
            if not len(vertex):
                break
            if depth == 0:
                begin_camera(vertex, state, self.view, samples, paths, seed)
            else:
                joined = join_laser(
                    vertex,
                    state,
                    rows,
                    self.T_laser_world,
                    self.beam,
                    fan,
                    rays.centre,
                    rays.surface_offset,
                    joints,
                )
                self.count(joints, joined, 1.0, take)
            if merged is not None:
                merge(vertex, state, rows, merged, take)
            few = CANDIDATES if depth == 0 else LATER_CANDIDATES
            for stream, lit, candidates in ((16, near, few), (20, later, 1)):
                joined = join_light(
                    vertex,
                    state,
                    lit,
                    rows,
                    candidates,
                    guide,
                    take.learnt,
                    seed,
                    depth,
                    stream,
                    rays.centre,
                    rays.surface_offset,
                    joints,
                )
                self.count(joints, joined, 1.0, take)
            n = scatter(
                vertex, state, rows, seed, depth, unused, False, self.kinds, rays.surface_offset, origin, direction
            )
            origin, direction, state = origin[:n], direction[:n], state[:n]

    def meet(self, seed: int, depth: int, origin: Float, direction: Float, state: Float) -> tuple[Float, Float]:
        """The next vertex of each path that has one, and its state."""
        vertex = np.empty((len(origin), VERTEX))
        if not len(origin):
            return vertex, state
        rays, rows = self.world.rays, self.surface.rows
        start, towards = (origin - rays.centre).astype(np.float32), direction.astype(np.float32)
        # a chunk's first rays lie side by side in the image, or in the sheet
        triangle, distance = rays.intersect(start, towards, coherent=depth == 0)
        walking = np.flatnonzero(state[:, MEDIUM]).astype(np.int32)
        distance = distance[walking]
        for step in range(MOST_STEPS):
            left = scatter_inside(walking, distance, state, rows, seed, depth, step, origin, direction, triangle)
            if not left:
                break
            walking = walking[:left]
            triangle[walking], distance = rays.intersect(
                (origin[walking] - rays.centre).astype(np.float32), direction[walking].astype(np.float32)
            )
        n = interact(self.surface, self.weights, seed, depth, origin, direction, triangle, state, vertex)
        return vertex[:n], state[:n]

    def count(self, joints: Joints, joined: int, scale: float, take: Take) -> None:
        """Add the joints that nothing blocks."""
        if joined:
            blocked = self.world.rays.occluded(joints.origin[:joined], joints.direction[:joined], joints.far[:joined])
            count_joints(joints, blocked, joined, scale, take)

    def photons(self, parts: list[tuple[int, Float, Float]], number: int, paths: int) -> Photons:
        """The light vertices that only merging can use; the radius is a pixel's, less with each pass."""
        vertex = np.concatenate([part[1] for part in parts])
        state = np.concatenate([part[2] for part in parts])
        distance = np.linalg.norm(vertex[:, :3] - self.view.T_world_camera[:3, 3], axis=1)
        pixel = float(np.median(distance)) / max(self.view.intrinsics[:2]) if len(vertex) else 1.0
        return photons(vertex, state, pixel * (1.0 + number) ** -SHRINK, paths)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def pixel_rays(
    view: View, pixels: Int, samples: Float, first: Int, seed: int, origin: Float, direction: Float, state: Float
) -> None:
    """Camera paths for (n,) pixels, numbered from `first` (n + 1,), spread over each pixel's area."""
    tilt = tilt_matrix(view.distortion[12], view.distortion[13])
    distorted = bool(np.any(view.distortion))
    r = 0
    for n in range(pixels.shape[0]):
        pixel = pixels[n]
        column, row = pixel % view.width, pixel // view.width
        u0, v0 = uniform(seed, pixel, 0, 90), uniform(seed, pixel, 0, 91)
        count = first[n + 1] - first[n]
        # where every pass has one, their number need not be known beforehand
        power = 1.0 / count if samples[pixel] >= 1.0 else 1.0 / samples[pixel]
        for sample in range(count):
            u = column - 0.5 + (u0 + sample * 0.7548776662466927) % 1.0
            v = row - 0.5 + (v0 + sample * 0.5698402909980532) % 1.0
            x, y, ok = chief_ray(view, tilt, distorted, u, v)
            a, b = path_lens_point(view, seed, first[n] + sample)
            origin[r, 0], origin[r, 1], origin[r, 2] = lens_position(view, a, b)
            d0, d1, d2 = lens_direction(view, x, y, a, b)
            length = math.sqrt(d0 * d0 + d1 * d1 + d2 * d2) if ok else math.inf
            direction[r, 0], direction[r, 1], direction[r, 2] = d0 / length, d1 / length, d2 / length
            state[r, POWER], state[r, DVCM], state[r, DVC] = power, 0.0, 0.0
            state[r, LONE], state[r, CLEAR] = 1.0, 0.0
            state[r, NUMBER], state[r, PIXEL] = first[n] + sample, pixel
            r += 1


def _lit(parts: list[tuple[int, Float, Float]], ordered: bool, paths: int) -> Lit:
    """Light vertices of all chunks."""
    vertex = np.concatenate([np.zeros((0, VERTEX)), *(part[1] for part in parts)])
    state = np.concatenate([np.zeros((0, STATE)), *(part[2] for part in parts)])
    return Lit(vertex, state, ordered, paths)


def _stop(cancelled: Cancel | None) -> None:
    if cancelled is not None and cancelled():
        raise Cancelled
