"""The project's measures: read off every frame, told in a few numbers each, and written as a table."""

from __future__ import annotations

import csv
import io
import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from analysis.cloud import T_first_step
from analysis.gauges.gauge import Gauge
from analysis.gauges.of_scan import Patch, patch
from analysis.gauges.profile import Profile, measured_profile, true_profile
from analysis.gauges.read import Reading, read
from analysis.gauges.steps import over_steps
from analysis.gauges.true_end import true_section
from render.base.errors import InputError
from render.base.files import atomic_write, read_bytes
from render.base.pose import invert
from render.frame import Frame
from studio.project.found_motion import measured_pose
from studio.project.project import ProfileSection, Project
from studio.scan.ground import ground
from studio.scan.own_files import MEASURE_COLUMNS
from studio.scan.sheet_lean import T_section_camera, section_of
from studio.scan.stages import Measurement

OF_SCAN = "it is of a whole scan: run one (F6, Motion)"
SINCE_SCAN = "the scan was measured without it: Measure > Measure the scan again reads it off the scan's frames"
WITHOUT_SCAN = (OF_SCAN, SINCE_SCAN)
"""Reasons of what is of all steps, as long as these have not been measured with it."""
MOST_BYTES = 256 << 20
"""Of a table of measures."""
FIGURES = ("value", "sigma_random", "sigma_systematic", "sigma", "truth", "error", "error_in_sigmas")


def profiles(project: Project, frame: Frame, found: Measurement, section: ProfileSection) -> tuple[Profile, Profile]:
    """Measured and exact profile of a laser, in a section."""
    T = T_section_camera(project.scene, found.laser, frame.step, section)
    strength = found.line.amplitude[found.points.index, found.points.rank]
    name = section_of(project.scene, found.laser, frame.step, section)
    measured = measured_profile(found.points, found.errors, T, name, strength)
    T_camera_world, curve = invert(project.scene.T_world_camera(frame.step)), frame.curves[found.laser]
    T_laser_world = invert(project.scene.T_camera_laser(found.laser)) @ T_camera_world
    part = true_section(curve, T @ T_camera_world, T_laser_world, project.scene.lasers[found.laser].tan_half_fan)
    return measured, true_profile(curve, T, measured, part, ground(project.scene))


def readings(project: Project, frame: Frame, found: Sequence[Measurement]) -> tuple[Reading, ...]:
    """Of the measures that are of this frame's step; found: of each laser."""
    there = [gauge for gauge in project.measures if not gauge.of_scan and gauge.laser < len(found)]
    wanted = [gauge for gauge in there if gauge.step in (None, frame.step)]
    lasers, section = {gauge.laser for gauge in wanted}, project.measured_in
    both = {laser: profiles(project, frame, found[laser], section) for laser in lasers}
    return tuple(read(gauge, frame.step, *both[gauge.laser]) for gauge in wanted)


def patches(project: Project, frame: Frame, found: Sequence[Measurement]) -> tuple[Patch, ...]:
    """Of the measures that are of all steps, what this frame has of them."""
    scene, kept = project.scene, []
    for gauge in project.measures:
        if gauge.of_scan and gauge.laser < len(found):
            there = T_first_step(scene, frame.step), scene.T_camera_laser(gauge.laser)
            poses = measured_pose(scene, project.calibration.motion, frame.step), scene.T_world_camera(frame.step)
            both = profiles(project, frame, found[gauge.laser], "laser_plane")  # brought onto the part by poses
            kept.append(patch(gauge, *both, *(there[0] @ pose @ there[1] for pose in poses)))
    return tuple(kept)


def read_each(gauges: Sequence[Gauge], step: int, of: Mapping[int, tuple[Profile, Profile]]) -> tuple[Reading, ...]:
    """One for each measure, those of another step or laser without a value; of: `profiles` by laser."""
    found = []
    for gauge in gauges:
        if gauge.of_scan:
            found.append(Reading(gauge, None, reason=OF_SCAN))
        elif gauge.step not in (None, step):
            found.append(Reading(gauge, step, reason=f"it is of step {gauge.step} alone"))
        elif gauge.laser not in of:
            found.append(Reading(gauge, step, reason=f"laser {gauge.laser} was not rendered"))
        else:
            found.append(read(gauge, step, *of[gauge.laser]))
    return tuple(over_steps(found))


def kept_readings(gauges: Sequence[Gauge], scanned: Sequence[Gauge], rows: object) -> dict[Gauge, Reading]:
    """Of the gauges that are of all steps, as a scan has recorded those that it was measured with.

    scanned: these; rows: `measures_record` of them, as read from a file that may be damaged. Others have no value yet.
    """
    found = {}
    entries = [row if isinstance(row, dict) else {} for row in rows] if isinstance(rows, list) else []
    for gauge in (one for one in gauges if one.of_scan):
        found[gauge] = Reading(gauge, None, reason=SINCE_SCAN)
        for was, row in zip(scanned, entries, strict=False):
            if (was.kind, was.laser, was.regions) == (gauge.kind, gauge.laser, gauge.regions):
                names = ("value", "sigma_random", "sigma_systematic", "truth")
                value, random, systematic, truth = (_number(row.get(name)) for name in names)
                points = int(np.nan_to_num(_number(row.get("points"))))
                reason, remark = (str(row.get(name) or "") for name in ("reason", "remark"))
                found[gauge] = Reading(gauge, None, value, random, systematic, points, truth, reason, remark)
    return found


def _number(value: object) -> float:
    return float(value) if isinstance(value, int | float) else math.nan


