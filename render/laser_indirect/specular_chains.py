"""Chains of plane mirrors and faces of clear glass from the camera or the laser to a place: which light is walked.

Rays of a grid over the image, or the sheet, are followed over mirrors and glass, by reflection and by refraction, until
they meet a rough surface; each tells over which chain of facets that place is seen, and the cells of space about it
list the chain. Light that only merging could bring (`render.laser_indirect.photon_merging`) is brought from a cell to
the camera over the chains that are listed there, by walks (`render.laser_indirect.manifold_walk`); camera paths that
come to a cell over a listed chain are not merged. Camera paths that come to a cell with chains from the laser know its
light there (`render.laser_indirect.laser_walks`). All know the lists, so each path is found once, whatever is listed;
what the grid has missed is found by light paths.
"""

from __future__ import annotations

import math
from itertools import zip_longest
from typing import NamedTuple

import numba
import numpy as np
from scipy.ndimage import binary_dilation

from render.base.arrays import Bool, Float, Int, Long
from render.base.borrowed import borrowed
from render.base.threads import map_chunks
from render.base.vectors import Vector, dot, store, vector
from render.camera.camera import Camera
from render.laser.irradiance import SHEET_SIGMAS
from render.laser.laser import LineLaser
from render.laser_indirect.manifold_walk import set_steps, turned
from render.laser_indirect.path_vertex import (
    MOST_FACETS,
    Records,
)
from render.material.bsdf import is_specular_row
from render.material.fresnel import fresnel_dielectric
from render.material.record import DIELECTRIC, INDEX, KIND
from render.run import Run
from render.world.triangles import Surface, off_surface, plane_of
from render.world.world import World

SEEN = np.dtype(
    [
        ("facets", "i4", MOST_FACETS),  # as of `path_vertex.PATH`
        ("count", "i4"),
        ("slopes", "f8", 2),  # of the ray: q and r (`manifold_walk`)
        ("o", "f8", 3),  # where it is, or where it has come to
        ("d", "f8", 3),
        ("steps", "f8", (2, 3)),  # as of `manifold_walk.set_steps`
        ("ray", "i4"),  # its number
        ("share", "f8"),  # of its light that reflections and refractions leave, roughly
    ],
    align=True,
)
GRID_RAYS = 1 << 14
"""Rays of the grid, about; of the camera's no less than a pixel apart. Chosen, not tuned."""
CELL_RAYS = 2.0
"""Size of a cell, in the spacing of the grid's rays at their median distance."""
NARROW, FINER, MOST_FINER_RAYS = 4, 8, 1 << 18
"""Chains from the laser that fewer rays come over are looked for again, by so many rays a side of each of theirs and of
the rays beside them, of so many in all at most: a facet is narrower than the grid. Chosen, not tuned."""
LEAST_SHARE = 1e-4
"""Of a ray's light, below which it is not followed; what it would have shown is merged. Chosen, not tuned."""
BITS = 21
"""Of a cell's number, for each axis."""
CELL_STEPS = np.array([1 << 2 * BITS, 1 << BITS, 1])
"""By which a cell's number grows along each axis."""
RAYS_A_CHUNK = 1 << 13
"""Rays that a thread follows at a time."""


class ChainIndex(NamedTuple):
    """(k,) cells, in order, that are seen over chains: seen[starts[i] : starts[i + 1]] of cell i."""

    cells: Long
    starts: Long
    seen: Records
    """(n,) SEEN, one of each chain of a cell."""
    centre: Float
    """(3,) m, of the cells' grid."""
    size: float
    """Of a cell, m."""
    most: int
    """Of a cell's chains."""


def seen_chains(
    world: World, surface: Surface, camera: Camera, T_world_camera: Float, run: Run = Run()
) -> ChainIndex | None:
    """The chains over which the camera sees rough surfaces; None: none is of plane mirrors and faces alone."""
    made_of = T_world_camera.tobytes(), camera, surface.rows.tobytes()
    return run.remembered(
        "chains before the camera",
        world,
        made_of,
        lambda: _seen_chains(world, surface, camera, T_world_camera, run.threads),
    )


