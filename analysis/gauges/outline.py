"""What a measure looks like in its profile: the curves that were fitted, and the dimension between them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from analysis.gauges.area import section, section_points, without_unsure
from analysis.gauges.between_edges import dimension, extension
from analysis.gauges.edge import Edge
from analysis.gauges.fit import Fit
from analysis.gauges.gauge import Gauge
from analysis.gauges.parts import parts_of
from analysis.gauges.profile import Profile
from analysis.gauges.read import crossing, curves_of, far_point, line_of
from analysis.gauges.undetermined import undetermined
from render.base.arrays import Float

ARC_POINTS = 65


def outline(gauge: Gauge, profile: Profile) -> tuple[list[Float], Float]:
    """Polylines (k, 2) along the fitted curves, each over its region, and the dimension's ends (2, 2).

    In the profile's coordinates, m. The dimension is of shape (0, 2) where the kind has none that is a length; where
    the measure has no value there is nothing at all.
    """
    if gauge.of_scan:
        return [], np.empty((0, 2))
    if gauge.kind == "area":
        profile = without_unsure(profile, gauge.regions[1])
    parts = parts_of(gauge, profile)
    if isinstance(parts, str):
        return [], np.empty((0, 2))
    fits, _ = curves_of(gauge, profile, parts)
    if undetermined(gauge, fits):
        return [], np.empty((0, 2))
    match gauge.kind:
        case "step":
            return _levels(fits[0], profile, parts)
        case "radius":
            return _arc(fits[0], profile)
        case "straightness":
            return _bow(fits[0], gauge.regions[0])
        case "peak":
            return _peak(fits, profile)
        case "gap":
            return _gap(fits, profile)
        case "area":
            return _area(fits[0], gauge.regions[1], profile)
    curves = [_polynomial(one, *_span(one, profile, one.here)) for one in fits]
    edges = [one for one in fits if isinstance(one, Edge)]
    if not edges:
        return curves, _between_lines(gauge, fits)
    beside = extension(edges)
    return [*curves, *([beside] if len(beside) else [])], dimension(edges)


def _span(one: Fit, profile: Profile, here: NDArray[np.bool_]) -> tuple[float, float]:
    """Along the fit's frame, from the first to the last of the points."""
    along = one.frame.local(profile.position[here])[:, 0]
    return float(along.min()), float(along.max())


def _polynomial(one: Fit, low: float, high: float) -> Float:
    theta = one.theta[:2] if isinstance(one, Edge) else one.theta
    along = np.linspace(low, high, 2 if len(theta) == 2 else ARC_POINTS)
    return one.frame.out(np.column_stack([along, np.polynomial.polynomial.polyval(along, theta)]))


def _levels(one: Fit, profile: Profile, parts: list[Float]) -> tuple[list[Float], Float]:
    constant, slope, height = one.theta
    spans = [_span(one, profile, part > 0.0) for part in parts]
    curves = []
    for up, span in zip((0.0, height), spans, strict=True):
        along = np.array(span)
        curves.append(one.frame.out(np.column_stack([along, constant + slope * along + up])))
    ordered = sorted(spans)
    foot = np.array([0.5 * (ordered[0][1] + ordered[1][0]), 0.0])
    foot[1] = constant + slope * foot[0]
    across = np.array([-slope, 1.0]) * height / (1.0 + slope**2)
    return curves, one.frame.out(np.stack([foot, foot + across]))


def _arc(one: Fit, profile: Profile) -> tuple[list[Float], Float]:
    centre, radius = one.theta[:2], abs(one.theta[2])
    beside = one.frame.local(profile.position[one.here]) - centre
    angle = np.arctan2(beside[:, 1], beside[:, 0])
    middle = np.arctan2(*beside.mean(axis=0)[::-1])
    beyond = np.remainder(angle - middle + np.pi, 2.0 * np.pi) - np.pi
    drawn = middle + np.linspace(beyond.min(), beyond.max(), ARC_POINTS)
    arc = centre + radius * np.column_stack([np.cos(drawn), np.sin(drawn)])
    return [one.frame.out(arc)], one.frame.out(np.stack([centre, arc[ARC_POINTS // 2]]))


def _bow(one: Fit, region: tuple[float, float]) -> tuple[list[Float], Float]:
    """The parabola and its chord from end to end of the region; the dimension in the middle."""
    low, high = ((x - one.frame.centre[0]) / max(one.frame.axes[0, 0], 1e-6) for x in region)
    curve = _polynomial(one, float(low), float(high))
    chord = curve[[0, -1]]
    return [curve, chord], np.stack([chord.mean(axis=0), curve[ARC_POINTS // 2]])


def _peak(fits: list[Fit], profile: Profile) -> tuple[list[Float], Float]:
    point, along = line_of(fits[0], fits[0].theta)
    curves = [_polynomial(one, *_span(one, profile, one.here)) for one in fits]
    height = (curves[1] - point) @ np.array([-along[1], along[0]])
    top = curves[1][int(np.argmax(height))]
    return curves, np.stack([point + along * float((top - point) @ along), top])


def _gap(fits: list[Fit], profile: Profile) -> tuple[list[Float], Float]:
    arcs = [_arc(one, profile)[0][0] for one in fits]
    centres = [one.frame.out(one.theta[:2]) for one in fits]
    across = (centres[1] - centres[0]) / np.linalg.norm(centres[1] - centres[0])
    ends = [
        centre + side * abs(one.theta[2]) * across for centre, one, side in zip(centres, fits, (1, -1), strict=True)
    ]
    return arcs, np.stack(ends)


def _area(reference: Fit, region: tuple[float, float], profile: Profile) -> tuple[list[Float], Float]:
    """The reference over its own region, the section's outline, and the reference below it; an area is no length."""
    order = section_points(profile, region, reference.frame)
    along, across = reference.frame.local(profile.position[order]).T
    ends = np.clip(section(region, reference.frame), along[0], along[-1])
    within = np.concatenate([ends[:1], along[(along > ends[0]) & (along < ends[1])], ends[1:]])
    outline = reference.frame.out(np.column_stack([within, np.interp(within, along, across)]))
    own = _polynomial(reference, *_span(reference, profile, reference.here))
    return [own, outline, _polynomial(reference, *ends)], np.empty((0, 2))


def _between_lines(gauge: Gauge, fits: list[Fit]) -> Float:
    """Where the value of two or three lines is measured."""
    lines = [line_of(one, one.theta) for one in fits]
    match gauge.kind:
        case "width":
            return np.stack([crossing(*lines[0], *other) for other in lines[1:]])
        case "v_depth":
            (point, along), flanks = lines[0], lines[1:]
            vertex = crossing(*flanks[0], *flanks[1])
            return np.stack([point + along * float((vertex - point) @ along), vertex])
        case "thickness" | "flush":
            (point, along), second = lines
            top = far_point(gauge, second)
            return np.stack([point + along * float((top - point) @ along), top])
        case "point_to_point":
            middles = [0.5 * (low + high) for low, high in gauge.regions]
            ends = zip(middles, lines, strict=True)
            return np.stack([point + along * ((x - point[0]) / along[0]) for x, (point, along) in ends])
    return np.empty((0, 2))
