"""What a gauge reads off a profile: the value, its sigma by the delta method, and the truth by the same definition."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.gauges.area import area_above, section, unseen, without_unsure
from analysis.gauges.between_edges import along_what, between_edges, sampling_sigma
from analysis.gauges.edge import NOT_IN_TRUTH, Edge, edge_of
from analysis.gauges.fit import Fit, circle, circle_start, fit, polynomial, two_levels
from analysis.gauges.gauge import MOST_GAUGES, REGIONS, Gauge, Verdict
from analysis.gauges.oblique import (
    LEAST_OBLIQUE,
    lean_off_a_ball,
    moved_regions,
    oblique_remark,
    obliquity,
    running_along,
    square_profile,
)
from analysis.gauges.parts import is_stray, on_ground, parts_of
from analysis.gauges.profile import Profile
from analysis.gauges.region_doubts import region_doubt
from analysis.gauges.undetermined import undetermined
from render.base.arrays import Float

NAN = float("nan")
FLATTEST = 1e-6
"""Angle, rad, between two lines below which they do not cross anywhere near."""
MISFIT = 3.0
"""Times their sigmas by which points miss a curve, from which on the shape there is told to be another."""
OTHER_SHAPE = (
    "points miss the curve in its regions by {:.0f} times their sigma: the shape there is another, and value and truth "
    "hang on where the regions end"
)
MISFITS = {
    "peak": "points miss its parabola by {:.0f} times their sigma: value and truth may be off the top; of a flat one "
    "take a step height, else a narrower region",
    "edge_to_edge": "points miss the straight line of a surface that ends there by {:.0f} times their sigma: where it "
    "is no plane, take regions that reach less far from its edge",
}
STRAY = "the exact line does not reach its regions: the value is of stray light or noise"
NO_TRUTH = "; the exact line does not reach there either, so that the area has no truth"
AS_DRAGGED = (
    "its ends are the middles of its regions, where they were put: along the profile nothing is measured; of edges "
    "take Edge to edge"
)
ANYWHERE = 100.0
"""In SI units, of a value from which on its last digits tell nothing."""
STRAIGHTEST = 10.0
"""Lengths of its region, of the radius of an edge: beyond, the points are those of a flat side."""


@dataclass(frozen=True)
class Reading:
    """One measure in one frame; m, of an angle rad, of an area m^2. NaN where there is none."""

    gauge: Gauge
    step: int | None
    """None: of all steps."""
    value: float = NAN
    sigma_random: float = NAN
    """Of the line's position in the image, with its correlation along the line, and of edges between scan lines."""
    sigma_systematic: float = NAN
    """Of what all points share: calibration, and the sheet's own width where the truth tells it."""
    points: int = 0
    """Used."""
    truth: float = NAN
    """Of the exact line, by the same definition; from edge to edge, of the part's own surface."""
    reason: str = ""
    """Why there is no value."""
    remark: str = ""
    """What its sigma does not know of."""
    oblique: float = NAN
    """rad, by which its section is not square to the faces that it is of; NaN where that changes the value by less than
    its sigma, or is not known."""
    square: float = NAN
    """The value in a section square to them, of the same points; NaN where `oblique` is."""
    section: str = ""
    """Of which it was read, in words."""
    stray: bool = False
    """As of `is_stray`."""
    ground: tuple[str, ...] = ()
    """As of `on_ground`."""

    @property
    def sigma(self) -> float:
        return math.hypot(self.sigma_random, self.sigma_systematic)

    @property
    def error(self) -> float:
        """Value minus truth."""
        return self.value - self.truth

    @property
    def error_in_sigmas(self) -> float:
        return self.error / self.sigma if self.sigma > 0.0 else NAN

    @property
    def verdict(self) -> Verdict | None:
        """As of `Gauge.verdict`; None of stray light as well."""
        return None if self.stray else self.gauge.verdict(self.value, self.sigma, self.remark)


