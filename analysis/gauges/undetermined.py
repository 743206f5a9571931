"""Values that hang on a bend or a crossing which the points do not tell apart from none."""

from __future__ import annotations

import math

import numpy as np

from analysis.gauges.edge import Edge
from analysis.gauges.fit import Fit
from analysis.gauges.gauge import REGIONS, Gauge

LEAST_SIGMAS = 3.0
"""By which a bend, or the angle between two lines, must differ from none."""
STRAIGHTEST = 1000.0
"""Lengths of its region, of a radius: beyond, the arc rises by less than an 8,000th of its length."""
CROSSINGS: dict[str, tuple[tuple[int, int], ...]] = {"width": ((0, 1), (0, 2)), "v_depth": ((1, 2),)}
"""Kind -> which of its lines are brought to where they cross."""

UPRIGHT = "; between upright walls, which have no points, take Edge to edge"


def undetermined(gauge: Gauge, fits: list[Fit]) -> str:
    """Why the curves give no value, or nothing."""
    if missing := [one.why for one in fits if isinstance(one, Edge) and one.why]:
        return "; ".join(missing)
    if gauge.kind == "radius":
        low, high = gauge.regions[0]
        radius, sigma = abs(float(fits[0].theta[2])), fits[0].ratio * float(fits[0].sigma[2])
        if radius > STRAIGHTEST * (high - low) or radius < LEAST_SIGMAS * sigma:
            return "the profile is straight there as far as its points can tell; take a longer arc"
    for first, second in CROSSINGS.get(gauge.kind, ()):
        names = " and ".join(repr(REGIONS[gauge.kind][one]) for one in (first, second))
        if _angle(fits[first], fits[second]) < LEAST_SIGMAS * _sigma_of_angle(fits[first], fits[second]):
            told = f"{names} are parallel as far as their points can tell, and cross nowhere in particular"
            return told + UPRIGHT if gauge.kind == "width" else told
    return ""


def _direction(one: Fit) -> float:
    along = np.array([1.0, one.theta[1]]) @ one.frame.axes
    return math.atan2(along[1], along[0])


def _angle(first: Fit, second: Fit) -> float:
    """Between two lines, at most a right one."""
    return abs(math.remainder(_direction(second) - _direction(first), math.pi))


def _sigma_of_angle(first: Fit, second: Fit) -> float:
    return math.hypot(*(one.ratio * float(one.sigma[1]) / (1.0 + float(one.theta[1]) ** 2) for one in (first, second)))
