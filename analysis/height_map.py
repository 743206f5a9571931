"""A cloud as heights on a uniform grid, and what that makes of the points' sigma."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from analysis.cloud import Cloud
from analysis.steep import contradicted, steep_triangles
from render.base.arrays import Float
from render.base.errors import InputError

if TYPE_CHECKING:
    from scipy.spatial import Delaunay

MOST_POINTS = 5_000_000
MOST_CELLS = 50_000_000
BRIDGED = 3.0
"""Longest edge of a triangle that is surface, over the usual one: beyond it there was nothing to see."""
HOLE = 8.0
"""The same of two points of one profile, over what neighbours on it are apart."""
LEVELS = 65535
"""Of 16 bits, less 0, which says that there is no height."""
FINEST = 1e-9
"""m a level at least."""
NEAREST = 8
"""Points, one of whose triangles is continued to a cell at the border."""
FARTHEST = 3.0
"""Sum of the sizes of such a cell's three weights at most: 1 within a triangle, more as noise grows."""
GENTLE = 0.3
"""Rise over the distance from the next point that such a cell may have, beside what noise makes of it."""
THIN = 0.3
"""Of the usual height of a triangle: a thinner one, of points of one scan line, is no plane to continue."""
HEIGHT, WALL, UNMEASURED, LEFT_OUT = range(4)
CHUNK = 1 << 18
"""Cells at a time."""
Means = tuple[NDArray[np.intp], Float, NDArray[np.intp]]
"""(n,) cells as means of three points: (n, 3) points, (n, 3) weights, NaN where there is no surface; (n,) triangles."""


@dataclass(frozen=True)
class HeightMap:
    """Heights along z over x (columns) and y (rows, downward); m."""

    heights: Float
    """(rows, columns), NaN where there is no surface."""
    x: float
    y: float
    """Of the centre of the first cell."""
    pitch: float
    points: int
    sigma_points: float
    """Median random sigma of the points, NaN if they have none."""
    sigma_cells: float
    """Median random sigma of a cell, as that of its points."""
    correlation: float
    """Median correlation of a cell's random error with that of its right neighbour."""
    why: NDArray[np.uint8] | None = None
    """(rows, columns) HEIGHT, or why there is none: WALL, UNMEASURED or LEFT_OUT."""
    count: NDArray[np.intp] | None = None
    """(rows, columns) points within each cell."""
    points_left_out: int = 0
    """Those within cells whose heights were left out."""

    @property
    def steep(self) -> int:
        """Cells without a height as the surface there is a wall or a jump, or their points contradict each other."""
        return self._cells(WALL)

    @property
    def unmeasured(self) -> int:
        """Cells without a height as nothing was measured there: over holes, and outside of the scanned area."""
        return self._cells(UNMEASURED)

    @property
    def left_out(self) -> int:
        """Cells on the map whose height was left out."""
        return self._cells(LEFT_OUT)

    @property
    def points_without(self) -> int:
        """Points within cells without a height, and beyond the map."""
        return 0 if self.count is None else self.points - int(self.count[np.isfinite(self.heights)].sum())

    @property
    def points_steep(self) -> int:
        """Those of them that are within the steep cells."""
        return 0 if self.count is None or self.why is None else int(self.count[self.why == WALL].sum())

    def _cells(self, why: int) -> int:
        return 0 if self.why is None else int(np.count_nonzero(self.why == why))