def read(gauge: Gauge, step: int, measured: Profile, truth: Profile | None) -> Reading:
    """The gauge's value in the profile of its laser at a step, and in the exact one."""
    if gauge.kind == "area":
        measured = without_unsure(measured, gauge.regions[1])
    found = _value(gauge, measured)
    if isinstance(found, str):
        return Reading(gauge, step, truth=_true_value(gauge, truth), reason=found, section=measured.section.name)
    value, gradient, fits = found
    random, systematic = measured.sigmas(gradient)
    used = np.count_nonzero(np.any([one.here for one in fits], axis=0))
    ratio = max(one.ratio for one in fits)
    true, remark = _true_value(gauge, truth), ""
    edges = [one for one in fits if isinstance(one, Edge)]
    random = math.hypot(ratio * random, sampling_sigma(edges) if edges else 0.0)
    if gauge.kind == "area":
        hidden = unseen(measured, gauge.regions[1], fits[0].frame)
        systematic, remark = math.hypot(systematic, hidden.sigma), hidden.remark
        remark += NO_TRUTH if remark and math.isnan(true) else ""
    elif edges:
        seen = "; ".join(one.remark for one in edges if one.remark)
        remark = _without_ends(gauge, truth) if truth is not None and math.isnan(true) else seen
    stray = truth is not None and is_stray(gauge, measured, truth)
    remark = STRAY if stray else remark
    if not remark and ratio > MISFIT:
        remark = MISFITS.get(gauge.kind, OTHER_SHAPE).format(ratio)
    remark = remark or region_doubt(gauge, measured, fits)
    as_dragged = gauge.kind == "point_to_point" and value < math.sqrt(2.0) * _between_middles(gauge)
    told = AS_DRAGGED if as_dragged else along_what(edges) if edges and not stray else ""
    remark = "; ".join(one for one in (remark, told) if one)
    one = Reading(gauge, step, value, random, systematic, int(used), true, "", remark, stray=stray)
    ground = () if truth is None else on_ground(gauge, truth)
    one = one if stray else _beside_square(one, measured)
    return replace(one, section=measured.section.name, ground=ground)


def _between_middles(gauge: Gauge) -> float:
    """m, across the fan, of the two regions."""
    (low, high), (other_low, other_high) = gauge.regions
    return 0.5 * abs(other_low + other_high - low - high)


def _beside_square(one: Reading, profile: Profile) -> Reading:
    """With what it would be square to its faces, where that is another value."""
    parts = parts_of(one.gauge, profile)
    along = None if isinstance(parts, str) else running_along(profile, np.max(parts, axis=0))
    if isinstance(parts, str):
        return one
    if along is None:
        return _beside_ball(one, profile, parts[0]) if one.gauge.kind == "radius" else one
    if obliquity(along) < LEAST_OBLIQUE:
        return one
    if (square := square_profile(profile, along)) is None:
        return _told(one, oblique_remark(profile, along, ""), obliquity(along))
    regions = moved_regions(one.gauge.regions, parts, profile, square)
    if regions is None:
        return one
    fits, function = _fitted(one.gauge.model_copy(update={"regions": regions}), square, parts)
    value = float(function([each.theta for each in fits]))
    change = math.remainder(value - one.value, math.tau) if one.gauge.unit == "rad" else value - one.value
    if not abs(change) > one.sigma:
        return one
    return _told(one, oblique_remark(profile, along, in_words(value, one.gauge.unit)), obliquity(along), value)


def _beside_ball(one: Reading, profile: Profile, used: Float) -> Reading:
    """A radius beside that of the ball whose middle the sheet does not meet."""
    found = lean_off_a_ball(profile, used)
    if found is None:
        return one
    lean, in_its_plane = found
    if not in_its_plane:
        return _told(one, "the points are of a ball, round in the laser's plane alone: choose that section", lean)
    radius = one.value / math.cos(lean)
    if not abs(radius - one.value) > one.sigma:
        return one
    aside = in_words(one.value * math.tan(lean), "m")
    own = f"the sheet passes the middle of the ball by {aside}, whose own radius is {in_words(radius, 'm')}"
    return _told(one, f"{own}; aim the laser at it", lean, radius)


def _told(one: Reading, told: str, oblique: float, square: float = NAN) -> Reading:
    return replace(one, remark=f"{told}; {one.remark}" if one.remark else told, oblique=oblique, square=square)


def in_words(value: float, unit: str) -> str:
    """With its unit: mm, mm² or degrees."""
    scale, name, places = {"m": (1e3, " mm", 4), "rad": (180.0 / math.pi, "°", 2), "m2": (1e6, " mm²", 3)}[unit]
    return f"{scale * value:.{places}f}{name}" if abs(value) < ANYWHERE else f"{scale * value:.3g}{name}"


