"""What is doubtful about the points in a measure's regions: too many left out, regions swapped, points hardly known."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from analysis.gauges.fit import Fit
from analysis.gauges.gauge import LEFT_OUT, REGIONS, Gauge
from analysis.gauges.profile import Profile

MANY, MOST = 0.1, 1.0 / 3.0
"""Of a region's points, from which on it is told that its curve leaves so many out, and that it does not fit."""
FAR_OFF = f"{{}} of the {{}} points in the region {{!r}} are far off its curve and {LEFT_OUT}: is it over an edge?"
MOST_MISS = "{} of the {} points miss the curve in the region {!r} by far: it is of another shape, or over an edge"
SWAPPED = "the region {!r} lies on the right of {!r}: drag the two anew, or give their ends anew"
UNSURE = 5.0
"""Times the sigma of all points of the profile, from which on it is told that those of a region have it."""
LESS_SURE = (
    "the points in the region {!r} are {:.0f} times less sure than those of the whole profile: other light is beside "
    "their line, or it is faint or wide, and their sigma holds what that may cost"
)


def region_doubt(gauge: Gauge, profile: Profile, fits: Sequence[Fit]) -> str:
    """In words, the first of what is doubtful; empty: nothing."""
    return _swapped(gauge) or _left_out(gauge, profile, fits) or _less_sure(gauge, profile)


def _swapped(gauge: Gauge) -> str:
    """In words, that what is called left lies on the right; empty: it does not."""
    left, right = REGIONS[gauge.kind][-2:] if len(gauge.regions) > 1 else ("", "")
    swapped = left.startswith("left") and sum(gauge.regions[-2]) > sum(gauge.regions[-1])
    return SWAPPED.format(left, right) if swapped else ""


def _left_out(gauge: Gauge, profile: Profile, fits: Sequence[Fit]) -> str:
    """In words, of which region many points are not in the curve; empty: of none."""
    told, most = "", MANY
    for k, (name, region) in enumerate(zip(REGIONS[gauge.kind], gauge.regions, strict=True)):
        if (gauge.kind != "step" and k >= len(fits)) or gauge.kind == "edge_to_edge":
            continue  # of the second region of an area no curve is fitted, and an edge is to be reached over
        there = profile.weight(*region) > 0.0
        of_all, missing = np.count_nonzero(there), np.count_nonzero(there & ~fits[min(k, len(fits) - 1)].here)
        if missing > most * of_all:
            most = missing / of_all
            told = (FAR_OFF if most < MOST else MOST_MISS).format(missing, of_all, name)
    return told


def _less_sure(gauge: Gauge, profile: Profile) -> str:
    """In words, of which region the points are far less sure than is usual; empty: of none."""
    sigma = np.linalg.norm(profile.random, axis=1)
    usual, told, most = float(np.median(sigma)) if len(sigma) else 0.0, "", UNSURE
    for name, region in zip(REGIONS[gauge.kind], gauge.regions, strict=True):
        there = profile.weight(*region) > 0.0
        times = float(np.median(sigma[there])) / usual if usual > 0.0 and there.any() else 0.0
        if times > most:
            told, most = LESS_SURE.format(name, times), times
    return told
