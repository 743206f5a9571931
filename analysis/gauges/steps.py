"""In which steps of a scan a measure is measured: not where what was read is of stray light, or beside the part."""

from __future__ import annotations

from collections.abc import Sequence

from analysis.gauges.gauge import Gauge
from analysis.gauges.read import Reading, in_words

STRAY_STEP = "the exact line does not reach its regions: what is read there, {}, is of stray light or noise"
BESIDE = (
    "its {} on the plane that parts stand on there, and not, as in other steps, on a part: what is read there, {}, is "
    "of none"
)


def over_steps(found: Sequence[Reading]) -> list[Reading]:
    """The same readings, of any measures and steps, without the values of stray light and of what lies beside the part.

    A scan goes on over the table beyond its part, where every measure has a value that is none of the part's. Regions
    that lie on the table in all steps are meant to.
    """
    meant: dict[Gauge, set[str]] = {}
    for one in found:
        if not (one.reason or one.stray):
            meant[one.gauge] = meant.get(one.gauge, set(one.ground)) & set(one.ground)
    return [_settled(one, meant.get(one.gauge, set())) for one in found]


def _settled(one: Reading, meant: set[str]) -> Reading:
    """meant: regions of its measure that lie on the ground in all steps."""
    if one.reason:
        return one
    value = in_words(one.value, one.gauge.unit)
    beside = [repr(name) for name in one.ground if name not in meant]
    if one.stray:
        reason = STRAY_STEP.format(value)
    elif beside:
        regions = f"regions {' and '.join(beside)} lie" if len(beside) > 1 else f"region {beside[0]} lies"
        reason = BESIDE.format(regions, value)
    else:
        return one
    return Reading(one.gauge, one.step, truth=one.truth, reason=reason, section=one.section)
