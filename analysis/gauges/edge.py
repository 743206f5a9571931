"""Where a surface ends along the profile, as at the rim of a hole with upright walls, which have no points themselves.

The edge lies between the last scan line whose middle meets the surface and the next, whatever is seen there, and one
place between them is as likely as another: it is taken midway, and is uniform over the distance of neighbouring points.

A pixel sees a strip as high as this distance, so that a scan line beyond the edge may have a weaker line of the
surface: the last strip that is at least half as strong as the others has its middle on it. Where another surface in the
strip is the stronger one, that is seen in place of it, up to a share of the strip that puts the edge farther out.

Stray points beyond a part jump the farthest, and would be taken for what ends: where no surface is found at the largest
jump, it is looked for without the points that make none.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.gauges.fit import OUTLIER_SIGMAS, Fit, Frame, fit, polynomial
from analysis.gauges.profile import Profile
from analysis.gauges.true_end import surface_end
from analysis.measures import robust_sigma
from render.base.arrays import Float

JUMP = 5.0
"""Times the usual distance between neighbouring points, beyond which they are on either side of a jump."""
JUMP_SIGMAS = 6.0
"""The same in sigmas of a point, which tell jumps from noise where points are close."""
LONGEST_ALONE = 2
"""Points in a row that are false ones, if a jump leads to them and another back."""
FEWEST = 4
"""Points of a surface: two for its line, and two to spare."""
Places = NDArray[np.intp]
HALF = 0.5
"""Of the usual strength: of a strip whose middle lies on the edge."""
BESIDE = 8
"""Points of a surface beside its edge, whose strength is the usual one."""
NO_JUMP = (
    "no edge in the region {!r}: its points go on without a jump; drag it over where the surface ends, or, of slanted "
    "walls, take a width"
)
TWO_EDGES = "two edges in the region {!r}: the surface goes on behind a hole in its points; drag it over one of them"
BELOW_AN_EDGE = "no edge in the region {!r}: the surface that ends there is higher and beside it; widen it over that"
FEW_POINTS = "too few points on the surface that ends in the region {!r}: {}; at least {} are needed"
STRAY_IN_IT = (
    "{}; {} stray points in it, off every surface, are a likely cause: drag it over more of the surface, fewer of them"
)
PASSED_OVER = "{} of the {} points in the region {!r} are stray ones, off every surface, and are passed over"
MANY = 0.1
"""Of a region's points, from which on it is told that so many are passed over."""
POINTS_END = (
    "all points end at the edge in the region {!r}: where it is the image or the laser's fan that ends, and not the "
    "part, this is no edge"
)
NOT_IN_TRUTH = "the exact line has no such edges: the points end there, and not the part"
"""Where the exact line has none at all; of those that it has, the remark says why their ends are not known."""


@dataclass(frozen=True)
class Edge(Fit):
    """The line of a surface that ends; its parameters: constant, slope, and the end's place along the frame."""

    pitch: float
    """m, between neighbouring points along the surface."""
    unevenness: float = 0.0
    """Sigma of a strip's strength over it, to which the share of it that is the surface's is known."""
    why: str = ""
    """In words, why there is no edge, in which case the end is NaN; empty: there is one."""
    remark: str = ""
    """In words, that it may be none, or why the true end is not known, in which case the end is NaN."""

    @property
    def place(self) -> Float:
        """(2,) of the edge, in the profile's coordinates, m."""
        return self.place_of(self.theta)

    def place_of(self, theta: Float) -> Float:
        """(2,) with other parameters (3,)."""
        constant, slope, end = theta
        return self.frame.out(np.array([end, constant + slope * end]))


def edge_of(profile: Profile, part: Float, region: tuple[float, float], name: str) -> Edge:
    """The edge at the largest jump between neighbouring points with weights (m,) in a region of that name, from and to
    m across the fan, or to the next point beside it.

    Of the two surfaces there the higher one ends, that is the one nearer to the laser.
    """
    found = _at_the_jump(profile, part, region, name)
    stray = _stray(profile, part) if found.why else np.zeros(len(part), dtype=np.bool_)
    passed = np.flatnonzero(stray & (part > 0.0))
    if not stray.any():
        return found
    without = _at_the_jump(profile, np.where(stray, 0.0, part), region, name, stray)
    if not without.why and any(_goes_on(without, profile, int(one)) for one in passed):
        return _nothing(profile, TWO_EDGES.format(name))
    if without.why:
        return _nothing(profile, STRAY_IN_IT.format(found.why, len(passed))) if len(passed) else found
    there = np.count_nonzero(part)
    told = PASSED_OVER.format(len(passed), there, name) if len(passed) > MANY * there else ""
    return replace(without, remark="; ".join(one for one in (without.remark, told) if one))


