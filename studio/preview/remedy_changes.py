"""Changes of a project that may help a read-out that is out of range, the least intrusive first; none is tried here."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from analysis.report.total import NARROW_PX
from analysis.triangulation_angle import triangulation_angles
from render.base.arrays import Float
from render.base.errors import InputError
from render.frame import LaserCurve
from render.laser.laser import Waist
from render.sensor.sensor import BandPass
from studio.editing.linked_fields import FOCUS, with_focus
from studio.editing.placement import working_distance
from studio.editing.placing import aimed, at_angle
from studio.editing.units import Unit
from studio.preview.estimates import SHARP_PX, dioptre_px
from studio.preview.focusing import between
from studio.preview.inspection import WIDE_PX
from studio.preview.preview import Look, Mask
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
THIN_PX = 1.0
"""Sigma that a line gets which is too narrow for the pixels."""
TURNS = 6
"""Times a laser is turned until the angle is read that is wanted."""
TURNED = math.radians(0.05)
"""From which an angle is not told as the wanted one."""
STOPS = (1.4, 2.0, 2.8, 4.0, 5.6, 8.0, 11.0, 16.0, 22.0)
Change = tuple[str, Project]
"""What is done, and the project with it."""
EXPOSURE: FieldPath = ("sensor", "exposure_time")
FILTER: FieldPath = ("sensor", "band_pass")
CAMERA: FieldPath = ("scene", "rig", "camera")
LENS: FieldPath = (*CAMERA, "lens")


class Step(NamedTuple):
    """A field's new value, and how it is told; empty: with the step before."""

    told: str
    path: FieldPath
    value: object


def changes(key: str, look: Look, laser: int, now: Readouts, look_at: Callable[[Project], Look]) -> Iterator[Change]:
    """What may help the read-out of a row's key; what no project may have is left out. look_at: as of `remedies`."""
    tries = {
        "peak": (_exposed, _powered, _filtered),
        "saturated": (_exposed, _filtered),
        "angle": tuple(_turned(angle, look_at) for angle in ANGLES),
        "occluded": tuple(_turned(angle, look_at) for angle in (*ANGLES[1:], LEAST_OCCLUDED)),
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
    """(3,) in the rig's frame, that stays lit when the laser turns about it.

    The middle one of the line on the part, in the order along the fan; where there is no line, the camera's axis in the
    working distance. A median of each coordinate would be on the table, beneath a part that is narrower than its half.
    """
    T_rig_camera = look.scene.camera.T_rig_camera.matrix
    curve = look.lit(laser).curve
    if not len(curve.point):
        return np.asarray((T_rig_camera @ [0.0, 0.0, working_distance(look.scene), 1.0])[:3])
    points = curve.point[_on_part(curve)] @ T_rig_camera[:3, :3].T + T_rig_camera[:3, 3]
    along = points @ look.scene.lasers[laser].T_rig_laser.matrix[:3, 1]
    return np.asarray(points[np.argsort(along)[len(along) // 2]])


def _on_part(curve: LaserCurve) -> Mask:
    """(n,) points of all that is lit but the farthest object, on which the others stand; of a single one all."""
    depths = {int(item): float(np.median(curve.depth_z[curve.object_id == item])) for item in set(curve.object_id)}
    everything = np.ones(len(curve.object_id), dtype=np.bool_)
    return everything if len(depths) < 2 else curve.object_id != max(depths, key=lambda item: depths[item])


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


def _turned(degrees: float, look_at: Callable[[Project], Look]) -> Callable[[Look, int, Readouts], Change | None]:
    """About the middle of the line on the part, which stays lit there; told is the angle that is read then."""

    def change(look: Look, laser: int, now: Readouts) -> Change | None:
        wanted = math.radians(degrees)
        turned = None if now.triangulation_angle is None else _read_as(wanted, look, laser, look_at)
        if now.triangulation_angle is None or turned is None:
            return None
        found, step = turned
        read = wanted if abs(found - wanted) < TURNED else math.radians(float(f"{math.degrees(found):.3g}"))
        told = f"move the laser: triangulation angle {_from_to('rad', now.triangulation_angle.middle, read)}"
        return _changed(look.project, step._replace(told=told))

    return change


def _read_as(wanted: float, look: Look, laser: int, look_at: Callable[[Project], Look]) -> tuple[float, Step] | None:
    """The pose at which the angle read comes nearest to one, rad, and what is read; None: the line is lost.

    Read is the median of a line that runs beside the part as well, where the angle is another one.
    """
    scene, asked, best = look.project.scene, wanted, None
    before, camera, point = scene.lasers[laser].T_rig_laser, scene.camera.T_rig_camera.matrix, lit_point(look, laser)
    path: FieldPath = (*_laser(laser), "T_rig_laser")
    for _ in range(TURNS):
        step = Step("", path, at_angle(before, camera[:3, 3], point, asked))
        found = _angle(look_at(replaced(look.project, path, step.value)), laser)
        if found is not None and (best is None or abs(found - wanted) < abs(best[0] - wanted)):
            best = found, step
        if found is None or abs(found - wanted) < TURNED:
            break
        asked = min(max(asked + wanted - found, 0.5 * wanted), 1.5 * wanted)
    return best


def _angle(look: Look, laser: int) -> float | None:
    """Of triangulation, rad, the median of the line; None: there is none."""
    curve, camera = look.lit(laser).curve, look.scene.camera.T_rig_camera.matrix
    origin = look.scene.lasers[laser].T_rig_laser.matrix[:3, 3] - camera[:3, 3]
    return float(np.median(triangulation_angles(curve.point, origin @ camera[:3, :3]))) if len(curve.point) else None


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
    return THIN_PX if width.middle < NARROW_PX else 0.5 * WIDE_PX


def _laser_focus(look: Look, laser: int) -> Step | None:
    distance = float(f"{np.median(look.lit(laser).curve.depth_range):.3g}")
    path: FieldPath = (*_laser(laser), "sheet", "focus_distance")
    return _number(look.project, "the laser's focus", path, "m", distance)


def _focused(look: Look, laser: int, now: Readouts) -> Change | None:
    """On the depth whose vergence is in the middle of the line's."""
    return None if now.distance is None else _changed(look.project, *_focus(look.project, now.distance))


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
    return _changed(project, aperture, *_focus(project, now.distance), exposure)


def _focus(project: Project, distance: Range) -> tuple[Step, ...]:
    """As by the ring of the lens, whose focal length stays: the image distance follows, and fx and fy with it."""
    focus = between(distance.low, distance.high)
    step = _number(project, "focus", FOCUS, "m", focus)
    if step is None:
        return ()
    found = with_focus(project.scene.camera, focus)
    kept = Step("focal length kept", (*CAMERA, "fx"), found["fx"])
    return step, kept, Step("", (*CAMERA, "fy"), found["fy"])


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
    return ", ".join(step.told for step in taken if step.told), project


def _from_to(unit: str, before: float | None, after: float, shown: str = "") -> str:
    as_shown = Unit.of(unit, shown)
    factor = as_shown.factor
    was = "far away" if before is None else as_shown.format(float(f"{factor * before:.4g}") / factor)
    return f"{was} → {as_shown.with_unit(after)}"


def _laser(index: int) -> FieldPath:
    return ("scene", "rig", "lasers", index)
