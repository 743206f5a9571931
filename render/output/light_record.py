"""Plan and quality of a frame as JSON holds them: fields by their names, NaN as null, an infinity as "Infinity"."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from pydantic import TypeAdapter

from render.base.counts import OF_GROUPS, Counts
from render.plan import GroupQuality, Plan

Record = dict[str, Any]
NAN = float("nan")
TARGET_NAMES = {
    "direct": ("laser_error", None, "samples"),
    "indirect": ("indirect_error", "light_paths", "light paths"),
    "ambient": ("ambient_error", "ambient_samples", "samples a pixel"),
}
"""Of each light group the settings that end it, by error and by work, and the unit of that."""
_PLAN, _QUALITY = TypeAdapter(Plan), TypeAdapter(tuple[GroupQuality, ...])


def plan_record(plan: Plan) -> Record:
    """Inverse of `plan_from`."""
    record: Record = _plain(_PLAN.dump_python(plan, mode="json"))
    return record


def plan_from(record: Any) -> Plan:
    """TypeError, ValueError: damaged."""
    return _PLAN.validate_python(record)


def quality_record(quality: Sequence[GroupQuality]) -> list[Record]:
    """Inverse of `quality_from`, with the reason, which follows from the rest."""
    records: list[Record] = _plain(_QUALITY.dump_python(tuple(quality), mode="json"))
    return [{**record, "reason": one.reason} for record, one in zip(records, quality, strict=True)]


def quality_from(records: Any) -> tuple[GroupQuality, ...]:
    """KeyError, TypeError, ValueError: damaged."""
    numbers = ("error", "target")
    return _QUALITY.validate_python(
        [{**one, **{name: NAN for name in numbers if one[name] is None}} for one in records]
    )


def quality_of_counts(counts: Counts, lasers: Sequence[str], targets: Mapping[str, Any]) -> tuple[GroupQuality, ...]:
    """What a frame of a version before the third says in its counts; targets: its render settings, as far as known.

    AttributeError, TypeError, ValueError: damaged.
    """
    found = []
    for group, quantities in OF_GROUPS.items():
        error_name, most_name, unit = TARGET_NAMES[group]
        for i, laser in enumerate((None,) if group == "ambient" else lasers):
            number = {
                name: counts.get(quantity if laser is None else quantity.of(i)) for name, quantity in quantities.items()
            }
            if number["work"] is None:
                continue
            end = {"target": targets.get(error_name, NAN), "most": targets.get(str(most_name), math.inf), "unit": unit}
            known = {name: value for name, value in number.items() if value is not None}
            found.append({"group": group, "laser": laser, "error": NAN, **end, **known})
    return _QUALITY.validate_python(found)


def _plain(value: Any) -> Any:
    """Numbers, lists and names as JSON can hold them."""
    if isinstance(value, dict):
        return {name: _plain(one) for name, one in value.items()}
    if isinstance(value, list):
        return [_plain(one) for one in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None if math.isnan(value) else "Infinity" if value > 0.0 else "-Infinity"
    return value
