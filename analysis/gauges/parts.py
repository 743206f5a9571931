"""The points in a measure's regions: whether they are enough, whether the exact line is there as well, and on what."""

from __future__ import annotations

import numpy as np

from analysis.gauges.gauge import REGIONS, Gauge
from analysis.gauges.profile import Profile
from render.base.arrays import Float

SPARE = 2
"""Points that a curve needs beyond its parameters."""
PARAMETERS = {"radius": 3, "straightness": 3, "peak": 3, "gap": 3}
"""Of the curve in the last region; elsewhere, and in the others, lines."""


def parts_of(gauge: Gauge, profile: Profile) -> list[Float] | str:
    """The weights (m,) of the points in each region, or why they are too few."""
    parts = [profile.weight(*region) for region in gauge.regions]
    for name, part, region in zip(REGIONS[gauge.kind], parts, gauge.regions, strict=True):
        if (there := np.count_nonzero(part)) < _least(gauge):
            where = f"{region[0] * 1e3:.6g} to {region[1] * 1e3:.6g} mm"
            return f"too few points in the region {name!r} ({where}): {there}; at least {_least(gauge)} are needed"
    return parts


def is_stray(gauge: Gauge, measured: Profile, truth: Profile) -> bool:
    """The exact line does not reach a region, or so little of it that most scan lines there have a false point."""
    # what of an area's section is hidden is in its sigma
    for region in gauge.regions[:1] if gauge.kind == "area" else gauge.regions:
        seen, true = (np.unique(one.index[one.weight(*region) > 0.0]) for one in (measured, truth))
        if len(true) < _least(gauge) or 2 * len(true) < len(seen):
            return True
    return False


def on_ground(gauge: Gauge, truth: Profile) -> tuple[str, ...]:
    """The regions in which the exact line lies on nothing but what parts stand on, by their names."""
    if truth.ground is None:
        return ()
    inside = [truth.weight(*region) > 0.0 for region in gauge.regions]
    named = zip(REGIONS[gauge.kind], inside, strict=True)
    return tuple(name for name, here in named if here.any() and truth.ground[here].all())


def _least(gauge: Gauge) -> int:
    """Points of a region."""
    return PARAMETERS.get(gauge.kind, 2) + SPARE
