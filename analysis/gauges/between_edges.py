"""What is measured between two edges, along what direction, and by how much the second one is higher.

The distance is along the two surfaces that end, or along the mean of their directions where they are not parallel. Of
edges that are not level along it, it is shorter than from the one to the other.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from analysis.gauges.edge import Edge
from analysis.gauges.fit import OUTLIER_SIGMAS
from render.base.arrays import Float

ALONG = (
    "measured along {}, at {:.2f}° in the profile; across it the second edge lies {:.4f} mm {} the first, so that "
    "from edge to edge straight it is farther"
)
SURFACES, MEAN = "the two surfaces", "the mean direction of the two surfaces, which are at {:.2f}° to each other"
LEAST_APART = 0.1
"""Degrees between surfaces, from which on it is told."""
EVEN = 1e-9
"""Of a distance, by which rounding alone moves edges that are level."""


def between_edges(edges: Sequence[Edge], theta: Sequence[Float]) -> float:
    """m, from edge to edge along the two surfaces that end there, or along the mean of their directions."""
    return abs(float(_apart(edges, theta)[0]))


def dimension(edges: Sequence[Edge]) -> Float:
    """(2, 2): the ends of what is measured, from the first edge along the surfaces."""
    theta = [one.theta for one in edges]
    first = edges[0].place
    return np.stack([first, first + _mean_direction(edges, theta) * _apart(edges, theta)[0]])


def extension(edges: Sequence[Edge]) -> Float:
    """(2, 2): from where the dimension ends to the second edge, across it; (0, 2) where both edges are level."""
    return np.stack([dimension(edges)[1], edges[1].place]) if _height(edges) else np.empty((0, 2))


def along_what(edges: Sequence[Edge]) -> str:
    """In words, along what a distance is, of edges that are not level with each other; empty: they are."""
    if not (height := _height(edges)):
        return ""
    theta = [one.theta for one in edges]
    first, second = (_angle(_direction(*pair)) for pair in zip(edges, theta, strict=True))
    surfaces = MEAN.format(abs(second - first)) if abs(second - first) > LEAST_APART else SURFACES
    side = "above" if height > 0.0 else "below"
    return ALONG.format(surfaces, _angle(_mean_direction(edges, theta)), abs(height) * 1e3, side)


def sampling_sigma(edges: Sequence[Edge]) -> float:
    """m, of the distance between edges that may be anywhere between their scan lines, if these are known."""
    return math.hypot(*(_sampling(one) for one in edges))


def _sampling(edge: Edge) -> float:
    return edge.pitch * math.hypot(1.0 / math.sqrt(12.0), edge.unevenness)


def _height(edges: Sequence[Edge]) -> float:
    """m, by which the second edge is higher, across what is measured; 0 where it is not known to be so."""
    theta = [one.theta for one in edges]
    distance, height = _apart(edges, theta)
    unsure = [EVEN * abs(distance)]
    for k, one in enumerate(edges):
        # of what turns the direction the far edge is moved the most
        for j, sigma in enumerate([*(one.ratio * one.sigma[:2]), math.hypot(one.sigma[2], _sampling(one))]):
            moved = [each.copy() for each in theta]
            moved[k][j] += sigma
            unsure.append(float(_apart(edges, moved)[1] - height))
    return float(height) if abs(height) > OUTLIER_SIGMAS * math.hypot(*unsure) else 0.0


def _apart(edges: Sequence[Edge], theta: Sequence[Float]) -> Float:
    """(2,) from the first edge to the second, along what is measured and across it, m."""
    first, second = (one.place_of(each) for one, each in zip(edges, theta, strict=True))
    along = _mean_direction(edges, theta)
    return np.array([along, [-along[1], along[0]]]) @ (second - first)


def _mean_direction(edges: Sequence[Edge], theta: Sequence[Float]) -> Float:
    mean = sum((_direction(*pair) for pair in zip(edges, theta, strict=True)), np.zeros(2))
    return np.asarray(mean / np.linalg.norm(mean))


def _direction(edge: Edge, theta: Float) -> Float:
    along = np.array([1.0, theta[1]]) @ edge.frame.axes
    return np.asarray(along / np.linalg.norm(along))


def _angle(direction: Float) -> float:
    """Degrees."""
    return math.degrees(math.atan2(direction[1], direction[0]))