def _true_value(gauge: Gauge, truth: Profile | None) -> float:
    found = "" if truth is None else _value(gauge, truth)
    if isinstance(found, str) or truth is None:
        return NAN
    value, _, fits = found
    # the exact line is seen no farther than the measured one: over what is hidden it tells no area either
    hidden = gauge.kind == "area" and unseen(truth, gauge.regions[1], fits[0].frame).length > 0.0
    return NAN if hidden else value


def _without_ends(gauge: Gauge, truth: Profile) -> str:
    """In words, why the exact line has no such edges, or where they are is not known."""
    parts = parts_of(gauge, truth)
    fits = [] if isinstance(parts, str) else curves_of(gauge, truth, parts)[0]
    unknown = [one.remark for one in fits if isinstance(one, Edge) and one.remark and not one.why]
    return "; ".join(unknown) if unknown else NOT_IN_TRUTH


def _value(gauge: Gauge, profile: Profile) -> tuple[float, Float, list[Fit]] | str:
    """Value, its derivative by the points' positions (m, 2), and the curves that it is of; or why there is none."""
    if isinstance(parts := parts_of(gauge, profile), str):
        return parts
    fits, function = curves_of(gauge, profile, parts)
    if reason := undetermined(gauge, fits):
        return reason
    theta = [one.theta for one in fits]
    value = function(theta)
    if not math.isfinite(value):
        return NOTHING.get(gauge.kind, "the lines in its regions do not cross")
    gradient = np.zeros((len(profile.index), 2))
    for k, one in enumerate(fits):
        for j, sigma in enumerate(np.maximum(one.sigma, 1e-15)):
            # over one sigma of the parameter, so that the derivative is that of where the parameter may be
            ends = []
            for side in (sigma, -sigma):
                moved = theta[k].copy()
                moved[j] += side
                ends.append(function([*theta[:k], moved, *theta[k + 1 :]]))
            change = math.remainder(ends[0] - ends[1], math.tau) if gauge.kind == "angle" else ends[0] - ends[1]
            gradient += change / (2.0 * sigma) * one.gradient[j]
    if not np.all(np.isfinite(gradient)):
        return NOTHING.get(gauge.kind, "the lines in its regions do not cross")
    return value, gradient, fits


NOTHING = {
    "peak": "the profile has no peak within its region; of a flat top take a step height",
    "radius": "no circle fits the points",
    "gap": "its regions hold no round edges; drag over where each edge turns down; between upright walls take Edge "
    "to edge, between slanted ones a width",
    "area": "its points end before the section does",
    "step": "no two levels fit the points",
}
"""Kind -> why a value is none; the others are of lines that cross."""
Function = Callable[[Sequence[Float]], float]


def curves_of(gauge: Gauge, profile: Profile, parts: list[Float]) -> tuple[list[Fit], Function]:
    """The curves that a value is of, and the value of their parameters; fitted once to each profile."""
    key = gauge.kind, gauge.regions
    if key not in profile.fitted:
        if len(profile.fitted) >= MOST_GAUGES:  # an edge that is dragged leaves one behind at every place
            profile.fitted.clear()
        profile.fitted[key] = _fitted(gauge, profile, parts)
    found: tuple[list[Fit], Function] = profile.fitted[key]
    return found


def _fitted(gauge: Gauge, profile: Profile, parts: list[Float]) -> tuple[list[Fit], Function]:
    match gauge.kind:
        case "step":
            whole = np.maximum(*parts)
            fits = [fit(profile, whole, lambda here: two_levels(parts[1][here] > 0.0), lambda local: _zeros(3))]
            return fits, lambda theta: theta[0][2] / math.sqrt(1.0 + theta[0][1] ** 2)
        case "radius":
            return [fit(profile, parts[0], lambda here: circle, circle_start)], lambda theta: abs(theta[0][2])
        case "straightness":
            bow = _polynomial(profile, parts[0], 2)
            low, high = gauge.regions[0]
            length = (high - low) / max(bow.frame.axes[0, 0], 1e-6)
            return [bow], lambda theta: -theta[0][2] * (length / 2.0) ** 2
        case "peak":
            line = _polynomial(profile, parts[0], 1)
            fits = [line, _polynomial(profile, parts[1], 2, line.frame.axes)]
            return fits, lambda theta: _height_of_peak(fits, theta, gauge.regions[1])
        case "gap":
            edges = [fit(profile, part, lambda here: circle, circle_start) for part in parts]
            widest = [STRAIGHTEST * (high - low) for low, high in gauge.regions]
            return edges, lambda theta: _between_circles(edges, theta, widest)
        case "area":
            line = _polynomial(profile, parts[0], 1)
            above = area_above(profile, gauge.regions[1], line.frame)
            low, high = section(gauge.regions[1], line.frame)
            below = np.array([high - low, 0.5 * (high**2 - low**2)])  # of a line, by its constant and its slope
            return [line, above], lambda theta: float(theta[1][0] - below @ theta[0])
        case "edge_to_edge":
            asked = zip(parts, gauge.regions, REGIONS[gauge.kind], strict=True)
            ends = [edge_of(profile, *one) for one in asked]
            return list(ends), lambda theta: between_edges(ends, theta)
        case _:
            fits = [_polynomial(profile, part, 1) for part in parts]
            return fits, lambda theta: _of_lines(gauge, [line_of(*pair) for pair in zip(fits, theta, strict=True)])