def worst(found: Sequence[Reading]) -> Reading:
    """Of one measure over the steps, one with a value where there is one: by verdict, then the least within its limits.

    Without limits the farthest off its nominal, and without that off the truth; where the exact line does not reach,
    off what the steps have in the middle.
    """
    values = [one.value for one in found if math.isfinite(one.value)]
    middle = float(np.median(values)) if values else math.nan

    def badness(one: Reading) -> tuple[bool, bool, bool, float]:
        gauge = one.gauge
        low, high = gauge.limits
        if gauge.nominal is None:
            off = abs(one.error if math.isfinite(one.error) else one.value - middle)
        elif low == -math.inf and high == math.inf:
            off = abs(one.value - gauge.nominal)
        else:
            off = max(low - one.value, one.value - high)
        known = off if math.isfinite(off) and not one.reason else -math.inf
        return not one.reason, one.verdict == "fail", one.verdict == "undecided", known

    return max(found, key=badness)


def measures_record(gauges: Sequence[Gauge], found: Sequence[Reading]) -> list[dict[str, Any]]:
    """One entry for each measure: its worst reading with a value, and how many came to which verdict; SI units.

    The verdict is that of all readings: one that was not measured, as of `over_steps`, leaves it undecided, where none
    fails. Of several with a value `over_steps` holds what they come to.
    """
    rows = []
    for gauge in gauges:
        own = over_steps([one for one in found if one.gauge == gauge])
        shown = worst(own) if own else Reading(gauge, gauge.step, reason="no frame of its step was measured")
        missing = [one for one in own if one.reason]
        row = _row(shown) | {"readings": len(own), "verdicts": verdict_counts(gauge, own)}
        if missing and row["verdict"] == "pass":
            row["verdict"] = "undecided"
        reason, step = (missing[0].reason, missing[0].step) if missing else ("", None)
        rows.append({**row, "first_reason": reason, "first_missing": step, "over_steps": _over_steps(own)})
    return rows


def _over_steps(found: Sequence[Reading]) -> dict[str, float | int | None] | None:
    """Number, median, least and largest of the values, and the median of their sigmas; None: there is one at most."""
    some = [(one.value, one.sigma) for one in found if not one.reason and math.isfinite(one.value)]
    if len(some) < 2:
        return None
    values, sigmas = (np.array(one) for one in zip(*some, strict=True))
    names = {"median": np.median(values), "least": values.min(), "largest": values.max()}
    sigma = float(np.nanmedian(sigmas)) if np.isfinite(sigmas).any() else None
    return {"measured": len(some), **{name: float(value) for name, value in names.items()}, "sigma": sigma}


def judged_over_steps(gauge: Gauge, found: Sequence[Reading]) -> dict[str, Any]:
    """The entry of `measures_record` by the tolerance of a gauge that reads as that of the readings."""
    (row,) = measures_record((gauge,), [replace(one, gauge=gauge) for one in found])
    return row


def verdict_counts(gauge: Gauge, found: Iterable[Reading]) -> dict[str, int]:
    """How many readings come to which verdict by the tolerance of a gauge that reads as theirs; none: not measured."""
    told = (
        "none" if one.reason else gauge.verdict(one.value, one.sigma, one.remark) or "no tolerance" for one in found
    )
    return dict(sorted(Counter(told).items()))


def step_readings(path: Path, scanned: Sequence[Gauge]) -> dict[Gauge, list[Reading]]:
    """Of a scan's table of measures, as of `write_measures`, what each gauge was read as in each step.

    scanned: the gauges that the scan was measured with. A file that is not there or damaged has nothing.
    """
    try:
        rows = list(csv.DictReader(io.StringIO(read_bytes(path, MOST_BYTES).decode("utf-8"))))
    except (InputError, UnicodeDecodeError, csv.Error):
        return {}
    found: dict[Gauge, list[Reading]] = {gauge: [] for gauge in scanned}
    by_name = {gauge.name: gauge for gauge in scanned}
    for row in rows:
        if (gauge := by_name.get(row.get("name") or "")) is not None:
            value, random, systematic = (_typed(row.get(name)) for name in FIGURES[:3])
            truth, points, step = (_typed(row.get(name)) for name in ("truth", "points", "step"))
            step = step if math.isfinite(step) else len(found[gauge])
            reason = row.get("reason") or ("" if math.isfinite(value) else "the table has no value")
            used, remark = int(np.nan_to_num(points)), row.get("remark") or ""
            read_as = (value, random, systematic, used, truth, reason, remark)
            found[gauge].append(Reading(gauge, int(step), *read_as))
    return found


def _typed(text: str | None) -> float:
    try:
        return float(text or math.nan)
    except ValueError:
        return math.nan


def write_measures(path: Path, found: Sequence[Reading]) -> None:
    """One row for each measure and step, SI units, NaN as an empty cell. InputError: the file cannot be written."""
    with atomic_write(path) as temporary, open(temporary, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(MEASURE_COLUMNS)
        for one in found:
            row = _row(one)
            writer.writerow("" if row[name] is None else row[name] for name in MEASURE_COLUMNS)


def _row(one: Reading) -> dict[str, Any]:
    gauge = one.gauge
    row: dict[str, Any] = {"name": gauge.name, "kind": gauge.kind, "unit": gauge.unit, "laser": gauge.laser}
    row["step"] = one.step
    row |= {name: getattr(one, name) for name in FIGURES}
    row |= {"points": one.points, "nominal": gauge.nominal, "lower": gauge.lower, "upper": gauge.upper}
    row |= {"verdict": one.verdict, "reason": one.reason, "remark": one.remark}
    row |= {"oblique": one.oblique, "square": one.square, "section": one.section}
    return {name: None if isinstance(value, float) and math.isnan(value) else value for name, value in row.items()}
