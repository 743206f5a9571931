"""How far measured points are from a nominal surface, after the one is laid onto the other; and what a tolerance says.

Points are (m, 3), a surface is (v, 3) vertices and (t, 3) triangles, all m and in one frame.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import scipy  # whose parts are loaded as they are named: the window starts without them
from numpy.typing import NDArray

from analysis.distance import nearest_triangle, signed_distance, triangle_normals
from analysis.gauges.gauge import Verdict
from analysis.measures import robust_sigma
from render.base.arrays import Float, Int
from render.base.errors import InputError
from render.base.pose import invert, rotation_matrix, transform_points

Alignment = Literal["none", "best-fit", "3-2-1"]
ROUNDS = 60
STILL = 1e-9
"""m: a step of the alignment that moves no point farther ends it."""
FAR = 6.0
"""Robust sigmas from the median beyond which a point is no part of the best fit."""
PLACE = 5
"""Points whose median is that of a place."""
UNSURE = 10.0
"""Times the median sigma of all, from which on a point tells no place."""
FAR_OFF = "far off: beyond 6 robust sigma of all"
"""What such a point is called."""
FREE = 0.1
"""Of the largest singular value: a freedom below it is held by one point in a hundred at most, as by those on a rim,
and stays as it is."""
LEVER = 1e-3
"""The same of six spots, each of which counts: how short the levers between them may be."""
HELD_BY = ("primary 1", "primary 2", "primary 3", "secondary 1", "secondary 2", "tertiary")
FEWEST = 6
COVERAGE = 2.0
"""Sigmas of a point's uncertainty."""
NEIGHBOURS = 5
"""Points, itself among them, of which most tell whether a point stands alone."""
APART, MOST_ASKED = 10.0, 20_000
"""Times how far these usually reach, beyond which each of them stands alone; and of how many points that is asked."""
SMALL = 0.25
JUMP, GRAZING = 3.0, 0.1
"""Of `unsure_of_place`."""


def far_off(value: Float) -> NDArray[np.bool_]:
    """(m,) values that are far off all others, as of points that are no part of the surface, or that are NaN.

    Not to be taken for false scan lines, which carry a point although no line crosses them, at whatever distance.
    """
    return ~np.asarray(np.abs(value - np.nanmedian(value)) <= FAR * robust_sigma(value))


def off_the_part(points: Float, value: Float, reach: float) -> NDArray[np.bool_]:
    """(m,) that are far off, and have no point within `reach` m that is not: stray ones, where those of a dent are not.

    Of a fine scan a dent is far off as well, but it begins where the others end.
    """
    apart = far_off(value)
    if apart.any() and not apart.all():
        distance, _ = scipy.spatial.cKDTree(points[~apart]).query(points[apart], distance_upper_bound=reach)
        apart[apart] = ~np.isfinite(distance)
    return apart


