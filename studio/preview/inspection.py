"""What a project will show in its first frame: the line in the image, resolution, working range, width, exposure.

All of it comes from the exact curve and the direct laser light, a fraction of a second's work; "about" is a median.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from analysis.report.total import NARROW_PX
from analysis.triangulation_angle import triangulation_angles
from render.base.arrays import Float, Float32
from render.camera.camera import Camera
from render.frame import Frame, LaserCurve
from render.output.light_record import plan_record
from render.plan import Plan
from render.sensor.develop import expected_electrons
from render.sensor.response import laser_response
from render.world.material_checks import scene_warnings
from render.world.world import build_world
from studio.preview.estimates import ambient_electrons, line_pixels, line_width_px
from studio.preview.inside import inside
from studio.preview.laser_light import light_of, of_lasers
from studio.preview.preview import Look, Preview
from studio.preview.saturation import saturated_rows
from studio.project.project import Project

WORKING_DISTANCES = np.geomspace(0.01, 100.0, 4001)
WIDE_PX = 6.0
"""Sigma of a line up to which it measures well; from NARROW_PX on."""
SHOWN_PX = 0.45
"""Sigma below which a line's second moment in an image depends on where between the pixels it lies."""
BROADEST_PX = 100.0
"""Light this broad is no line; its width is not followed farther."""
DIM_ELECTRONS = 100.0
STEEP = math.radians(75)


class Beneath(NamedTuple):
    """Ambient light under a line, e-, of scan lines (n,) in ascending order."""

    scan_line: NDArray[np.int32]
    electrons: Float


@dataclass(frozen=True)
class LaserView:
    """One laser as the camera sees it. Lengths m, angles rad; None where there is nothing to measure."""

    name: str
    baseline: float
    """Distance from the camera's centre to the laser's origin."""
    triangulation_angle: float | None
    """Between the rays of camera and laser, about."""
    scan_lines: int
    scan_lines_hit: int
    line_length: float
    """On the surface, where the line is unbroken."""
    line_length_px: float
    depth_nearest: float | None
    depth_farthest: float | None
    working_nearest: float | None
    working_farthest: float | None
    """Depths along the fan's axis that fall into the image; no farthest: no end."""
    depth_per_px: float | None
    along_line_per_px: float | None
    width_px: float | None
    """Standard deviation of the light across the line, without the pixel's own, about."""
    light_electrons: float | None
    """Of the laser alone, without dark current, in the brightest pixel of a scan line, about."""
    peak_electrons: float | None
    """Of the brightest pixel of a scan line, with ambient light and dark current, about."""
    peak_electrons_most: float | None
    saturated: float | None
    """Expected share of the scan lines that are hit whose brightest pixel saturates: `studio.preview.saturation`."""
    ambient_saturated: float | None
    """Share of the line's pixels that the ambient light alone saturates; None: it is not rendered."""
    steepest_view: float | None
    """Largest angle between a facet's normal and the camera or the laser."""


@dataclass(frozen=True)
class Inspection:
    """What is in a project, and what it will show at step 0."""

    name: str
    objects: tuple[tuple[str, str, int], ...]
    """Name, kind of shape, triangles."""
    image_size: tuple[int, int]
    frames: int
    full_well: float
    lasers: tuple[LaserView, ...]
    warnings: tuple[str, ...]
    plan: Plan
    """Of the light: what a render computes and leaves out, by a pilot of the lasers' reflections."""

    def as_dict(self) -> dict[str, Any]:
        return {**asdict(self), "plan": plan_record(self.plan)}


def inspect(project: Project, root: Path, threads: int | None = None) -> Inspection:
    """Load the meshes below `root` and look. InputError: what rendering would refuse as well."""
    from render.products import expected_plan  # these take a while: a window opens without them

    scene = project.scene
    world = build_world(scene, root, 0)
    frame = of_lasers(project, world, threads)
    look = Preview(threads).look(project, root)
    views = laser_views(project, frame, beneath=[_ambient_beneath(look, i) for i in range(len(frame.curves))])
    counts = np.bincount(world.object_id, minlength=len(scene.visible_objects))
    return Inspection(
        name=project.name,
        objects=tuple(
            (item.name, item.shape.kind, int(count)) for item, count in zip(scene.visible_objects, counts, strict=True)
        ),
        image_size=(scene.camera.width, scene.camera.height),
        frames=scene.frame_count,
        full_well=project.sensor.full_well,
        lasers=views,
        warnings=(
            *_warnings(project, views),
            *scene_warnings(world, scene),
            *(one.told for one in inside(look) if one.enclosed),
        ),
        plan=expected_plan(scene, project.render_settings).with_steps("indirect", frame.plan.of("indirect")),
    )


