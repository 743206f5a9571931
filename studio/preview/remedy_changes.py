"""Changes of a project that may help a read-out that is out of range, the least intrusive first; none is tried here."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from render.base.arrays import Float
from render.base.errors import InputError
from render.laser.laser import Waist
from render.sensor.sensor import BandPass
from studio.editing.placement import working_distance
from studio.editing.placing import aimed, at_angle
from studio.editing.units import Unit
from studio.preview.estimates import SHARP_PX, dioptre_px
from studio.preview.focusing import between
from studio.preview.inspection import NARROW_PX, WIDE_PX
from studio.preview.preview import Look
from studio.preview.readout_rows import SATURATED
from studio.preview.readouts import RARE, Range, Readouts
from studio.preview.saturation import brightest
from studio.project.document import FieldPath, replaced, value_at
from studio.project.project import Project

FILLED = 0.7
"""Of the full well, by the brightest pixel of the line: the rest is for noise and for light that is not foreseen."""
ANGLES = (30.0, 20.0, 45.0)
"""Degrees of triangulation, the best first."""
LEAST_OCCLUDED = 12.0
"""Degrees, somewhat above those at which depth is coarse."""
UNFOCUSED = 0.25
"""Of the blur, what is left at best focus, below which the lens is focused before it is stopped down."""
STOPS = (1.4, 2.0, 2.8, 4.0, 5.6, 8.0, 11.0, 16.0, 22.0)
Change = tuple[str, Project]
"""What is done, and the project with it."""
EXPOSURE: FieldPath = ("sensor", "exposure_time")
FILTER: FieldPath = ("sensor", "band_pass")
LENS: FieldPath = ("scene", "rig", "camera", "lens")


class Step(NamedTuple):
    """A field's new value, and how it is told."""

    told: str
    path: FieldPath
    value: object


def changes(key: str, look: Look, laser: int, now: Readouts) -> Iterator[Change]:
    """What may help the read-out of a row's key; what no project may have is left out."""
    tries = {
        "peak": (_exposed, _powered, _filtered),
        "saturated": (_exposed, _filtered),
        "angle": tuple(_turned(angle) for angle in ANGLES),
        "occluded": tuple(_turned(angle) for angle in (*ANGLES[1:], LEAST_OCCLUDED)),
        "working": (_aimed,),
        "width": (_sheet, _waist),
        "blur": (_focused, _stopped_down, _stopped_down_and_filled),
    }
    for attempt in tries.get(key, ()):
        try:
            change = attempt(look, laser, now)
        except InputError:
            continue
        if change is not None and change[1] is not look.project:
            yield change


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


def _exposed(look: Look, laser: int, now: Readouts) -> Change | None:
    return automatic_exposure(look.project, now)


def _powered(look: Look, laser: int, now: Readouts) -> Change | None:
    """So much that the line, where it is brightest, fills what the light beneath it leaves of FILLED."""
    if not now.most_laser_electrons or now.ambient_electrons is None:
        return None
    path: FieldPath = (*_laser(laser), "power")
    room = FILLED * now.full_well - now.ambient_electrons
    power = look.project.scene.lasers[laser].power * room / (now.brightest * now.most_laser_electrons)
    return _changed(look.project, _number(look.project, "power", path, "W", float(f"{power:.3g}")))


def _filtered(look: Look, laser: int, now: Readouts) -> Change | None:
    """By a filter that lets through little beside the laser's light."""
    if look.project.sensor.band_pass is not None:
        return None
    centre = look.project.scene.lasers[laser].wavelength_nm
    chosen = BandPass(centre_nm=centre)
    told = f"a band-pass filter at {centre:g} nm, {chosen.width_nm:g} nm wide"
    return _changed(look.project, Step(told, FILTER, chosen))


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
    """A wider or narrower one; a waist where the line is."""
    sheet, width = look.project.scene.lasers[laser].sheet, now.width_px
    if width is None:
        return None
    if isinstance(sheet, Waist):
        return _changed(look.project, _laser_focus(look, laser))
    path, angle = (*_laser(laser), "sheet", "full_angle"), sheet.full_angle * _wanted(width) / width.middle
    angle = float(f"{angle:.3g}")
    return _changed(look.project, _number(look.project, "the sheet's divergence", path, "rad", angle, "mrad"))


