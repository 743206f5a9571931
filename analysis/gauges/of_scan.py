"""Measures of the part that no single frame has: what is kept of each frame for them, and their value at the end."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from analysis.gauges.flatness import Cells, Form, cells, flatness
from analysis.gauges.gauge import Gauge
from analysis.gauges.parts import on_ground
from analysis.gauges.profile import Profile
from analysis.gauges.read import NAN, Reading
from analysis.gauges.region_doubts import MANY
from render.base.arrays import Float

BESIDE = "in {} of the steps its region lies on the plane that parts stand on: these are left out"
SOME_OFF = "{} of the {} points in its region of all steps are left out, up to {:.4g} mm off the surface"
MOST_OFF = (
    "points miss the surface: {} of the {} in its region of all steps are left out, and value and truth are of the "
    "others alone, as far as they reach"
)
OTHER_SURFACE = (
    "points miss the surface: its region holds another one, {:.4g} mm off it by the exact line; value and truth are of "
    "the largest, {} of {} points, as far as it reaches"
)


@dataclass(frozen=True)
class Patch:
    """What one frame has of a measure's region."""

    gauge: Gauge
    measured: Cells
    truth: Cells
    on_ground: bool = False
    """The exact line lies on nothing there but what parts stand on."""


def patch(gauge: Gauge, measured: Profile, truth: Profile, measured_pose: Float, true_pose: Float) -> Patch:
    """Of the profiles of the measure's laser; poses: (4, 4) of the laser on the part, T_part_laser, of each."""
    region = gauge.regions[0]
    both = cells(measured, region, measured_pose), cells(truth, region, true_pose)
    return Patch(gauge, *both, bool(on_ground(gauge, truth)))


def read_scan(patches: Iterable[Patch]) -> tuple[Reading, ...]:
    """One reading for each measure, in the order in which they come first."""
    of: dict[Gauge, list[Patch]] = {}
    for one in patches:
        of.setdefault(one.gauge, []).append(one)
    return tuple(_read(gauge, own) for gauge, own in of.items())


def _read(gauge: Gauge, every: list[Patch]) -> Reading:
    """Where most of the steps are beyond the part, the table would be the surface that most points are of."""
    seen = [one for one in every if len(one.truth.position)]
    beside = {id(one) for one in seen if one.on_ground}
    beside = beside if len(beside) < len(seen) else set()
    own = [one for one in every if id(one) not in beside]
    found = flatness([one.measured for one in own])
    if isinstance(found, str):
        return Reading(gauge, None, reason=found)
    truth = flatness([one.truth for one in own], like=found)
    true_value = NAN if isinstance(truth, str) else truth.value
    sigmas = found.sigma_random, found.sigma_systematic
    told = _left_out(found, None if isinstance(truth, str) else truth), BESIDE.format(len(beside)) if beside else ""
    remark = "; ".join(filter(None, told))
    return Reading(gauge, None, found.value, *sigmas, found.points, true_value, remark=remark)


def _left_out(found: Form, truth: Form | None) -> str:
    """In words, that some of the region is of another surface, or of none; empty: nothing is."""
    every = found.points + found.left_out
    if truth is not None and truth.farthest > 0.0:
        return OTHER_SURFACE.format(1e3 * truth.farthest, found.points, every)
    if found.left_out > MANY * every:
        return MOST_OFF.format(found.left_out, every)
    return SOME_OFF.format(found.left_out, every, 1e3 * found.farthest) if found.farthest > 0.0 else ""