def height_map(points: Cloud, pitch: float | None = None) -> HeightMap:
    """Heights by linear interpolation between a cloud's points, in Delaunay triangles, except at walls and jumps.

    At the border the next triangle is continued, by half a cell or half of what points are apart.

    pitch: m, None for as many cells as there are points. A height is a mean of three points, w^T z, so that its
    variance is w^T C w, C with the correlation of neighbouring scan lines; neighbours that share points err alike.
    InputError: too few points, all on one line, or too many cells.
    """
    from scipy.spatial import Delaunay, QhullError

    cloud = _usable(points)
    xy = np.column_stack([cloud["x"], cloud["y"]])
    origin = xy.min(axis=0)
    try:
        mesh = Delaunay(xy - origin)
    except QhullError:
        raise InputError("the points lie on one line, which has no area", cure="scan several steps") from None
    corners = mesh.points[mesh.simplices]
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    longest = edges.max(axis=1)
    is_surface = longest <= BRIDGED * float(np.median(longest))
    if {"step", "row"} <= points.keys():
        is_surface &= ~_over_holes(cloud, mesh, edges)
    first, second = (corners[:, i] - corners[:, 0] for i in (1, 2))
    area = 0.5 * float(np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0])[is_surface].sum())
    if pitch is None:
        pitch = float(f"{max(math.sqrt(area / len(xy)), 1e-9):.3g}")
    # a stray point far from the others is of no triangle that counts: the map ends where surface does
    left, bottom = corners[is_surface].min(axis=(0, 1))
    right, top = corners[is_surface].max(axis=(0, 1))
    columns, rows = (round(min(length / pitch, 1e9)) + 1 for length in (right - left, top - bottom))
    if columns * rows > MOST_CELLS:
        found, allowed = f"{columns} x {rows} cells of {pitch:g} m", f"at most {MOST_CELLS} cells"
        raise InputError("the height map would be too large", found=found, allowed=allowed, cure="give a larger pitch")
    heights, sigma, covariance = (np.full(rows * columns, np.nan) for _ in range(3))
    usual = _median(cloud["sigma_random"])
    steep = steep_triangles(corners, cloud["z"][mesh.simplices], mesh.simplices, is_surface, usual)
    # what touches a wall tells nothing of how the surface goes on
    beside_wall = np.isin(mesh.simplices, mesh.simplices[is_surface & steep]).any(axis=1)
    border = _Border(mesh, cloud["z"], is_surface & ~beside_wall, usual)
    grid = _Grid(cloud, pitch, columns, float(left), float(top), mesh, is_surface, border)
    own, lowest, highest = grid.own_points(rows)
    is_steep = np.zeros(rows * columns, dtype=np.bool_)
    for start in range(0, rows * columns, CHUNK):
        cells = np.arange(start, min(start + CHUNK, rows * columns))
        here, beside = grid.weights(cells), grid.weights(cells + 1)
        heights[cells] = grid.heights(here)
        sigma[cells] = np.sqrt(grid.covariance(here, here))
        known = (cells + 1) % columns != 0
        covariance[cells] = np.where(known, grid.covariance(here, beside), np.nan)
        wrong = contradicted(heights[cells], steep[here[2]], lowest[cells], highest[cells], pitch, usual)
        heights[cells[wrong]] = sigma[cells[wrong]] = np.nan
        is_steep[cells] = wrong
    why = np.where(is_steep, WALL, np.where(np.isnan(heights), UNMEASURED, HEIGHT)).astype(np.uint8)
    count = np.bincount(own[own >= 0], minlength=rows * columns)
    together = covariance[:-1] / (sigma[:-1] * sigma[1:])
    return HeightMap(
        heights.reshape(rows, columns),
        float(origin[0] + left),
        float(origin[1] + top),
        pitch,
        len(xy),
        usual,
        _median(sigma),
        _median(together),
        why.reshape(rows, columns),
        count.reshape(rows, columns),
    )


def _over_holes(cloud: Cloud, mesh: Delaunay, edges: Float) -> NDArray[np.bool_]:
    """(t,) the triangles that join points of one profile across many missing scan lines; edges: (t, 3) as rolled.

    Steps may be far apart, and the usual edge is as long: along a profile points are nearer, and a hole is seen there.
    """
    laser = cloud["laser"]
    order = np.lexsort((cloud["row"], cloud["step"], laser))
    profile = np.empty(len(order), dtype=np.intp)
    another = (np.diff(cloud["step"][order]) != 0) | (np.diff(laser[order]) != 0)
    profile[order] = np.append(0, np.cumsum(another))
    apart = np.linalg.norm(np.diff(mesh.points[order], axis=0), axis=1)[~another]
    if len(apart) == 0:
        return np.zeros(len(edges), dtype=np.bool_)
    of = profile[mesh.simplices]
    return np.asarray(np.any((of == np.roll(of, 1, axis=1)) & (edges > HOLE * np.median(apart)), axis=1))


def within(made: HeightMap, limits: tuple[float, float] | None) -> HeightMap:
    """The map without heights beyond limits, m, as large as the others need; None, or where none is beyond: as it is.

    InputError: none is within the limits.
    """
    known = np.isfinite(made.heights)
    kept = known if limits is None else known & (made.heights >= limits[0]) & (made.heights <= limits[1])
    if np.array_equal(kept, known):
        return made
    if not kept.any():
        raise InputError("the height map has no cell with a height", cure="keep all heights")
    rows, columns = (np.flatnonzero(kept.any(axis=axis)) for axis in (1, 0))
    shown = slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1)
    heights = np.where(kept, made.heights, np.nan)[shown]
    x, y = made.x + columns[0] * made.pitch, made.y - rows[0] * made.pitch
    cut = replace(made, heights=heights, x=float(x), y=float(y))
    if made.why is None or made.count is None:
        return cut
    gone = known & ~kept
    why = np.where(gone, np.uint8(LEFT_OUT), made.why)[shown]
    return replace(cut, why=why, count=made.count[shown], points_left_out=int(made.count[gone].sum()))


