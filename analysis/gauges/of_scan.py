"""Measures of the part that no single frame has: what is kept of each frame for them, and their value at the end."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from analysis.gauges.flatness import Cells, cells, flatness
from analysis.gauges.gauge import Gauge
from analysis.gauges.profile import Profile
from analysis.gauges.read import NAN, Reading
from render.base.arrays import Float


@dataclass(frozen=True)
class Patch:
    """What one frame has of a measure's region."""

    gauge: Gauge
    measured: Cells
    truth: Cells


def patch(gauge: Gauge, measured: Profile, truth: Profile, measured_pose: Float, true_pose: Float) -> Patch:
    """Of the profiles of the measure's laser; poses: (4, 4) of the laser on the part, T_part_laser, of each."""
    region = gauge.regions[0]
    return Patch(gauge, cells(measured, region, measured_pose), cells(truth, region, true_pose))


def read_scan(patches: Iterable[Patch]) -> tuple[Reading, ...]:
    """One reading for each measure, in the order in which they come first."""
    of: dict[Gauge, list[Patch]] = {}
    for one in patches:
        of.setdefault(one.gauge, []).append(one)
    return tuple(_read(gauge, own) for gauge, own in of.items())


def _read(gauge: Gauge, own: list[Patch]) -> Reading:
    found = flatness([one.measured for one in own])
    if isinstance(found, str):
        return Reading(gauge, None, reason=found)
    truth = flatness([one.truth for one in own], like=found)
    true_value = NAN if isinstance(truth, str) else truth.value
    return Reading(gauge, None, found.value, found.sigma_random, found.sigma_systematic, found.points, true_value)