def view_warnings(
    project: Project,
    frame: Frame,
    laser_power: Sequence[float] | None = None,
    saturated: Sequence[float | None] | None = None,
) -> list[str]:
    """What `inspect` warns of, in a frame as it was rendered; laser_power: W of each laser in place of the scene's.

    saturated: share of each laser's scan lines as it was counted in images, in place of what is expected of the light.
    """
    views = laser_views(project, frame, laser_power)
    if saturated is not None:
        views = tuple(replace(view, saturated=share) for view, share in zip(views, saturated, strict=True))
    return _warnings(project, views, laser_power)


def saturation_warning(name: str, saturated: float | None) -> str:
    """Of the share of a laser's scan lines; empty: there is nothing to warn of."""
    if saturated is None or not saturated > 0.01:
        return ""
    return f"{name}: on {saturated:.0%} of the scan lines the brightest pixel saturates; shorten the exposure time"


def laser_views(
    project: Project, frame: Frame, laser_power: Sequence[float] | None = None, beneath: Sequence[Beneath] = ()
) -> tuple[LaserView, ...]:
    """Each laser in a rendered frame, and of its ambient light, or of `beneath` where it has none, what is below it."""
    powers = [laser.power for laser in project.scene.lasers] if laser_power is None else laser_power
    ambient = None
    if frame.ambient is not None:
        ambient = expected_electrons(frame, project.scene, project.sensor, laser_power=[0.0] * len(frame.curves))
    alone = replace(frame, ambient=None)
    found = []
    for i, power in enumerate(powers):
        found.append(_laser_view(project, alone, i, power, ambient, beneath[i] if beneath else None))
    return tuple(found)


def _ambient_beneath(look: Look, laser: int) -> Beneath:
    """The unshadowed ambient light under a laser's line, which `inspect` does not render."""
    lit = look.lit(laser)
    index, first = np.unique(lit.curve.index, return_index=True)
    return Beneath(index, ambient_electrons(look, lit, line_pixels(lit))[first])


def _laser_view(
    project: Project, frame: Frame, i: int, power: float, ambient: Float32 | None, beneath: Beneath | None
) -> LaserView:
    scene, curve = project.scene, frame.curves[i]
    camera, rows = scene.camera, curve.axis == "rows"
    origin = scene.T_camera_laser(i)[:3, 3]
    plane = scene.laser_plane(i)
    nearest, farthest = working_range(camera, scene.T_camera_laser(i))
    hit = np.unique(curve.index)
    lines = light_of(project, frame, i, power)[hit].astype(np.float64)
    light, width = _brightness(lines)
    background = np.full((len(hit), 1), project.sensor.dark_current * project.sensor.exposure_time)
    if ambient is not None:
        background = (ambient if rows else ambient.T)[hit].astype(np.float64)
    elif beneath is not None and len(beneath.scan_line):
        background += np.interp(hit, *beneath)[:, None]
    some = len(curve.point) > 0
    peak = (lines + background).max(axis=1) if some else np.zeros(0)
    full = saturated_rows(project.sensor, camera, scene.lasers[i].wavelength_nm, lines, background)
    length, length_px = _lengths(curve)
    depth_px, along_px = _resolution(camera, plane, curve) if some else (None, None)
    return LaserView(
        name=scene.lasers[i].name,
        baseline=float(np.linalg.norm(origin)),
        triangulation_angle=float(np.median(triangulation_angles(curve.point, origin))) if some else None,
        scan_lines=camera.height if rows else camera.width,
        scan_lines_hit=len(hit),
        line_length=length,
        line_length_px=length_px,
        depth_nearest=float(curve.depth_z.min()) if some else None,
        depth_farthest=float(curve.depth_z.max()) if some else None,
        working_nearest=nearest,
        working_farthest=farthest,
        depth_per_px=depth_px,
        along_line_per_px=along_px,
        width_px=_width(project, frame, i, width[light > 0.0]),
        light_electrons=float(np.median(light)) if some else None,
        peak_electrons=float(np.median(peak)) if some else None,
        peak_electrons_most=float(peak.max()) if some else None,
        saturated=float(np.mean(full)) if some else None,
        ambient_saturated=_saturated_along(curve, ambient, project.sensor.full_well),
        steepest_view=float(max(curve.camera_angle.max(), curve.laser_angle.max())) if some else None,
    )