def lit_chains(
    world: World, surface: Surface, laser: LineLaser, T_world_laser: Float, run: Run = Run()
) -> tuple[ChainIndex, ...]:
    """The chains over which the laser lights rough surfaces, wide ones and narrow ones, each in one list; (): there are
    none, or its sheet has a waist, so that its light does not come from one point."""
    made_of = T_world_laser.tobytes(), laser
    return run.remembered(
        f"chains before {laser.name}",
        world,
        made_of,
        lambda: _lit_chains(world, surface, laser, T_world_laser, run.threads),
    )


def _seen_chains(
    world: World, surface: Surface, camera: Camera, T_world_camera: Float, threads: int | None
) -> ChainIndex | None:
    """As `seen_chains`, found now."""
    spacing = max(1.0, math.sqrt(camera.width * camera.height / GRID_RAYS))
    v, u = np.mgrid[0 : camera.height - 1 : spacing, 0 : camera.width - 1 : spacing]
    directions, known = camera.rays(np.stack([u.ravel(), v.ravel()], axis=1))
    slopes = directions[known, :2] / directions[known, 2:]
    seen = _landed_rays(world, surface, slopes, T_world_camera, threads)
    return _listed(seen, world, surface, T_world_camera, spacing / max(camera.fx, camera.fy)) if len(seen) else None


def _lit_chains(
    world: World, surface: Surface, laser: LineLaser, T_world_laser: Float, threads: int | None
) -> tuple[ChainIndex, ...]:
    """As `lit_chains`, found now."""
    beam = laser.packed()
    if beam[1] != 0.0:
        return ()
    across, along = SHEET_SIGMAS * beam[3], beam[4]
    spacing = math.sqrt(4.0 * across * along / GRID_RAYS)
    x, y = (np.linspace(-end, end, max(3, math.ceil(2.0 * end / spacing))) for end in (across, along))
    slopes, apart = np.stack(np.meshgrid(x, y), axis=-1), np.array([x[1] - x[0], y[1] - y[0]])
    seen = _landed_rays(world, surface, slopes.reshape(-1, 2), T_world_laser, threads)
    (key,) = chain_keys(seen["facets"])
    narrow = np.bincount(key)[key] < NARROW
    about = np.zeros(slopes.shape[:2], np.bool_)
    about.ravel()[seen["ray"][narrow]] = True
    about = binary_dilation(about, np.ones((3, 3)))
    finer = min(FINER, int(math.sqrt(MOST_FINER_RAYS / max(int(about.sum()), 1))))
    lists = [(seen, float(apart.max()))]
    if about.any() and finer > 1:
        part = (np.arange(finer) + 0.5) / finer - 0.5
        parts = np.stack(np.meshgrid(part, part), axis=-1).reshape(-1, 2) * apart
        finer_slopes = (slopes[about][:, None] + parts).reshape(-1, 2)
        again = _landed_rays(world, surface, finer_slopes, T_world_laser, threads)
        found, wide = chain_keys(again["facets"], seen["facets"][~narrow])
        known = np.isin(found, wide)
        # a chain is in one list alone, or its light would be found twice
        lists = [
            (np.concatenate([seen[~narrow], again[known]]), float(apart.max())),
            (again[~known], float(apart.max()) / finer),
        ]
    return tuple(_listed(some, world, surface, T_world_laser, size) for some, size in lists if len(some))