def encoded(heights: Float) -> tuple[NDArray[np.uint16], float, float]:
    """16-bit numbers, scale and offset: a height is offset + scale times its number, and 0 says that there is none.

    The scale has three digits; a few heights far from all others make it coarser (`within`). InputError: there is no
    height at all.
    """
    known = np.isfinite(heights)
    if not known.any():
        raise InputError("the height map has no cell with a height", cure="give a larger pitch")
    low, high = float(heights[known].min()), float(heights[known].max())
    least = max((high - low) / (LEVELS - 1), FINEST)
    unit = 10.0 ** (math.floor(math.log10(least)) - 2)
    scale = float(f"{math.ceil(least / unit * (1.0 - 1e-12)) * unit:.3g}")
    offset = low - scale
    numbers = np.zeros(heights.shape, dtype=np.uint16)
    numbers[known] = np.clip(np.round((heights[known] - offset) / scale), 1, LEVELS).astype(np.uint16)
    return numbers, scale, offset


def decoded(numbers: NDArray[np.uint16], scale: float, offset: float) -> Float:
    """The heights of `encoded` numbers, m, NaN where there is none."""
    return np.where(numbers > 0, offset + scale * numbers.astype(np.float64), np.nan)


def along(made: HeightMap, start: tuple[float, float], end: tuple[float, float]) -> tuple[Float, Float]:
    """The cells on a straight line between two places, (column, row): (n,) distances from its start and heights, m.

    About a cell's width apart, each as the map has it; NaN where there is no surface, and beyond the map.
    """
    length = math.hypot(end[0] - start[0], end[1] - start[1])
    share = np.linspace(0.0, 1.0, min(math.ceil(length), sum(made.heights.shape) * 2) + 1)
    column, row = (np.round(a + share * (b - a)) for a, b in zip(start, end, strict=True))
    rows, columns = made.heights.shape
    inside = (column >= 0) & (column < columns) & (row >= 0) & (row < rows)
    heights = np.full(len(share), np.nan)
    heights[inside] = made.heights[row[inside].astype(np.intp), column[inside].astype(np.intp)]
    return share * length * made.pitch, heights


class _Border:
    """Continues the surface where it ends."""

    def __init__(self, mesh: Delaunay, z: Float, is_flat: NDArray[np.bool_], sigma: float) -> None:
        """z: (m,) m; is_flat: (t,) triangles that are surface, and beside no wall; sigma: m, NaN for unknown."""
        from scipy.spatial import cKDTree

        self.mesh, self.z, self.noise = mesh, z, FARTHEST * float(np.nan_to_num(sigma))
        self.points = cKDTree(mesh.points)
        self.apart = float(np.median(self.points.query(mesh.points, k=2, p=np.inf)[0][:, 1]))
        """m, from a point to the next one, as usual."""
        (flat,) = np.nonzero(is_flat)
        corners = mesh.points[mesh.simplices[flat]]
        first, second = (corners[:, i] - corners[:, 0] for i in (1, 2))
        longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
        thickness = np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]) / longest
        thick = thickness > THIN * _median(thickness)
        slope = np.ptp(z[mesh.simplices[flat]], axis=1) / longest
        steepest_first = flat[thick][np.argsort(-slope[thick])]
        self.flattest = np.full(len(mesh.points), -1)
        """(m,) of the triangles at each point."""
        self.flattest[mesh.simplices[steepest_first].ravel()] = np.repeat(steepest_first, 3)

    def continued(self, place: Float, pitch: float) -> tuple[NDArray[np.intp], Float]:
        """(n,) triangles and (n, 3) weights of places in no triangle that counts, NaN where no point is near."""
        found, weight = np.full(len(place), -1), np.full((len(place), 3), np.nan)
        reach = 0.5 * max(pitch, self.apart) * (1.0 + 1e-9)
        (near,) = np.nonzero(np.isfinite(self.points.query(place, p=np.inf, distance_upper_bound=reach)[0]))
        away, beside = self.points.query(place[near], k=min(NEAREST, len(self.z)))
        # where the surface is steep nobody knows how it goes on
        least = GENTLE * away[:, 0] + self.noise
        for triangle in self.flattest[beside].T:
            tried = _weights(self.mesh, triangle, place[near])
            # of several continuations the one that makes up least
            rise = np.abs((tried * self.z[self.mesh.simplices[triangle]]).sum(axis=1) - self.z[beside[:, 0]])
            better = (triangle >= 0) & (np.abs(tried).sum(axis=1) < FARTHEST) & (rise < least)
            found[near[better]], weight[near[better]], least[better] = triangle[better], tried[better], rise[better]
        return found, weight


