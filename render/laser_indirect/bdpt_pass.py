"""One pass of bidirectional path tracing: paths from the laser and from the camera, connected at every vertex.

A wavefront: all rays of a chunk are traced, their vertices connected, and scattered, until none is left.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from render.base.arrays import Bool, Float, Long
from render.base.errors import Cancelled
from render.base.pose import invert
from render.base.threads import Cancel
from render.camera.camera import Camera
from render.camera.view import View
from render.laser.laser import LineLaser
from render.laser_indirect.chain_connections import Walks, empty_walks, splat_walks, walk_to_camera
from render.laser_indirect.connection_buffer import Connections, PassBuffer, empty_connections, splat_unoccluded
from render.laser_indirect.connections import (
    CameraSampling,
    LaserSampling,
    connect_to_camera,
    connect_to_laser,
    connectable,
    init_camera_mis,
    init_light_mis,
    mark_reachable,
)
from render.laser_indirect.guiding import any_specular
from render.laser_indirect.path_vertex import (
    ALL_KINDS,
    CAUSTIC,
    MOST_BOUNCES,
    PATH,
    SPECULAR_CHAIN,
    VERTEX,
    PassContext,
    Records,
    intersect,
    scatter,
)
from render.laser_indirect.photon_emission import FanDistribution, Photons, emit
from render.laser_indirect.photon_merging import RADIUS_EXPONENT, PhotonMap, merge, photon_map
from render.laser_indirect.pixel_rays import pixel_rays
from render.laser_indirect.random_walk import random_walk_step
from render.laser_indirect.ris import LightVertices, connect_by_ris
from render.laser_indirect.sampling import DrawnPaths, Sampling
from render.laser_indirect.specular_chains import ChainIndex, lit_chains, mark_listed, seen_chains
from render.material.material import reflectance_weights
from render.material.medium import MOST_STEPS
from render.run import Run
from render.sampling.random import uniform, wrapped
from render.world.interior_list import cross_hidden, has_overlaps, occluded_by_visible, pass_hidden, surroundings
from render.world.placed import PlacedLaser
from render.world.triangles import Surface
from render.world.world import World

Vertices = tuple[int, Records, Records]
"""Depth, and the connectable vertices and paths of a chunk there."""

CHUNK_PATHS = 1 << 13
"""Short enough to be cancelled within a tenth of a second."""
CANDIDATES, LATER_CANDIDATES = 8, 2
"""Light vertices of the first surface weighed against each other, at the camera's first surface and those after it."""
CAMERA_SEED = 0x5DEECE66D
"""Parts the random numbers of camera paths from those of light paths."""
NOWHERE: Bool = np.zeros(0, np.bool_)
KINDS = 5
"""Sums of a pass: of each combination of the bits CAUSTIC and SUBSURFACE_LIGHT, and of SPECULAR_CHAIN by itself."""