def tells_no_place(value: Float, sigma: Float, unsure: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(m,) whose deviation is no number to point at: far off and `unsure`, as of `unsure_of_place`, or much less sure
    than most points are.

    Of points that are not far off a number is the median: without the unsure ones among them, which are those that
    deviate least, it would be larger than it is.
    """
    with np.errstate(invalid="ignore"):
        vague = sigma > UNSURE * (np.nanmedian(sigma) if np.isfinite(sigma).any() else np.inf)
    return np.asarray((far_off(value) & unsure) | vague)


@dataclass(frozen=True)
class Aligned:
    """How the points were laid onto the surface."""

    motion: Float
    """(4, 4) rigid: carries the measured points to where they are compared."""
    used: int
    """Points that it follows from."""
    held: int
    """Freedoms, of 6, that the surface tells; the others stay as they were measured."""


@dataclass(frozen=True)
class Deviations:
    """Measured minus nominal along the normal, (m,) m: positive is on the camera's side, too much material."""

    points: Float
    """(m, 3) after alignment."""
    value: Float
    nearest: NDArray[np.int64]
    """Triangle."""
    aligned: Aligned


Verdicts = NDArray[np.int8]
BELOW, WITHIN, ABOVE, UNDECIDED = -1, 0, 1, 2


def deviations(
    points: Float, camera_centres: Float, vertices: Float, triangles: Int, aligned: Aligned | None = None
) -> Deviations:
    """Of (m, 3) finite points, each seen from its own centre (m, 3); aligned: None for points as they are."""
    aligned = Aligned(np.eye(4), 0, 0) if aligned is None else aligned
    moved = transform_points(aligned.motion, points)
    value, nearest = signed_distance(moved, vertices, triangles, transform_points(aligned.motion, camera_centres))
    return Deviations(moved, value, nearest, aligned)


def best_fit(points: Float, vertices: Float, triangles: Int) -> Aligned:
    """The motion that makes the sum of squared distances from the surface least.

    Gauss-Newton on the distances to the nearest tangent planes (Chen & Medioni, Image Vision Comput. 10, 1992), each
    round with the points within FAR robust sigmas. Freedoms that the surface does not tell, as a plane's own shift
    in itself, are left as they are. InputError: too few points.
    """
    if len(points) < FEWEST:
        raise InputError("so few points fit no surface", found=len(points), allowed=f"at least {FEWEST}")
    motion, used, held = np.eye(4), len(points), 0
    for _ in range(ROUNDS):
        moved = transform_points(motion, points)
        distance, normal = _to_planes(moved, vertices, triangles)
        middle = float(np.median(distance))
        spread = 1.4826 * float(np.median(np.abs(distance - middle)))
        here = np.abs(distance - middle) <= max(FAR * spread, STILL)
        used = int(np.count_nonzero(here))
        step, held, largest = _step(moved[here], normal[here], distance[here])
        motion = step @ motion
        if largest < STILL:
            return Aligned(motion, used, held)
    return Aligned(motion, used, held)


def three_two_one(
    points: Float, vertices: Float, triangles: Int, datums: Sequence[tuple[float, float, float]], radius: float
) -> Aligned:
    """The motion by which six spots of the part lie on the nominal surface: three, two and one of them.

    datums: six places on the nominal surface, m; of each, the mean distance of the points within `radius` m becomes
    zero along the normal that the surface has there. InputError: not six, a spot without points, or spots whose normals
    leave the part free to move.
    """
    if len(datums) != len(HELD_BY):
        raise InputError("3-2-1 needs six spots", found=len(datums), allowed="three, two and one")
    spots = np.asarray(datums, dtype=np.float64)
    facet = nearest_triangle(spots, vertices, triangles)
    normals = triangle_normals(vertices, triangles, facet)
    motion, used, tree = np.eye(4), 0, scipy.spatial.cKDTree(points)
    for _ in range(ROUNDS):
        means, middles, used = np.zeros(6), np.zeros((6, 3)), 0
        # the spots go to the points, whose tree stays as it is
        for k, around in enumerate(tree.query_ball_point(transform_points(invert(motion), spots), radius)):
            if not around:
                where = "{:.3f}, {:.3f}, {:.3f} mm".format(*(1e3 * spots[k]))
                cure = "choose a spot that the camera sees, or a larger radius"
                raise InputError(f"the spot {HELD_BY[k]} has no points", where=where, cure=cure)
            middles[k] = transform_points(motion, points[around].mean(axis=0))
            means[k] = normals[k] @ (middles[k] - spots[k])
            used += len(around)
        step, held, largest = _step(middles, normals, means)
        if held < 6:
            cure = "three on one face, two on a second, one on a third"
            found = f"{held} of 6 freedoms are held"
            raise InputError("the six spots leave the part free to move", found=found, cure=cure)
        motion = step @ motion
        if largest < STILL:
            return Aligned(motion, used, held)
    return Aligned(motion, used, 6)


def sigma_of_deviation(random: Float, systematic: Float) -> Float:
    """(m,) m, of a point's deviation: both parts along the normal; NaN where its chance is unknown.

    The one sigma of report and window, as two would give the same points two verdicts.
    """
    return np.asarray(np.hypot(random, np.nan_to_num(systematic)))


def verdicts(
    points: Float,
    value: Float,
    sigma: Float,
    lower: float,
    upper: float,
    unsure: NDArray[np.bool_] | None = None,
) -> Verdicts:
    """(m,) by ISO 14253-1: proved within, proved beyond, or undecided, as where sigma is NaN, of points (m, 3).

    U = 2 sigma for what is within, as the whole part is if all of it is. One place beyond is enough for it to be out,
    and of thousands of points some are beyond by two of their sigmas by chance: for what is beyond U is as large as
    lets chance find a single one of all of them as rarely as two sigmas do of one (Bonferroni), and of its NEIGHBOURS
    most have to be beyond by two sigmas as well, and as near as points of a surface are, as no stray point is a place
    of the part, nor are a few that stand apart. unsure: (m,) points that prove nothing beyond, as of `unsure_of_place`.
    """
    found = np.full(len(value), UNDECIDED, dtype=np.int8)
    found[(value - COVERAGE * sigma >= lower) & (value + COVERAGE * sigma <= upper)] = WITHIN
    uncertainty = coverage_of_all(len(value)) * sigma
    below, above = value + uncertainty < lower, value - uncertainty > upper
    if unsure is not None:
        below, above = below & ~unsure, above & ~unsure
    some = np.flatnonzero(below | above)
    if len(some):
        tree = scipy.spatial.cKDTree(points)
        reach, around = tree.query(points[some], k=min(NEIGHBOURS, len(points)))
        reach, around = reach.reshape(len(some), -1)[:, -1], around.reshape(len(some), -1)
        near = reach <= APART * _usual_reach(tree)
        # NaN, of a sigma that nobody knows, is beyond nothing
        for out, beyond, side in (
            (below, value + COVERAGE * sigma < lower, BELOW),
            (above, value - COVERAGE * sigma > upper, ABOVE),
        ):
            found[some[out[some] & near & (np.count_nonzero(beyond[around], axis=1) > around.shape[1] // 2)]] = side
    return found


def _usual_reach(tree: Any) -> float:
    """m, from a point to the farthest of its NEIGHBOURS, as half of all points have it, or of a sample of them."""
    every = tree.data[:: max(1, len(tree.data) // MOST_ASKED)]
    return float(np.median(tree.query(every, k=min(NEIGHBOURS, len(tree.data)))[0].reshape(len(every), -1)[:, -1]))


def unsure_of_place(
    points: Float, value: Float, scan_line: Int, sigma_normal: Float, sigma_depth: Float
) -> NDArray[np.bool_]:
    """(m,) points whose deviation may be that of another place of the part: they lie beside an edge, or a wall is next.

    The light of a scan line that an edge cuts is of both sides of it, and its point of neither: there the profile
    bends by more than JUMP times the point's own deviation, or ends. A line does not measure a wall along which its
    points err: of the wall's normal they have less than GRAZING of the sigma of their depth. scan_line: (m,), one more
    from each to the next of one profile, and apart between profiles; sigmas: random, (m,) m.
    """
    order = np.argsort(scan_line, kind="stable")
    bend = np.full(len(points), math.inf)
    if len(points) > 2:
        there = points[order]
        beside = np.diff(scan_line[order]) == 1
        inner = np.flatnonzero(beside[1:] & beside[:-1]) + 1
        bend[order[inner]] = np.linalg.norm(there[inner - 1] - 2.0 * there[inner] + there[inner + 1], axis=1)
    return np.asarray((bend > JUMP * np.abs(value)) | (sigma_normal < GRAZING * sigma_depth))


def coverage_of_all(count: int) -> float:
    """Sigmas that the largest of `count` normal errors exceeds as rarely as a single one exceeds two."""
    return float(-scipy.special.ndtri(scipy.special.ndtr(-COVERAGE) / max(count, 1)))


def verdict_of(judged: Verdicts) -> Verdict:
    """Of the whole part: it fails by one point that is proved beyond, and passes only if all are proved within."""
    if np.isin(judged, (BELOW, ABOVE)).any():
        return "fail"
    return "undecided" if (judged == UNDECIDED).any() else "pass"


def callouts(points: Float, value: Float, count: int, apart: float) -> list[tuple[int, float]]:
    """The places to point at: index of a point, and the median deviation around it, the largest first.

    apart: m; a median is over half of it, and places are no nearer than it. Fewer than PLACE points are none, as strays
    are, unless there are no more anywhere. What is smaller than SMALL of the largest is not worth pointing at.
    """
    if len(points) == 0:
        return []
    tree = scipy.spatial.cKDTree(points)
    chosen: list[tuple[int, float]] = []
    # cells in place of points: a median for each of a million points would take minutes
    cells = np.unique(np.floor(points / (apart / 4.0)).astype(np.int64), axis=0, return_index=True)[1]
    around = tree.query_ball_point(points[cells], apart / 2.0)
    local = np.array([float(np.median(value[each])) for each in around])
    left = np.array([len(each) >= PLACE for each in around])
    left |= not left.any()
    while left.any() and len(chosen) < count:
        best = int(np.argmax(np.where(left, np.abs(local), -1.0)))
        if chosen and abs(local[best]) < SMALL * abs(chosen[0][1]):
            break
        chosen.append((int(cells[best]), float(local[best])))
        left &= np.linalg.norm(points[cells] - points[cells[best]], axis=1) > apart
    return chosen


def turn_and_shift(motion: Float, points: Float) -> tuple[Float, float]:
    """What a motion does to the middle of points: its shift (3,) m, and the angle of its turn, rad."""
    middle = points.mean(axis=0)
    cosine = (float(np.trace(motion[:3, :3])) - 1.0) / 2.0
    return motion[:3, :3] @ middle + motion[:3, 3] - middle, math.acos(min(max(cosine, -1.0), 1.0))


def _to_planes(points: Float, vertices: Float, triangles: Int) -> tuple[Float, Float]:
    """(m,) distance along (m, 3) the direction in which it changes fastest: the facet's normal, or off its rim."""
    import trimesh

    facet = nearest_triangle(points, vertices, triangles)
    normal = triangle_normals(vertices, triangles, facet)
    away = points - trimesh.triangles.closest_point(vertices[triangles[facet]], points)
    along = np.einsum("ij,ij->i", away, normal)
    length = np.linalg.norm(away, axis=1)
    beside = length - np.abs(along) > 1e-9 * np.maximum(length, 1.0)
    normal[beside] = away[beside] / length[beside, None]
    return np.where(beside, length, along), normal


def _step(points: Float, normal: Float, distance: Float) -> tuple[Float, int, float]:
    """The small motion (4, 4) by which distances become least in squares, the freedoms it has, and its largest move."""
    middle = points.mean(axis=0)
    arm = points - middle
    size = max(float(np.sqrt((arm**2).sum(axis=1).mean())), 1e-12)
    jacobian = np.hstack([np.cross(arm, normal) / size, normal])
    twist, _, rank, _ = np.linalg.lstsq(jacobian, -distance, rcond=FREE if len(points) > len(HELD_BY) else LEVER)
    step = np.eye(4)
    step[:3, :3] = rotation_matrix(np.asarray(twist[:3] / size, dtype=np.float64))
    step[:3, 3] = middle + twist[3:] - step[:3, :3] @ middle
    return step, int(rank), float(np.linalg.norm(twist[:3]) + np.linalg.norm(twist[3:]))
