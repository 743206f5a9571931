"""What would fix a read-out that is out of range: changes of the project that are tried, each with what it gains."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from analysis.report.total import NARROW_PX
from render.base.errors import InputError
from studio.preview.inspection import DIM_ELECTRONS, WIDE_PX
from studio.preview.preview import Look
from studio.preview.readout_rows import ANGLE, MEASURED, NOTHING, SATURATED, Row, micrometres, rows
from studio.preview.readouts import Range, Readouts, readouts
from studio.preview.remedy_changes import Change, automatic_exposure, changes
from studio.project.project import Project

TOLD_FROM = 0.02
"""Change of a value, as a share."""
PLAINLY = 0.75
"""Of how far a read-out is off what is good: no more than that is plainly better, also where it is not good yet."""
RANK = {"": 0, "warning": 1, "error": 2}


@dataclass(frozen=True)
class Remedy:
    """A change that brings a read-out nearer to its range.

    key: of the read-out's row; gain: what is better, that read-out first, before and after; price: what is worse, and
    all that is put out of range, empty for nothing; project: with the change.
    """

    key: str
    label: str
    gain: str
    price: str
    project: Project


def remedies(look: Look, laser: int, look_at: Callable[[Project], Look]) -> tuple[Remedy, ...]:
    """For each read-out that is out of range the first change that brings it nearer by a level.

    Where there is none, the first that makes it plainly better, as another may follow; else one that trades an error
    for a warning elsewhere. look_at: the same scene with another project; a change is tried by reading it out.
    """
    now = readouts(look, laser)
    found: list[Remedy] = []
    for row in rows(now):
        if not row.level:
            continue
        plain: Remedy | None = None
        traded: Remedy | None = None
        for change, then in _tried(row.key, look, laser, now, look_at):
            left, spoiled = _left(row.key, now, then), _spoiled(row.key, now, then)
            worst = max((RANK[one.level] for one in spoiled), default=0)
            if left <= PLAINLY and not spoiled:
                if left == 0.0:
                    plain = _told(row, change, now, then)
                    break
                plain = plain or _told(row, change, now, then)
            elif left == 0.0 and worst < RANK[row.level]:
                traded = traded or _told(row, change, now, then)
        if (best := plain or traded) is not None:
            found.append(best)
    return tuple(found)


def _told(row: Row, change: Change, now: Readouts, then: Readouts) -> Remedy:
    better, worse = _weighed(row.key, now, then)
    gain = ", ".join([f"{row.label.lower()} {_gained(row, _row(then, row.key))}", *better])
    for spoiled in _spoiled(row.key, now, then):
        name = spoiled.label.partition(",")[0].lower()
        if not any(one.startswith(f"{name} from ") for one in worse):
            worse.append(f"{name} {_gained(_row(now, spoiled.key), spoiled)}")
    return Remedy(row.key, change[0], gain, ", ".join(worse), change[1])


def _tried(
    key: str, look: Look, laser: int, now: Readouts, look_at: Callable[[Project], Look]
) -> Iterator[tuple[Change, Readouts]]:
    """Changes with what is read then: each as it is, and exposed anew where it saturates or is worse elsewhere."""
    for label, project in changes(key, look, laser, now, look_at):
        then = readouts(look_at(project), laser)
        yield (label, project), then
        saturates = then.saturated is not None and then.saturated > SATURATED
        exposed_already = project.sensor.exposure_time != look.project.sensor.exposure_time
        if exposed_already or not (saturates or _spoiled(key, now, then)):
            continue
        try:
            exposed = automatic_exposure(project, then)
        except InputError:
            continue
        if exposed is not None and exposed[0]:
            told, again = exposed
            yield (f"{label}, {told}", again), readouts(look_at(again), laser)


def _spoiled(key: str, now: Readouts, then: Readouts) -> list[Row]:
    """Other read-outs that were known and are worse by a level."""
    before = {row.key: row for row in rows(now)}
    return [
        row
        for row in rows(then)
        if row.key in before
        and row.key != key
        and before[row.key].value != NOTHING
        and RANK[row.level] > RANK[before[row.key].level]
    ]


def _row(r: Readouts, key: str) -> Row:
    return next(row for row in rows(r) if row.key == key)


def _left(key: str, now: Readouts, then: Readouts) -> float:
    """Share that is left of how far a read-out is off; 0: it is better by a level."""
    before, after = _row(now, key), _row(then, key)
    if after.value == NOTHING:
        return math.inf
    if RANK[after.level] < RANK[before.level]:
        return 0.0
    was, will = _off(key, now), _off(key, then)
    return math.inf if was is None or will is None else will / was


def _off(key: str, r: Readouts) -> float | None:
    """How far a read-out is off what is good: less is better; None: not known."""
    if key == "peak":
        light = r.laser_electrons or 0.0
        return max(MEASURED / r.detected, DIM_ELECTRONS / light) if r.detected and light else None
    if key == "angle":
        return _beyond(r.triangulation_angle, *ANGLE)
    if key == "width":
        return _beyond(r.width_px, NARROW_PX, WIDE_PX)
    return {"blur": r.blur_px and r.blur_px.high, "saturated": r.saturated, "occluded": r.occluded}.get(key)


def _beyond(values: Range | None, low: float, high: float) -> float | None:
    return None if values is None else max(low / values.middle, values.middle / high)


def _weighed(key: str, now: Readouts, then: Readouts) -> tuple[list[str], list[str]]:
    """What becomes better beside the read-out of a key, and what becomes worse: of all these less is better."""
    before, after = ({row.key: row for row in rows(one)} for one in (now, then))
    values = [
        (before[name].label.partition(",")[0].lower(), _gained(before[name], after[name]), was, will)
        for name, was, will in (
            ("saturated", now.saturated, then.saturated),
            ("occluded", now.occluded, then.occluded),
            ("blur", now.blur_px and now.blur_px.high, then.blur_px and then.blur_px.high),
            ("sigma", now.depth_sigma, then.depth_sigma),
        )
        if name != key and before[name].value != after[name].value and NOTHING not in _values(before, after, name)
    ]
    if not now.speckled and NOTHING not in _values(before, after, "sigma"):
        was, will = now.speckled_sigma or 0.0, then.speckled_sigma or 0.0
        values.append(("depth noise with speckle", f"from {micrometres(was)} to {micrometres(will)} µm", was, will))
    better = [f"{name} {told}" for name, told, was, will in values if (will or 0.0) < (1.0 - TOLD_FROM) * (was or 0.0)]
    worse = [f"{name} {told}" for name, told, was, will in values if (will or 0.0) > (1.0 + TOLD_FROM) * (was or 0.0)]
    return better, worse


def _values(before: dict[str, Row], after: dict[str, Row], name: str) -> tuple[str, str]:
    return before[name].value, after[name].value


def _gained(before: Row, after: Row) -> str:
    """From what to what, a unit that both have told once."""
    was, unit = before.value.partition(" ")[::2]
    told = f"from {was if unit == after.value.partition(' ')[2] else before.value} to {after.value}"
    return told if before.key != "saturated" else f"{told} of the scan lines"
