"""What would fix a read-out that is out of range: changes of the project that are tried, each with what it gains."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from render.base.arrays import Float
from render.base.errors import InputError
from render.laser.laser import Waist
from studio.editing.placement import working_distance
from studio.editing.placing import aimed, at_angle
from studio.editing.units import Unit
from studio.preview.estimates import SHARP_PX
from studio.preview.inspection import NARROW_PX, WIDE_PX
from studio.preview.preview import Look
from studio.preview.readout_rows import NOTHING, SATURATED, Row, micrometres, rows
from studio.preview.readouts import RARE, Range, Readouts, readouts
from studio.preview.saturation import brightest
from studio.project.document import FieldPath, replaced, value_at
from studio.project.project import Project

FILLED = 0.7
"""Of the full well, by the brightest pixel of the line: the rest is for noise and for light that is not foreseen."""
ANGLES = (30.0, 20.0, 45.0)
"""Degrees of triangulation, the best first."""
STOPS = (1.4, 2.0, 2.8, 4.0, 5.6, 8.0, 11.0, 16.0, 22.0)
Change = tuple[str, Project]
"""What is done, and the project with it."""
TOLD_FROM = 0.02
"""Change of a value, as a share."""
RANK = {"": 0, "warning": 1, "error": 2}
EXPOSURE: FieldPath = ("sensor", "exposure_time")
LENS: FieldPath = ("scene", "rig", "camera", "lens")


class Step(NamedTuple):
    """A field's new value, and how it is told."""

    told: str
    path: FieldPath
    value: object


@dataclass(frozen=True)
class Remedy:
    """A change that brings a read-out nearer to its range, and none out of it.

    key: of the read-out's row; gain: what is better, that read-out first, before and after; price: what is worse,
    empty for nothing; project: with the change.
    """

    key: str
    label: str
    gain: str
    price: str
    project: Project


def remedies(look: Look, laser: int, look_at: Callable[[Project], Look]) -> tuple[Remedy, ...]:
    """For each read-out that is out of range the first change that helps, if any does.

    look_at: the same scene with another project; a change is tried by reading it out.
    """
    now = readouts(look, laser)
    before = {row.key: row for row in rows(now)}
    found: list[Remedy] = []
    for row in before.values():
        if not row.level or any(one.key == row.key for one in found):
            continue
        for label, project in _changes(row.key, look, laser, now):
            then = readouts(look_at(project), laser)
            after = {one.key: one for one in rows(then)}
            if _helps(row.key, before, after):
                better, worse = _weighed(row.key, now, then)
                gain = ", ".join([f"{row.label.lower()} {_gained(row, after[row.key])}", *better])
                found.append(Remedy(row.key, label, gain, ", ".join(worse), project))
                break
    return tuple(found)


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


def automatic_exposure(project: Project, now: Readouts) -> Change | None:
    """An exposure that fills FILLED of the full well where line and speckle are brightest; None: there is no line.

    InputError: it would be beyond what an exposure may be.
    """
    times = _filling(now, now.brightest)
    return None if times is None else _changed(project, _exposed_by(project, times))


def _filling(now: Readouts, lifted: float) -> float | None:
    """Times the exposure that fills FILLED of the full well; lifted: `Readouts.brightest`; None: no line."""
    if now.peak_electrons is None or not now.peak_electrons.high > 0.0:
        return None
    return FILLED * now.full_well / (lifted * now.peak_electrons.high)


def lit_point(look: Look, laser: int) -> Float:
    """(3,) the middle of the lit line in the rig's frame; where there is none, of the camera's axis in its range."""
    T_rig_camera = look.scene.camera.T_rig_camera.matrix
    points = look.lit(laser).curve.point
    point = np.median(points, axis=0) if len(points) else np.array([0.0, 0.0, working_distance(look.scene)])
    return np.asarray(T_rig_camera[:3, :3] @ point + T_rig_camera[:3, 3])