def _polynomial(profile: Profile, part: Float, degree: int, axes: Float | None = None) -> Fit:
    return fit(profile, part, lambda here: polynomial(degree), lambda local: _zeros(degree + 1), axes)


def _zeros(count: int) -> Float:
    return np.zeros(count)


def line_of(one: Fit, theta: Float) -> tuple[Float, Float]:
    """A point of the line and its direction, to the right or up."""
    along = np.array([1.0, theta[1]]) @ one.frame.axes
    return one.frame.out(np.array([0.0, theta[0]])), along / np.linalg.norm(along)


def _of_lines(gauge: Gauge, lines: list[tuple[Float, Float]]) -> float:
    """The value of two or three lines."""
    (p, u), (q, v) = lines[:2]
    if gauge.kind == "angle":
        return math.atan2(_cross(u, v), float(u @ v))
    if gauge.kind == "opening":
        return math.pi - abs(math.atan2(_cross(u, v), float(u @ v)))
    if gauge.kind == "point_to_point":
        middles = [0.5 * (low + high) for low, high in gauge.regions]
        ends = [point + along * _over(x - point[0], along[0]) for x, (point, along) in zip(middles, lines, strict=True)]
        return float(np.linalg.norm(ends[1] - ends[0]))
    if gauge.kind in ("thickness", "flush"):
        return _cross(u, far_point(gauge, lines[1]) - p)
    r, w = lines[2]
    if gauge.kind == "width":
        return float(np.linalg.norm(crossing(p, u, r, w) - crossing(p, u, q, v)))
    return -_cross(u, crossing(q, v, r, w) - p)


def _between_circles(fits: list[Fit], theta: Sequence[Float], widest: list[float]) -> float:
    """NaN: an edge has a larger radius than the widest, m."""
    if any(abs(values[2]) > radius for values, radius in zip(theta, widest, strict=True)):
        return NAN
    first, second = (one.frame.out(values[:2]) for one, values in zip(fits, theta, strict=True))
    return float(np.linalg.norm(second - first) - abs(theta[0][2]) - abs(theta[1][2]))


def far_point(gauge: Gauge, line: tuple[Float, Float]) -> Float:
    """Of the second line: its middle for a thickness, for a flush its end beside the first region."""
    (first_low, first_high), (low, high) = gauge.regions
    q, v = line
    beside = low if first_low + first_high <= low + high else high
    x = 0.5 * (low + high) if gauge.kind == "thickness" else beside
    return q + v * _over(x - q[0], v[0])


def _height_of_peak(fits: list[Fit], theta: Sequence[Float], region: tuple[float, float]) -> float:
    """Where the parabola runs along the reference line, over that line; NaN: not within the region."""
    point, along = line_of(fits[0], theta[0])
    frame, (a, b, q) = fits[1].frame, theta[1]
    right, up = frame.axes @ along
    t = _over(_over(up, right) - b, 2.0 * q)
    top = frame.out(np.array([t, a + b * t + q * t**2]))
    return _cross(along, top - point) if region[0] <= top[0] <= region[1] else NAN


def crossing(p: Float, u: Float, q: Float, v: Float) -> Float:
    """Where the lines through p along u and through q along v cross; NaN: they are parallel."""
    sine = _cross(u, v)
    return p + u * (_cross(q - p, v) / sine if abs(sine) > FLATTEST else NAN)


def _cross(a: Float, b: Float) -> float:
    return float(a[0] * b[1] - a[1] * b[0])


def _over(a: float, b: float) -> float:
    return float(a / b) if b != 0.0 else NAN