def _width(project: Project, frame: Frame, i: int, seen: Float) -> float | None:
    """The line's median sigma, px: as the image has it, or where pixels are too coarse to show it, on the surface.

    seen: of the image. A line within a pixel has no second moment there, and one between two has that of their step.
    """
    if len(seen) == 0:
        return None
    width = float(np.median(seen))
    scene, curve = project.scene, frame.curves[i]
    if width >= SHOWN_PX or len(curve.index) < 2:
        return width
    T_camera_laser = scene.T_camera_laser(i)
    pair = (curve.position, curve.index) if curve.axis == "rows" else (curve.index, curve.position)
    pixels = np.stack(pair, axis=1).astype(np.float64)
    normal = facets(curve, T_camera_laser[:3, 3])
    known = line_width_px(
        scene.camera, scene.lasers[i], T_camera_laser, normal, curve.point, pixels, curve.axis == "rows"
    )
    known = known[np.isfinite(known)]
    return float(np.median(known)) if len(known) else width


def facets(curve: LaserCurve, origin: Float) -> Float:
    """(n, 3) unit normals, camera frame, by their angles to camera (at 0) and laser.

    Two normals have them, mirrored in the plane of both directions; the one perpendicular to the line is taken.
    """
    to_camera, to_laser = -curve.point, origin - curve.point
    a = to_camera / np.linalg.norm(to_camera, axis=1, keepdims=True)
    b = to_laser / np.linalg.norm(to_laser, axis=1, keepdims=True)
    cosine = np.einsum("ij,ij->i", a, b)
    cos_a, cos_b, apart = np.cos(curve.camera_angle), np.cos(curve.laser_angle), np.maximum(1.0 - cosine**2, 1e-12)
    along_a, along_b = (cos_a - cosine * cos_b) / apart, (cos_b - cosine * cos_a) / apart
    within = along_a[:, None] * a + along_b[:, None] * b
    out = np.cross(a, b) / np.sqrt(apart)[:, None]
    out *= np.sqrt(np.maximum(1.0 - np.einsum("ij,ij->i", within, within), 0.0))[:, None]
    tangent = np.gradient(curve.point, axis=0)
    first, second = (np.abs(np.einsum("ij,ij->i", within + sign * out, tangent)) for sign in (1.0, -1.0))
    return np.asarray(within + np.where(first <= second, 1.0, -1.0)[:, None] * out)


def _saturated_along(curve: LaserCurve, electrons: Float32 | None, full_well: float) -> float | None:
    """Share of the line's pixels above the full well."""
    if electrons is None or len(curve.index) == 0:
        return None
    lines = electrons if curve.axis == "rows" else electrons.T
    along = np.clip(np.round(curve.position).astype(np.intp), 0, lines.shape[1] - 1)
    return float(np.mean(lines[curve.index, along] > full_well))