def _at_the_jump(
    profile: Profile, part: Float, region: tuple[float, float], name: str, stray: NDArray[np.bool_] | None = None
) -> Edge:
    """The edge, as if the stray points (m,) were not there."""
    order = _with_neighbours(profile, part, stray)
    if len(order) < FEWEST:
        return _nothing(profile, FEW_POINTS.format(name, np.count_nonzero(part), FEWEST))
    jump, distance = _jumps(profile, order)
    inside = part[order] > 0.0
    here = jump & (inside[1:] | inside[:-1])
    if not here.any():
        return _where_points_end(profile, part, region, name, order)
    k = int(np.argmax(np.where(here, distance, 0.0)))
    higher = profile.position[order[k + 1], 1] > profile.position[order[k], 1]
    second = inside[k + 1] and (higher or not inside[k])
    edge, beyond = (k + 1, order[k]) if second else (k, order[k + 1])
    other = order[k::-1] if second else order[k + 1 :]
    found = _ending(profile, part, name, *_from_the_edge(order, jump, edge, second), other)
    if not found.why and (why := _not_the_end(found, profile, part, int(beyond), name)):
        return _nothing(profile, why)
    return found


def _stray(profile: Profile, part: Float) -> NDArray[np.bool_]:
    """(m,) the points in runs without a jump, of the whole profile, that are too short for a surface."""
    order = _one_a_line(profile, part)
    inside = order[part[order] > 0.0]
    distance = np.linalg.norm(np.diff(profile.position[order], axis=0), axis=1)
    # among many stray points of a region the usual distance is theirs
    jump = distance > min(_usual(profile, order), _usual(profile, inside))
    run = np.append(0, np.cumsum(jump))
    stray = np.zeros(len(part), dtype=np.bool_)
    stray[order] = np.bincount(run)[run] < FEWEST
    return stray


def _goes_on(edge: Edge, profile: Profile, point: int) -> bool:
    """Whether a point beyond the edge lies on the surface that ends there."""
    along, across = edge.frame.local(profile.position[point])
    middle = float(np.median(edge.frame.local(profile.position[edge.here])[:, 0]))
    beyond = (along - edge.theta[2]) * (edge.theta[2] - middle) > 0.0
    return bool(beyond and abs(across - edge.theta[0] - edge.theta[1] * along) <= _on_it(edge, profile, along))


def _one_a_line(profile: Profile, part: Float) -> Places:
    """The points in the order of their scan lines; of several on one the highest, of those in the region if any is."""
    order = np.lexsort((profile.position[:, 1], part > 0.0, profile.index))
    row = profile.index[order]
    return np.asarray(order[np.append(row[1:] != row[:-1], True)])


def _with_neighbours(profile: Profile, part: Float, stray: NDArray[np.bool_] | None) -> Places:
    """The points of a region and the next one on either side, in the order of their scan lines, without false ones."""
    order = _one_a_line(profile, part)
    order = order if stray is None else order[~stray[order]]
    inside = np.flatnonzero(part[order] > 0.0)
    if not len(inside):
        return order[:0]
    order = order[max(inside[0] - 1, 0) : inside[-1] + 2]
    for length in range(1, LONGEST_ALONE + 1):
        order = order[~_alone(profile, order, length)]
    inside = np.flatnonzero(part[order] > 0.0)
    before, region, after = (
        np.split(order, [inside[0], inside[-1] + 1]) if len(inside) else (order[:0], order, order[:0])
    )
    region = _without_false_end(profile, _without_false_end(profile, region)[::-1])[::-1]
    return np.concatenate([before, region, after])


def _without_false_end(profile: Profile, order: Places) -> Places:
    """The points less the first few, if a jump leads down from these to the others: of a surface there are more."""
    jump, _ = _jumps(profile, order)
    after = np.flatnonzero(jump[:LONGEST_ALONE]) + 1
    height = profile.position[order, 1]
    return order[after[0] :] if len(after) and height[after[0] - 1] > height[after[0]] else order