def _waist(look: Look, laser: int, now: Readouts) -> Change | None:
    """A waist where the line is, of the radius that makes it as wide as it should be."""
    source, width = look.project.scene.lasers[laser], now.width_px
    if width is None or not isinstance(source.sheet, Waist):
        return None
    distance = float(np.median(look.lit(laser).curve.depth_range))
    radius = 2.0 * float(source.sigma(distance)) * _wanted(width) / width.middle
    path: FieldPath = (*_laser(laser), "sheet", "radius")
    waist = _number(look.project, "the laser's waist", path, "m", float(f"{radius:.3g}"), "um")
    return _changed(look.project, waist, _laser_focus(look, laser))


def _wanted(width: Range) -> float:
    """px, for a line that is too narrow or too wide."""
    return 2.0 * NARROW_PX if width.middle < NARROW_PX else 0.5 * WIDE_PX


def _laser_focus(look: Look, laser: int) -> Step | None:
    distance = float(f"{np.median(look.lit(laser).curve.depth_range):.3g}")
    path: FieldPath = (*_laser(laser), "sheet", "focus_distance")
    return _number(look.project, "the laser's focus", path, "m", distance)


def _focused(look: Look, laser: int, now: Readouts) -> Change | None:
    """On the depth whose vergence is in the middle of the line's."""
    return None if now.distance is None else _changed(look.project, _focus(look.project, now.distance))


def _stopped_down(look: Look, laser: int, now: Readouts) -> Change | None:
    """Focused, and stopped down until the line is sharp, exposed longer by what that costs of light."""
    number = _sharp_stop(look, now)
    # a line that saturates would be as saturated again
    return None if number is None or (now.saturated or 0.0) > SATURATED else _stopped(look.project, now, number, 1.0)


def _stopped_down_and_filled(look: Look, laser: int, now: Readouts) -> Change | None:
    """The same, at the exposure that fills FILLED of the full well there."""
    number = _sharp_stop(look, now)
    if number is None:
        return None
    scene = replaced(look.project, (*LENS, "f_number"), number).scene
    lifted = brightest(look.project.sensor, scene.camera, scene.lasers[laser].wavelength_nm, RARE)
    times = _filling(now, lifted)
    return None if times is None else _stopped(look.project, now, number, times)


def _sharp_stop(look: Look, now: Readouts) -> float | None:
    """The first one at which the line is sharp when focused on, else the smallest.

    None: there is no smaller one, or it is the focus that blurs. At best focus the blur left is about half of the
    depth's share.
    """
    camera = look.project.scene.camera
    before = camera.lens.f_number
    if now.blur_px is None or now.distance is None:
        return None
    depth = 1.0 / now.distance.low - 1.0 / now.distance.high
    if 0.5 * dioptre_px(camera) * depth < UNFOCUSED * now.blur_px.high:
        return None
    number = next((stop for stop in STOPS if stop >= before * max(1.0, now.blur_px.high / SHARP_PX)), STOPS[-1])
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
    return _number(project, "focus", (*LENS, "focus_distance"), "m", between(distance.low, distance.high))


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


def _from_to(unit: str, before: float | None, after: float, shown: str = "") -> str:
    as_shown = Unit.of(unit, shown)
    was = "far away" if before is None else as_shown.format(float(f"{before:.4g}"))
    return f"{was} → {as_shown.with_unit(after)}"


def _laser(index: int) -> FieldPath:
    return ("scene", "rig", "lasers", index)