def _changes(key: str, look: Look, laser: int, now: Readouts) -> Iterator[Change]:
    """What may help a read-out, the least intrusive first; what no project may have is left out."""
    tries = {
        "peak": (_exposed, _powered),
        "saturated": (_exposed,),
        "angle": tuple(_turned(angle) for angle in ANGLES),
        "occluded": tuple(_turned(angle) for angle in ANGLES[1:]),
        "working": (_aimed,),
        "width": (_sheet,),
        "blur": (_focused, _stopped_down, _stopped_down_and_filled),
    }
    for attempt in tries.get(key, ()):
        try:
            change = attempt(look, laser, now)
        except InputError:
            continue
        if change is not None and change[1] is not look.project:
            yield change


def _exposed(look: Look, laser: int, now: Readouts) -> Change | None:
    return automatic_exposure(look.project, now)


def _powered(look: Look, laser: int, now: Readouts) -> Change | None:
    """So much that the line fills what the light beneath it leaves of FILLED."""
    if not now.laser_electrons or now.ambient_electrons is None:
        return None
    path: FieldPath = (*_laser(laser), "power")
    room = FILLED * now.full_well - now.ambient_electrons
    power = look.project.scene.lasers[laser].power * room / (now.brightest * now.laser_electrons)
    return _changed(look.project, _number(look.project, "power", path, "W", float(f"{power:.3g}")))


def _turned(degrees: float) -> Callable[[Look, int, Readouts], Change | None]:
    def change(look: Look, laser: int, now: Readouts) -> Change | None:
        if now.triangulation_angle is None:
            return None
        scene = look.project.scene
        before, camera = scene.lasers[laser].T_rig_laser, scene.camera.T_rig_camera.matrix[:3, 3]
        pose = at_angle(before, camera, lit_point(look, laser), math.radians(degrees))
        path: FieldPath = (*_laser(laser), "T_rig_laser")
        angle = _from_to("rad", now.triangulation_angle.middle, math.radians(degrees))
        return _changed(look.project, Step(f"move the laser: triangulation angle {angle}", path, pose))

    return change


def _aimed(look: Look, laser: int, now: Readouts) -> Change | None:
    """At the middle of what the camera sees, in the depth of the objects, else in that of the focus."""
    scene = look.project.scene
    to_camera = np.linalg.inv(scene.T_world_camera(look.step))
    depths = [float((to_camera @ scene.T_world_object(item, look.step)[:, 3])[2]) for item in scene.visible_objects]
    ahead = [depth for depth in depths if depth > 0.0]
    depth = float(np.median(ahead)) if ahead else scene.camera.lens.focus_distance
    if depth is None:
        return None
    point = (scene.camera.T_rig_camera.matrix @ [0.0, 0.0, depth, 1.0])[:3]
    pose = aimed(scene.lasers[laser].T_rig_laser, point)
    return _changed(look.project, Step("aim the laser at the camera's view", (*_laser(laser), "T_rig_laser"), pose))


def _sheet(look: Look, laser: int, now: Readouts) -> Change | None:
    if now.width_px is None:
        return None
    width = now.width_px.middle
    wanted = 2.0 * NARROW_PX if width < NARROW_PX else 0.5 * WIDE_PX
    sheet = look.project.scene.lasers[laser].sheet
    if isinstance(sheet, Waist):
        distance = float(f"{np.median(look.lit(laser).curve.depth_range):.3g}")
        path: FieldPath = (*_laser(laser), "sheet", "focus_distance")
        return _changed(look.project, _number(look.project, "the laser's focus", path, "m", distance))
    path, angle = (*_laser(laser), "sheet", "full_angle"), float(f"{sheet.full_angle * wanted / width:.3g}")
    return _changed(look.project, _number(look.project, "the sheet's divergence", path, "rad", angle, "mrad"))