def _alone(profile: Profile, order: Places, length: int) -> NDArray[np.bool_]:
    """(n,) the points in runs of some length that a jump leads to and another from, between points without one."""
    jump, _ = _jumps(profile, order)
    alone = np.zeros(len(order), dtype=np.bool_)
    if len(order) < length + FEWEST:
        return alone
    near = _usual(profile, order, length + 1)
    for first in np.flatnonzero(jump[:-length] & jump[length:]) + 1:
        across = profile.position[order[first + length]] - profile.position[order[first - 1]]
        alone[first : first + length] |= float(np.linalg.norm(across)) <= near
    return alone


def _jumps(profile: Profile, order: Places) -> tuple[NDArray[np.bool_], Float]:
    """(n - 1,) whether there is a jump from one point to the next, and their distance, m."""
    distance = np.linalg.norm(np.diff(profile.position[order], axis=0), axis=1)
    return distance > _usual(profile, order), distance


def _usual(profile: Profile, order: Places, steps: int = 1) -> float:
    """m, that so many steps from point to point may go without a jump."""
    if len(order) < 2:
        return math.inf
    usual = float(np.median(np.linalg.norm(np.diff(profile.position[order], axis=0), axis=1)))
    return max((JUMP + steps - 1.0) * usual, JUMP_SIGMAS * _sigma(profile, order))


def _sigma(profile: Profile, order: Places) -> float:
    return float(np.median(np.linalg.norm(profile.random[order], axis=1)))


def _from_the_edge(order: Places, jump: NDArray[np.bool_], edge: int, second: bool) -> tuple[Places, NDArray[np.bool_]]:
    """The points from an edge onwards into the surface that ends there, and whether a jump follows each."""
    if second:
        return order[edge:], jump[edge:]
    return order[edge::-1], jump[:edge][::-1]


def _ending(profile: Profile, part: Float, name: str, order: Places, jump: NDArray[np.bool_], other: Places) -> Edge:
    """The end of the surface whose points, and the jumps after them, begin at the edge, as do those of the other."""
    # points of a wall that is seen have jumps on either side
    first = int(np.argmin(jump)) if not jump.all() else len(jump)
    after = np.flatnonzero(jump[first:])
    surface = order[first : first + int(after[0]) + 1] if len(after) else order[first:]
    surface = surface[part[surface] > 0.0]
    if len(surface) < FEWEST:
        return _nothing(profile, FEW_POINTS.format(name, len(surface), FEWEST))
    weight = np.zeros(len(part))
    weight[surface] = part[surface]
    line = fit(profile, weight, lambda here: polynomial(1), lambda local: np.zeros(2))
    along, across = line.frame.local(profile.position[surface]).T
    inwards = float(np.median(np.diff(along)))
    reach = _reach(line, profile, surface, abs(inwards))
    on = np.abs(across - line.theta[0] - line.theta[1] * along) <= reach
    last = int(np.argmax(on & _strong(profile, surface)))
    share = _share(profile, surface[last:], other)
    gradient = np.zeros((3, *line.gradient.shape[1:]))
    gradient[:2] = line.gradient
    gradient[2, surface[last]] = line.frame.axes[0]
    sigma = abs(float(profile.random[surface[last]] @ line.frame.axes[0]))
    theta = np.append(line.theta, along[last] - share * inwards)
    uneven = _unevenness(profile, surface[last:])
    sigmas = np.append(line.sigma, sigma)
    found = Edge(theta, sigmas, gradient, line.here, line.frame, line.ratio, abs(inwards), uneven)
    if profile.true_section is None:
        return found
    return _truly(found, profile, surface[last:], math.copysign(1.0, -inwards), reach, name)


def _truly(edge: Edge, profile: Profile, surface: Places, outwards: float, reach: float, name: str) -> Edge:
    """With the end of the part's own surface; outwards: 1.0 or -1.0, along the edge's frame."""
    assert profile.true_section is not None
    constant, slope = edge.theta[:2]
    last = edge.frame.local(profile.position[surface[0]])[0]
    foot = edge.frame.out(np.array([last, constant + slope * last]))
    along = outwards * np.array([1.0, slope]) @ edge.frame.axes / math.hypot(1.0, slope)
    end = surface_end(profile.true_section, profile.position[surface], foot, along, reach, edge.pitch)
    theta = edge.theta.copy()
    theta[2] = math.nan if isinstance(end, str) else edge.frame.local(end)[0]
    return replace(edge, theta=theta, remark=end.format(name) if isinstance(end, str) else "")