@dataclass(frozen=True)
class BdptPass:
    """What all passes of a render have in common; `run` makes one."""

    world: World
    surface: Surface
    camera: Camera
    view: View
    laser: LineLaser
    weights: Float
    """(3,) of the RGB reflectance at the laser's wavelength."""
    T_world_laser: Float
    reference_distance: float
    """Middle distance of the part from the laser, m."""
    seed: int
    kinds: int
    """Kinds of light that are traced besides plain interreflection (`render.laser_indirect.path_vertex`)."""
    specular: bool
    """Some material is a mirror or clear glass."""
    nested: bool
    """Some transparent bodies overlap."""
    interiors: tuple[int, int]
    """Of them, those that the laser and the camera are within (`render.world.interior_list`)."""
    chains: ChainIndex | None
    """Plane mirrors and glass before the camera, over which light is found by walks; None: there are none."""
    lit_chains: tuple[ChainIndex, ...]
    """Likewise before the laser."""
    clear: Bool = field(default_factory=lambda: NOWHERE)
    """(pixels,) where light over `lit_chains` is integrated (`render.laser_indirect.clear_light`); (0,): nowhere."""

    @classmethod
    def of(
        cls, placed: PlacedLaser, reference_distance: float, seed: int, kinds: int = ALL_KINDS, run: Run = Run()
    ) -> BdptPass:
        """Of one laser; run: whose memory has the chains, if another asked for them."""
        world, camera, laser, T_world_camera, T_world_laser = placed
        surface = world.surface_at((laser.wavelength_nm,) * 3)
        nested, ends = has_overlaps(surface), (T_world_laser[:3, 3], T_world_camera[:3, 3])
        at_laser, at_camera = (surroundings(world, surface, end)[0] if nested else 0 for end in ends)
        specular = bool(kinds & CAUSTIC) and any_specular(surface)
        walked = specular and bool(kinds & SPECULAR_CHAIN) and not nested
        return cls(
            world=world,
            surface=surface,
            camera=camera,
            view=camera.view(T_world_camera),
            laser=laser,
            weights=np.array(reflectance_weights(laser.wavelength_nm)),
            T_world_laser=T_world_laser,
            reference_distance=reference_distance,
            seed=seed,
            kinds=kinds,
            specular=specular,
            nested=nested,
            interiors=(at_laser, at_camera),
            chains=seen_chains(world, surface, camera, T_world_camera, run) if walked else None,
            lit_chains=lit_chains(world, surface, laser, T_world_laser, run) if specular and not nested else (),
        )

    def run(
        self,
        number: int,
        sampling: Sampling,
        buffer: PassBuffer,
        cancelled: Cancel | None = None,
        specular_pixels: Bool | None = None,
    ) -> None:
        """Pass `number`, into `buffer`. Raises Cancelled.

        specular_pixels (pixels,): where the camera sees mirrors or clear glass; `buffer.camera_radiance` is then filled
        there, roughly, for the camera paths of later passes. None: it is not.
        """
        seed = wrapped(self.seed * 1_000_003 + number)
        drawn = sampling.drawn(seed ^ CAMERA_SEED)
        keep = len(drawn.pixels) > 0 or specular_pixels is not None
        found: list[Vertices] = []
        for first in range(0, sampling.light_paths, CHUNK_PATHS):
            count = min(CHUNK_PATHS, sampling.light_paths - first)
            found += self.trace_light_paths(seed, first, count, sampling, buffer, keep, cancelled)
        for _, vertices, paths in found if specular_pixels is not None else ():
            _stop(cancelled)
            mark_reachable(vertices, paths, self._camera(sampling), specular_pixels, buffer)
        if not len(drawn.pixels):
            return
        _stop(cancelled)
        photons = self.photon_map(found, number, sampling) if self.specular and self.kinds & SPECULAR_CHAIN else None
        light_vertices = (
            _light_vertices(
                [part for part in found if part[0] == 0], True, sampling, (CANDIDATES, LATER_CANDIDATES), 16
            ),
            _light_vertices([part for part in found if part[0] > 0], False, sampling, (1, 1), 20),
        )
        chunks = np.searchsorted(drawn.starts, np.arange(0, drawn.starts[-1] + CHUNK_PATHS, CHUNK_PATHS))
        for a, b in pairwise(np.minimum(chunks, len(drawn.pixels))):
            some = DrawnPaths(drawn.pixels[a:b], drawn.keys[a:b], drawn.starts[a : b + 1])
            self.trace_camera_paths(seed ^ CAMERA_SEED, some, sampling, light_vertices, photons, buffer, cancelled)

    def trace_light_paths(
        self,
        seed: int,
        first: int,
        count: int,
        sampling: Sampling,
        buffer: PassBuffer,
        keep: bool,
        cancelled: Cancel | None = None,
    ) -> list[Vertices]:
        """Trace light paths first .. first + count, splat them to the camera; if `keep`, what can be connected to.

        Raises Cancelled.
        """
        context, laser, camera = self.context(seed), self.laser_sampling(sampling.fan), self._camera(sampling)
        shift = np.array([uniform(seed, 0, dimension, 99) for dimension in range(5)])
        long = np.empty((2, count), np.int64)
        emitted = Photons(np.empty((count, 3)), np.empty((count, 3)), np.empty(count), long[0], long[1])
        emit(
            first,
            sampling.light_paths,
            shift,
            self.reference_distance,
            laser.beam,
            laser.fan,
            self.T_world_laser,
            emitted,
        )
        origin, direction = emitted.origin, emitted.direction
        paths = begun_paths(count, self.interiors[0])
        paths["throughput"], paths["index"], paths["fan_bin"] = emitted.power, emitted.path_index, emitted.fan_bin
        connections = empty_connections(count)
        kept: list[Vertices] = []
        for depth in range(MOST_BOUNCES):
            _stop(cancelled)
            vertices, paths = self.intersect(context, depth, origin, direction, paths)
            if not len(vertices):
                break
            if depth == 0:
                init_light_mis(vertices, paths, laser)
            else:
                for chains in self.lit_chains:
                    mark_listed(vertices, paths, chains)
                connected = connect_to_camera(vertices, paths, context, camera, depth, connections)
                self.splat(connections, connected, 1.0 / sampling.light_paths, buffer)
                if self.chains is not None and self.kinds & SPECULAR_CHAIN:
                    self.walk(vertices, paths, self.chains, context, camera, depth, buffer)
            if keep:
                kept.append((depth, *connectable(vertices, paths, context.rows)))
            n = scatter(vertices, paths, context, depth, shift[2:], True, origin, direction)
            origin, direction, paths = origin[:n], direction[:n], paths[:n]
        return kept

    def trace_camera_paths(
        self,
        seed: int,
        drawn: DrawnPaths,
        sampling: Sampling,
        light_vertices: tuple[LightVertices, ...],
        photons: PhotonMap | None,
        buffer: PassBuffer,
        cancelled: Cancel | None,
    ) -> None:
        """Trace camera paths of some pixels; connect them to the laser and to light vertices.

        Raises Cancelled.
        """
        context, laser, camera = self.context(seed), self.laser_sampling(sampling.fan), self._camera(sampling)
        count = int(drawn.starts[-1] - drawn.starts[0])
        origin, direction, paths = np.empty((count, 3)), np.empty((count, 3)), begun_paths(count, self.interiors[1])
        pixel_rays(camera, drawn, seed, origin, direction, paths)
        connections = empty_connections(count)
        unused = np.zeros(3)
        for depth in range(MOST_BOUNCES):
            _stop(cancelled)
            vertices, paths = self.intersect(context, depth, origin, direction, paths)
            if not len(vertices):
                break
            if depth == 0:
                init_camera_mis(vertices, paths, camera, seed)
            else:
                self.splat(connections, connect_to_laser(vertices, paths, context, laser, connections), 1.0, buffer)
            if photons is not None:
                if self.chains is not None:
                    mark_listed(vertices, paths, self.chains)
                merge(vertices, paths, context.rows, photons, self.clear, buffer)
            for light in light_vertices:
                connected = connect_by_ris(vertices, paths, light, sampling.guide, depth, context, buffer, connections)
                self.splat(connections, connected, 1.0, buffer)
            n = scatter(vertices, paths, context, depth, unused, False, origin, direction)
            origin, direction, paths = origin[:n], direction[:n], paths[:n]

    def intersect(
        self, context: PassContext, depth: int, origin: Float, direction: Float, paths: Records
    ) -> tuple[Records, Records]:
        """The next vertex of each path that has one, and these paths."""
        vertices = np.empty(len(origin), VERTEX)
        if not len(origin):
            return vertices, paths
        rays = self.world.rays
        start, towards = (origin - rays.centre).astype(np.float32), direction.astype(np.float32)
        # a chunk's first rays lie side by side in the image, or in the sheet
        triangle, distance = rays.intersect(start, towards, coherent=depth == 0)
        walking = np.flatnonzero(paths["medium"] >= 0).astype(np.int32)
        distance = distance[walking]
        for step in range(MOST_STEPS):
            before = walking.copy() if self.nested else walking
            left = random_walk_step(walking, distance, paths, context, depth, step, origin, direction, triangle)
            walking = walking[:left]
            if self.nested:
                # a flight that ends on a hidden boundary goes on beyond it, as if it had begun there
                ended = np.setdiff1d(before, walking, assume_unique=True)
                ahead = origin, direction, triangle, paths["interior"], np.zeros(3)
                walking = np.append(walking, cross_hidden(self.surface, rays, ended, *ahead))
            if not len(walking):
                break
            triangle[walking], distance = rays.intersect(
                (origin[walking] - rays.centre).astype(np.float32), direction[walking].astype(np.float32)
            )
        if self.nested:
            interior = paths["interior"].copy()
            pass_hidden(self.surface, rays, (origin - rays.centre).astype(np.float32), towards, triangle, interior)
            paths["interior"] = interior
        n = intersect(self.surface, context, depth, origin, direction, triangle, paths, vertices)
        return vertices[:n], paths[:n]

    def splat(self, connections: Connections, connected: int, scale: float, buffer: PassBuffer) -> None:
        """Splat the connections that nothing occludes."""
        if connected:
            ends = connections.origin[:connected], connections.direction[:connected], connections.distance[:connected]
            if self.nested:
                interior = connections.interior[:connected]
                occluded = occluded_by_visible(self.surface, self.world.rays, *ends, interior)
            else:
                occluded = self.world.rays.occluded(*ends)
            splat_unoccluded(connections, occluded, connected, scale, buffer)

    def walk(
        self,
        vertices: Records,
        paths: Records,
        chains: ChainIndex,
        context: PassContext,
        camera: CameraSampling,
        depth: int,
        buffer: PassBuffer,
    ) -> None:
        """Splat what comes from light vertices to the camera over listed chains and is not occluded."""
        first, counts = 0, np.zeros(2, np.int64)
        walks = empty_walks(max(len(vertices), chains.most))
        while first < len(vertices):
            first = walk_to_camera(first, vertices, paths, chains, self.surface, context, camera, depth, counts, walks)
            splat_walks(walks, self.occluded(walks, counts), int(counts[0]), 1.0 / camera.light_paths, buffer)

    def occluded(self, walks: Walks, counts: Long) -> Bool:
        """(rays,) whether shadow rays of walks, counts (2,) of solutions and rays, are occluded."""
        rays = int(counts[1])
        ends = walks.origin[:rays], walks.direction[:rays], walks.distance[:rays]
        return self.world.rays.occluded(*ends) if rays else np.zeros(0, np.bool_)

    def photon_map(self, parts: list[Vertices], number: int, sampling: Sampling) -> PhotonMap:
        """The light vertices that only merging can use; the radius is a pixel's, less with each pass."""
        vertices = _concatenate((part[1] for part in parts), VERTEX)
        paths = _concatenate((part[2] for part in parts), PATH)
        distance = np.linalg.norm(vertices["p"] - self.view.T_world_camera[:3, 3], axis=1)
        pixel = float(np.median(distance)) / max(self.view.intrinsics[:2]) if len(vertices) else 1.0
        return photon_map(vertices, paths, pixel * (1.0 + number) ** -RADIUS_EXPONENT, sampling.light_paths)

    def context(self, seed: int) -> PassContext:
        rays = self.world.rays
        return PassContext(self.surface.rows, self.weights, seed, self.kinds, rays.centre, rays.surface_offset)

    def _camera(self, sampling: Sampling) -> CameraSampling:
        return CameraSampling(self.view, self.camera.height, sampling.camera_paths, sampling.light_paths, self.clear)

    def laser_sampling(self, fan: FanDistribution) -> LaserSampling:
        return LaserSampling(self.T_world_laser, invert(self.T_world_laser), self.laser.packed(), fan)


def begun_paths(count: int, interior: int) -> Records:
    """Paths that have met nothing yet, and begin within some bodies."""
    paths = np.zeros(count, PATH)
    paths["all_specular"], paths["medium"], paths["interior"] = True, -1, interior
    return paths


def _light_vertices(
    parts: list[Vertices], ordered: bool, sampling: Sampling, candidates: tuple[int, int], dimension: int
) -> LightVertices:
    """Light vertices of all chunks."""
    vertices = _concatenate((part[1] for part in parts), VERTEX)
    paths = _concatenate((part[2] for part in parts), PATH)
    return LightVertices(vertices, paths, ordered, sampling.light_paths, candidates, dimension)


def _concatenate(parts: Iterable[Records], kind: np.dtype) -> Records:
    """Records of one kind, one after the other: as bytes, since numpy copies records field by field, which is slow."""
    whole = np.dtype((np.void, kind.itemsize))
    return np.concatenate([np.zeros(0, whole), *(part.view(whole) for part in parts)]).view(kind)


def _stop(cancelled: Cancel | None) -> None:
    if cancelled is not None and cancelled():
        raise Cancelled