def _focused(look: Look, laser: int, now: Readouts) -> Change | None:
    """On the depth whose vergence is in the middle of the line's."""
    return None if now.distance is None else _changed(look.project, _focus(look.project, now.distance))


def _stopped_down(look: Look, laser: int, now: Readouts) -> Change | None:
    """Focused, and stopped down until the line is sharp, exposed longer by what that costs of light."""
    number = _sharp_stop(look.project, now)
    # a line that saturates would be as saturated again
    return None if number is None or (now.saturated or 0.0) > SATURATED else _stopped(look.project, now, number, 1.0)


def _stopped_down_and_filled(look: Look, laser: int, now: Readouts) -> Change | None:
    """The same, at the exposure that fills FILLED of the full well there."""
    number = _sharp_stop(look.project, now)
    if number is None:
        return None
    scene = replaced(look.project, (*LENS, "f_number"), number).scene
    lifted = brightest(look.project.sensor, scene.camera, scene.lasers[laser].wavelength_nm, RARE)
    times = _filling(now, lifted)
    return None if times is None else _stopped(look.project, now, number, times)


def _sharp_stop(project: Project, now: Readouts) -> float | None:
    """The first one at which the line is sharp when focused on; None: no smaller aperture is needed, or there is none.

    At best focus the blur left is about half of the depth's share.
    """
    before = project.scene.camera.lens.f_number
    if now.blur_px is None:
        return None
    number = next((stop for stop in STOPS if stop >= before * max(1.0, now.blur_px.high / SHARP_PX)), before)
    return number if number > before else None


def _stopped(project: Project, now: Readouts, number: float, times: float) -> Change | None:
    """times: the exposure beside what the aperture costs of light."""
    if now.distance is None:
        return None
    before = project.scene.camera.lens.f_number
    aperture = Step(f"f/{before:g} → f/{number:g}", (*LENS, "f_number"), number)
    exposure = _exposed_by(project, times * (number / before) ** 2)
    return _changed(project, aperture, _focus(project, now.distance), exposure)


def _focus(project: Project, distance: Range) -> Step | None:
    depth = float(f"{2.0 / (1.0 / distance.low + 1.0 / distance.high):.4g}")
    return _number(project, "focus", (*LENS, "focus_distance"), "m", depth)


def _exposed_by(project: Project, times: float) -> Step | None:
    return _number(project, "exposure", EXPOSURE, "s", float(f"{project.sensor.exposure_time * times:.3g}"))


def _number(project: Project, what: str, path: FieldPath, unit: str, value: float, shown: str = "") -> Step | None:
    """None: it is that already."""
    before = value_at(project, path)
    return None if before == value else Step(f"{what} {_from_to(unit, before, value, shown)}", path, value)


def _changed(project: Project, *steps: Step | None) -> Change:
    """What is told is what is changed."""
    taken = [step for step in steps if step is not None]
    for step in taken:
        project = replaced(project, step.path, step.value)
    return ", ".join(step.told for step in taken), project


def _helps(key: str, before: dict[str, Row], after: dict[str, Row]) -> bool:
    """The read-out is better by a level, and no other is worse."""
    better = RANK[after[key].level] < RANK[before[key].level] and after[key].value != NOTHING
    return better and all(RANK[row.level] <= RANK[before[row.key].level] for row in after.values() if row.key in before)


def _gained(before: Row, after: Row) -> str:
    """From what to what, a unit that both have told once."""
    was, unit = before.value.partition(" ")[::2]
    told = f"from {was if unit == after.value.partition(' ')[2] else before.value} to {after.value}"
    return told if before.key != "saturated" else f"{told} of the scan lines"


def _from_to(unit: str, before: float | None, after: float, shown: str = "") -> str:
    as_shown = Unit.of(unit, shown)
    was = "far away" if before is None else as_shown.format(float(f"{before:.4g}"))
    return f"{was} → {as_shown.with_unit(after)}"


def _laser(index: int) -> FieldPath:
    return ("scene", "rig", "lasers", index)