def _strong(profile: Profile, surface: Places) -> NDArray[np.bool_]:
    """(n,) the points of a surface from its edge that are as strong as where the middle of a strip lies on it."""
    if profile.strength is None:
        return np.ones(len(surface), dtype=np.bool_)
    return ~(profile.strength[surface] < HALF * _strength(profile, surface))


def _share(profile: Profile, surface: Places, other: Places) -> float:
    """Of the distance between points, from the last on a surface to the edge, in the middle of where it may be.

    Of two surfaces in one strip the stronger line is the point's, weighed by how much of the strip is its own.
    """
    if profile.strength is None or not len(other) or abs(profile.index[other[0]] - profile.index[surface[0]]) > JUMP:
        return HALF
    own, others = (_strength(profile, one) for one in (surface, other))
    return max(HALF, others / (own + others)) if own + others > 0.0 else HALF


def _unevenness(profile: Profile, surface: Places) -> float:
    if profile.strength is None:
        return 0.0
    ratio = profile.strength[surface] / _strength(profile, surface)
    return min(robust_sigma(ratio), HALF) if np.isfinite(ratio).all() else 0.0


def _strength(profile: Profile, order: Places) -> float:
    assert profile.strength is not None
    return float(np.median(profile.strength[order[:BESIDE]]))


def _reach(line: Fit, profile: Profile, surface: Places, pitch: float) -> float:
    """m, from the line of a surface, within which points are on it: rounded rims fall off by more where they end."""
    return max(pitch, OUTLIER_SIGMAS * line.ratio * _sigma(profile, surface))


def _on_it(edge: Edge, profile: Profile, along: float) -> float:
    """m, from the line of a surface, within which a point beyond its edge, so far along the frame, may be on it."""
    unsure = float(edge.sigma[0] + edge.sigma[1] * abs(along))
    return _reach(edge, profile, np.flatnonzero(edge.here), edge.pitch) + OUTLIER_SIGMAS * edge.ratio * unsure


def _not_the_end(edge: Edge, profile: Profile, part: Float, beyond: int, name: str) -> str:
    """Why the surface does not end at an edge, judged by the point beyond it; empty: it does.

    Scan lines without points before a higher surface are an opening, and without them a wall stands on this one.
    """
    along, across = edge.frame.local(profile.position[beyond])
    reach = _on_it(edge, profile, along)
    above = float(across - edge.theta[0] - edge.theta[1] * along)
    if part[beyond] > 0.0:
        return TWO_EDGES.format(name) if abs(above) <= reach else ""
    hole = np.abs(profile.index[edge.here] - profile.index[beyond]).min() > JUMP
    return BELOW_AN_EDGE.format(name) if above > reach and not hole else ""


def _where_points_end(profile: Profile, part: Float, region: tuple[float, float], name: str, order: Places) -> Edge:
    """The edge where no points follow on the region's, those of no other surface either."""
    jump, _ = _jumps(profile, order)
    first, last = profile.position[order[[0, -1]], 0]
    limits = region if last > first else region[::-1]
    room = np.abs(np.array(limits) - [first, last]) > _usual(profile, order)
    room &= part[order[[0, -1]]] > 0.0
    if np.count_nonzero(room) != 1:
        return _nothing(profile, (TWO_EDGES if room.any() else NO_JUMP).format(name))
    edge = 0 if room[0] else len(order) - 1
    found = _ending(profile, part, name, *_from_the_edge(order, jump, edge, bool(room[0])), order[:0])
    return replace(found, remark=found.remark or POINTS_END.format(name))


def _nothing(profile: Profile, why: str) -> Edge:
    count = len(profile.index)
    nowhere = Frame(np.zeros(2), np.eye(2))
    gradient, here = np.zeros((3, count, 2)), np.zeros(count, dtype=np.bool_)
    return Edge(np.full(3, np.nan), np.zeros(3), gradient, here, nowhere, 1.0, math.nan, why=why)