def _landed_rays(world: World, surface: Surface, slopes: Float, T_world_origin: Float, threads: int | None) -> Records:
    """(k,) SEEN: where rays of slopes (n, 2) from the origin of a frame come to over chains."""
    plain = (surface.detail == 0) & (surface.second < 0)
    walkable = plain & np.array([is_specular_row(row) for row in surface.rows])
    if not np.any(walkable[: surface.object_id.max() + 1]):
        return np.empty(0, SEEN)
    found: list[list[Records]] = [[] for _ in range(-(-len(slopes) // RAYS_A_CHUNK))]

    def work(start: int, stop: int) -> None:
        ahead = np.zeros(stop - start, SEEN)
        directions = np.concatenate([slopes[start:stop], np.ones((stop - start, 1))], axis=1)
        directions /= np.linalg.norm(directions, axis=1)[:, None]
        ahead["slopes"], ahead["d"] = slopes[start:stop], directions @ T_world_origin[:3, :3].T
        ahead["o"], ahead["share"], ahead["ray"] = T_world_origin[:3, 3], 1.0, np.arange(start, stop)
        found[start // RAYS_A_CHUNK] = _landed(world, surface, walkable, ahead)

    map_chunks(work, len(slopes), RAYS_A_CHUNK, threads)
    # by how many facets they met: which of a chain's rays stands for it depends on no chunk
    met = [some for several in zip_longest(*found) for some in several if some is not None]
    return np.concatenate(met) if met else np.empty(0, SEEN)


def _landed(world: World, surface: Surface, walkable: Bool, ahead: Records) -> list[Records]:
    """SEEN rays (n,) -> those that came to a rough surface, over ever more facets."""
    rays, found = world.rays, list[Records]()
    for _ in range(MOST_FACETS + 1):
        triangle, _ = rays.intersect((ahead["o"] - rays.centre).astype(np.float32), ahead["d"].astype(np.float32))
        after, landed = np.empty(2 * len(ahead), SEEN), np.empty(len(ahead), SEEN)
        n, k = follow(surface, walkable, rays.surface_offset, triangle, ahead, after, landed)
        ahead = after[:n]
        found.append(landed[:k])
        if not n:
            break
    return found


def _listed(seen: Records, world: World, surface: Surface, T_world_origin: Float, spacing: float) -> ChainIndex:
    """The chains of SEEN rays (n,), `spacing` apart, by the cells of space that they come to."""
    distance = np.linalg.norm(seen["o"] - T_world_origin[:3, 3], axis=1)
    # the rays of a chain are so near each other that those of one do for all
    (key,) = chain_keys(seen["facets"])
    _, first = np.unique(key, return_index=True)
    chains = seen[first]
    set_steps(surface, chains, T_world_origin, vector(T_world_origin[:3, 3]))
    seen["steps"] = chains["steps"][key]
    return listed_by_cell(seen, world.rays.centre, CELL_RAYS * spacing * float(np.median(distance)))


def listed_by_cell(seen: Records, centre: Float, size: float) -> ChainIndex:
    """SEEN records (n,) by the cells within half a cell of where they have come to, one of each chain and cell."""
    (key,), low = chain_keys(seen["facets"]), np.floor((seen["o"] - centre) / size - 0.5).astype(np.int64)
    low = (low + (1 << (BITS - 1))) @ CELL_STEPS
    # those of a chain that have the same eight cells are one, before there are eight of each
    some = np.sort(_first_of_each(low, key))
    corners = np.array([[i & 1, i >> 1 & 1, i >> 2] for i in range(8)]) @ CELL_STEPS
    cells = (low[some][:, None] + corners).ravel()
    first = _first_of_each(cells, np.repeat(key[some], 8))
    cells, starts = np.unique(cells[first], return_index=True)
    starts = np.append(starts, len(first))
    return ChainIndex(cells, starts, seen.take(some[first // 8]), centre, size, int(np.diff(starts).max()))


def _first_of_each(cells: Long, key: Long) -> Long:
    """(k,) where each cell (n,) and key (n,) are first, in the order of cells and keys."""
    order = np.lexsort((key, cells))
    cells, key = cells[order], key[order]
    first = np.ones(len(cells), np.bool_)
    first[1:] = (cells[1:] != cells[:-1]) | (key[1:] != key[:-1])
    return np.asarray(order[first])


def chain_keys(*facets: Int) -> list[Long]:
    """(n, MOST_FACETS) facets -> (n,) a number for each list of them, the same for the same in all of the arrays."""
    rows = np.ascontiguousarray(np.concatenate(facets))
    _, key = np.unique(rows.view(np.dtype((np.void, rows.dtype.itemsize * rows.shape[1]))), return_inverse=True)
    return np.split(key.ravel(), np.cumsum([len(some) for some in facets])[:-1])


@numba.njit(nogil=True, cache=True, error_model="numpy")
def follow(
    surface: Surface, walkable: Bool, epsilon: float, triangle: Int, ahead: Records, after: Records, landed: Records
) -> tuple[int, int]:
    """SEEN rays (n,) beyond their triangles (-1: none) -> after, reflected and refracted, and landed; their numbers."""
    n = k = 0
    for i in range(ahead.shape[0]):
        t, ray = triangle[i], ahead[i]
        if t < 0:
            continue
        slot = surface.object_id[t]
        _, _, _, n0, n1, n2 = plane_of(surface, t)
        normal, d = (n0, n1, n2), vector(ray.d)
        if not is_specular_row(surface.rows[slot]):
            if ray.count > 0:
                _, o, _ = turned(surface, -1 - t, vector(ray.o), d)
                landed[k] = ray
                store(landed[k].o, o)
                k += 1
            continue
        if not walkable[slot] or ray.count == MOST_FACETS:
            continue
        c = -dot(normal, d)
        glass = surface.rows[slot, KIND] == DIELECTRIC
        index = surface.rows[slot, INDEX]
        reflected, _ = fresnel_dielectric(abs(c), index if c > 0.0 else 1.0 / index) if glass else (1.0, 0.0)
        for crosses in range(2 if glass else 1):
            share = ray.share * ((1.0 - reflected) if crosses else reflected)
            facet = 1 + t if crosses else -1 - t
            ok, o, out = turned(surface, facet, vector(ray.o), d)
            if not ok or share < LEAST_SHARE:
                continue
            after[n] = ray
            after[n].facets[ray.count] = facet
            after[n].count, after[n].share = ray.count + 1, share
            store(after[n].o, off_surface(o, normal, epsilon if dot(normal, out) > 0.0 else -epsilon))
            store(after[n].d, out)
            n += 1
    return n, k


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def cell_at(index: ChainIndex, p: Vector) -> int:
    """The number of the cell that a point is in; -1: nothing is listed there."""
    half = 1 << (BITS - 1)
    x = int(math.floor((p[0] - index.centre[0]) / index.size)) + half
    y = int(math.floor((p[1] - index.centre[1]) / index.size)) + half
    z = int(math.floor((p[2] - index.centre[2]) / index.size)) + half
    key = (np.int64(x) << 2 * BITS) | (np.int64(y) << BITS) | np.int64(z)
    i = int(np.searchsorted(index.cells, key))
    return i if i < index.cells.shape[0] and index.cells[i] == key else -1


@numba.njit(nogil=True, cache=True, error_model="numpy")
def mark_listed(vertices: Records, paths: Records, index: ChainIndex) -> None:
    """Paths (n,) that have come over a chain that is listed there: `walked` of PATH."""
    vertices, paths, index = borrowed(vertices), borrowed(paths), borrowed(index)
    for r in range(vertices.shape[0]):
        path = paths[r]
        i = cell_at(index, vector(vertices[r].p)) if path.count > 0 else -1
        if i < 0:
            continue
        for j in range(index.starts[i], index.starts[i + 1]):
            same = True
            for k in range(MOST_FACETS):
                same &= index.seen[j].facets[k] == path.facets[k]
            path.walked |= same