def _weights(mesh: Delaunay, triangles: NDArray[np.intp], place: Float) -> Float:
    """(n, 3) barycentric coordinates of places in a triangle each."""
    transform = mesh.transform[triangles]
    two = np.einsum("nij,nj->ni", transform[:, :2], place - transform[:, 2])
    return np.column_stack([two, 1.0 - two.sum(axis=1)])


@dataclass(frozen=True)
class _Grid:
    """Cells row by row over a triangulation."""

    cloud: Cloud
    pitch: float
    columns: int
    left: float
    """x of the first column, from the triangulation's origin."""
    top: float
    """y of the first row."""
    mesh: Delaunay
    is_surface: NDArray[np.bool_]
    """(t,) triangles that bridge no gap."""
    border: _Border

    def weights(self, cells: NDArray[np.intp]) -> Means:
        row, column = np.divmod(cells, self.columns)
        place = np.column_stack([self.left + column * self.pitch, self.top - row * self.pitch])
        # a hair of tolerance, so that the cells on the hull are of its triangles
        found = self.mesh.find_simplex(place, tol=1e-9)
        weight = _weights(self.mesh, found, place)
        (empty,) = np.nonzero((found < 0) | ~self.is_surface[found])
        found[empty], weight[empty] = self.border.continued(place[empty], self.pitch)
        return self.mesh.simplices[found], weight, found

    def own_points(self, rows: int) -> tuple[NDArray[np.intp], Float, Float]:
        """(m,) in which cell each point is, -1 for none; and the lowest and highest of each cell, infinite for none."""
        column = np.round((self.mesh.points[:, 0] - self.left) / self.pitch).astype(np.intp)
        row = np.round((self.top - self.mesh.points[:, 1]) / self.pitch).astype(np.intp)
        inside = (column >= 0) & (column < self.columns) & (row >= 0) & (row < rows)
        cell = np.where(inside, row * self.columns + column, -1)
        low, high = np.full(rows * self.columns, np.inf), np.full(rows * self.columns, -np.inf)
        np.minimum.at(low, cell[inside], self.cloud["z"][inside])
        np.maximum.at(high, cell[inside], self.cloud["z"][inside])
        return cell, low, high

    def heights(self, of: Means) -> Float:
        vertex, weight, _ = of
        return np.asarray((weight * self.cloud["z"][vertex]).sum(axis=1))

    def covariance(self, one: Means, other: Means) -> Float:
        """(n,) of the random errors of n pairs of cells."""
        total = np.zeros(len(one[0]))
        sigma = self.cloud["sigma_random"]
        for i in range(3):
            for j in range(3):
                a, b = one[0][:, i], other[0][:, j]
                total += one[1][:, i] * other[1][:, j] * sigma[a] * sigma[b] * self._correlation(a, b)
        return total

    def _correlation(self, a: NDArray[np.intp], b: NDArray[np.intp]) -> Float:
        """Of points: 1 with itself, r^k over k scan lines of one laser and step, L = (1 + r) / (1 - r)."""
        length = np.nan_to_num(self.cloud["correlation_length"], nan=1.0)
        r = np.clip((length - 1.0) / (length + 1.0), 0.0, 1.0)
        alike = (self.cloud["laser"][a] == self.cloud["laser"][b]) & (self.cloud["step"][a] == self.cloud["step"][b])
        apart = np.abs(self.cloud["row"][a] - self.cloud["row"][b])
        # of two peaks on one scan line each has its own noise
        shared = np.where(alike & (apart > 0), np.sqrt(r[a] * r[b]) ** np.maximum(apart, 1), 0.0)
        return np.where(a == b, 1.0, shared)


def _usable(points: Cloud) -> Cloud:
    """The points with coordinates, and all the columns that are needed. InputError: there are too few or too many."""
    missing = [name for name in "xyz" if name not in points]
    if missing:
        raise InputError("the points have no coordinates", found=f"no {', '.join(missing)}", allowed="x, y and z")
    here = np.isfinite(np.column_stack([points[name] for name in "xyz"])).all(axis=1)
    count = int(here.sum())
    if not 3 <= count <= MOST_POINTS:
        raise InputError("so many points make no height map", found=count, allowed=f"3 to {MOST_POINTS}")
    absent = {"sigma_random": np.nan, "correlation_length": 1.0, "laser": 0, "step": 0, "row": 0}
    defaults = {name: np.full(count, value) for name, value in absent.items()}
    return defaults | {name: column[here] for name, column in points.items()}


def _median(values: Float) -> float:
    finite = values[np.isfinite(values)]
    return float(np.median(finite)) if len(finite) else math.nan