def _brightness(lines: Float) -> tuple[Float, Float]:
    """Electrons of light in the brightest pixel, and the line's sigma in px, of scan lines (n, w)."""
    if len(lines) == 0:
        return np.zeros(0), np.zeros(0)
    peak = lines.max(axis=1)
    if not np.any(peak > 0.0):
        return peak, np.zeros(len(peak))
    rough = float(np.median(lines[peak > 0.0].sum(axis=1) / (peak[peak > 0.0] * math.sqrt(2.0 * math.pi))))
    # second moment within a window about the peak, less that of a pixel (Sheppard's correction)
    half = math.ceil(6.0 * min(rough, BROADEST_PX)) + 1
    reach = np.arange(-half, half + 1)
    near = np.clip(lines.argmax(axis=1)[:, None] + reach, 0, lines.shape[1] - 1)
    weight = np.take_along_axis(lines, near, axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        weight /= weight.sum(axis=1, keepdims=True)
    mean = weight @ reach
    variance = np.einsum("ij,ij->i", weight, (reach - mean[:, None]) ** 2) - 1.0 / 12.0
    return peak, np.sqrt(np.maximum(np.nan_to_num(variance), 0.0))


def _lengths(curve: LaserCurve) -> tuple[float, float]:
    """Length (m, px) of the line, summed over neighbouring scan lines where it does not jump."""
    if len(curve.index) < 2:
        return 0.0, 0.0
    steps = np.linalg.norm(np.diff(curve.point, axis=0), axis=1)
    pixels = np.hypot(np.diff(curve.index), np.diff(curve.position))
    joined = (np.diff(curve.index) == 1) & (steps < 10.0 * np.median(steps) + 1e-12)
    return float(steps[joined].sum()), float(pixels[joined].sum())


def _resolution(camera: Camera, plane: Float, curve: LaserCurve) -> tuple[float | None, float | None]:
    """Change of depth for one pixel across the line, and length on the surface from one scan line to the next, m."""
    pixels = np.stack([curve.position, curve.index.astype(np.float64)], axis=1)
    if curve.axis == "columns":
        pixels = pixels[:, ::-1].copy()
    half = np.array([0.5, 0.0] if curve.axis == "rows" else [0.0, 0.5])
    depths = []
    for shifted in (pixels - half, pixels + half):
        rays, _ = camera.rays(shifted)
        with np.errstate(divide="ignore", invalid="ignore"):
            depths.append(-plane[3] * rays[:, 2] / (rays @ plane[:3]))
    change = np.abs(depths[1] - depths[0])
    steps = np.linalg.norm(np.diff(curve.point, axis=0), axis=1)[np.diff(curve.index) == 1]
    depth = float(np.median(change[np.isfinite(change)])) if np.isfinite(change).any() else None
    return depth, float(np.median(steps)) if len(steps) else None


def working_range(camera: Camera, T_camera_laser: Float) -> tuple[float | None, float | None]:
    """Nearest and farthest depth_z of the fan's axis in the image; the farthest is None where it never leaves."""
    points = T_camera_laser[:3, 3] + WORKING_DISTANCES[:, None] * T_camera_laser[:3, 2]
    pixels, valid = camera.project(points)
    with np.errstate(invalid="ignore"):
        seen = valid & (np.abs(pixels[:, 0] - (camera.width - 1) / 2) <= camera.width / 2)
        seen &= np.abs(pixels[:, 1] - (camera.height - 1) / 2) <= camera.height / 2
    if not seen.any():
        return None, None
    if seen[-1]:
        return float(points[seen, 2].min()), None
    # a laser that is turned back towards the camera comes nearer along its axis
    return float(points[seen, 2].min()), float(points[seen, 2].max())


def _warnings(project: Project, views: tuple[LaserView, ...], laser_power: Sequence[float] | None = None) -> list[str]:
    """What a person should know before spending time on a scan, or before believing one."""
    found = []
    if not views:
        found.append("the rig has no laser: there is no line to extract")
    for i, view in enumerate(views):
        if view.scan_lines_hit == 0:
            found.append(f"{view.name}: no part of the line is both lit and seen")
            continue
        if view.ambient_saturated is not None and view.ambient_saturated > 0.01:
            found.append(
                f"{view.name}: the ambient light alone saturates {view.ambient_saturated:.0%} of the line; shorten "
                "the exposure time, add a band-pass filter, or darken the lamps"
            )
        if told := saturation_warning(view.name, view.saturated):
            found.append(told)
        if view.light_electrons is not None and view.light_electrons < DIM_ELECTRONS:
            power = project.scene.lasers[i].power if laser_power is None else laser_power[i]
            found.append(f"{view.name}: {_why_dim(project, i, power, view.light_electrons)}")
        if view.width_px is not None and not NARROW_PX <= view.width_px <= WIDE_PX:
            found.append(
                f"{view.name}: the line's sigma is about {view.width_px:.2f} px; "
                f"{NARROW_PX:g} to {WIDE_PX:g} px measure well"
            )
        if view.steepest_view is not None and view.steepest_view > STEEP:
            found.append(
                f"{view.name}: parts are seen or lit at {math.degrees(view.steepest_view):.0f} deg: expect bias"
            )
    return found


def _why_dim(project: Project, i: int, power: float, electrons: float) -> str:
    laser, none = project.scene.lasers[i], "none of its light reaches the image"
    if power == 0.0:
        return f"{none}: its power is 0 W"
    if project.scene.camera.lens.transmission == 0.0:
        return f"{none}: the camera's lens.transmission is 0"
    if not np.any(laser_response(project.sensor, laser.wavelength_nm)):
        return f"{none}: sensor.efficiency and sensor.band_pass let nothing of {laser.wavelength_nm:g} nm through"
    return f"the line is dim, about {electrons:.2g} e-; lengthen the exposure"
