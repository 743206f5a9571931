"""What a rig can do, read off its lit curve in milliseconds: resolution, width, electrons, focus, noise, occlusion."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from pydantic import BaseModel

from analysis.triangulation_angle import triangulation_angles
from render.base.arrays import Float
from render.camera.camera import Camera
from render.material.material import FromMesh, GreyTexture, Subsurface, Texture
from studio.preview import estimates
from studio.preview.calibration_fit import CalibrationFit, calibration_fit
from studio.preview.inspection import working_range
from studio.preview.preview import Look
from studio.preview.saturation import brightest, full_electrons, saturated_lines
from studio.preview.scintillation import speckle_px

RARE = 0.005
"""Share of the scan lines that an exposure may leave saturated by speckle."""
SPECKLED = 64
"""Places along the line at which the effect of speckle is worked out."""
FILLED_PLACES = 128
"""The same of what saturates, which depends on where within a pixel the line falls."""


GOOD_PX = 0.05
"""Sigma of a well exposed line, px."""
UNSEEN = 0.1
UNKNOWN_SIGMA = 1e-5
"""m, of a rig whose laser is nowhere in view."""


class Range(NamedTuple):
    """Least, median and greatest along the lit line."""

    low: float
    middle: float
    high: float


@dataclass(frozen=True)
class Readouts:
    """Of one laser; lengths m, angles rad. None: no line is both lit and seen, or as said."""

    name: str
    baseline: float
    working_nearest: float | None
    working_farthest: float | None
    """Depths along the fan's axis that fall into the image; no farthest: no end. Known without any object."""
    working_depth_per_px: tuple[float, float] | None
    """`depth_per_px` at the ends of the working range (the far end at most ten times the near one)."""
    sharp_nearest: float
    sharp_farthest: float
    """Depths between which the blur disc is at most `estimates.SHARP_PX`; inf: no end."""
    full_well: float
    """e- that a pixel tells of at most, by its well or by its highest number."""
    occluded: float | None
    """Share of the line within the image that the camera cannot see."""
    scan_lines: int
    scan_lines_hit: int
    triangulation_angle: Range | None = None
    """At the surface, between the rays of camera and laser."""
    distance: Range | None = None
    """depth_z of the lit line."""
    depth_per_px: Range | None = None
    """Change of depth_z for one pixel across the line."""
    along_per_px: Range | None = None
    """Length in the sheet from one scan line to the next."""
    width_px: Range | None = None
    """Gaussian sigma across the line, without defocus."""
    peak_electrons: Range | None = None
    """Of the brightest pixel of a scan line, before saturation."""
    saturated: float | None = None
    """Expected share of the scan lines that are hit whose brightest pixel saturates, by shot and read noise, and the
    sensor's speckle."""
    brightest: float = 1.0
    """Times its mean that speckle makes a pixel's laser light on RARE of the scan lines; 1 without speckle."""
    laser_electrons: float | None = None
    """What of the brightest pixel is the laser's light, median."""
    most_laser_electrons: float | None = None
    """The same on the scan line that has most of it."""
    ambient_electrons: float | None = None
    """Background of ambient light and dark current, unshadowed, median."""
    detected: float | None = None
    """Response of the extraction's detection to the line over the least that counts as one, median."""
    blur_px: Range | None = None
    """Diameter of the blur disc along the lit line."""
    spreads: bool = False
    """Light goes below some of the surfaces that are lit, and leaves beside the line."""
    textured: bool = False
    """Some of the surfaces that are lit have images: their brightness changes within the line."""
    blurs_images: bool = True
    """Images have that blur: their lens is rendered, or the sensor's defocus is switched on."""
    photon_sigma: float | None = None
    """Expected standard deviation of depth_z from photon and read noise (Cramer-Rao bound), median."""
    speckle_sigma: float | None = None
    """The same from fully developed speckle, whether or not the sensor shows it."""
    speckled: bool = False
    """The sensor shows speckle."""
    calibration: CalibrationFit | None = None
    """None: the project has none, or nothing of the line is in its reach."""

    @property
    def speckled_sigma(self) -> float | None:
        """Of both noises, whether or not the sensor shows speckle."""
        if self.photon_sigma is None or self.speckle_sigma is None:
            return None
        return math.hypot(self.photon_sigma, self.speckle_sigma)

    @property
    def depth_sigma(self) -> float | None:
        """Of all noise that the sensor, as it is set, puts into an image."""
        return self.speckled_sigma if self.speckled else self.photon_sigma


def _has_images(material: BaseModel) -> bool:
    """It, or a part of it, takes values from an image or from the mesh's file."""
    values = [getattr(material, name) for name in type(material).model_fields]
    models = [value for value in values if isinstance(value, BaseModel)]
    return any(isinstance(one, Texture | GreyTexture | FromMesh) or _has_images(one) for one in models)


def readouts(look: Look, laser: int) -> Readouts:
    """Of one laser in one look at a project."""
    scene, sensor = look.scene, look.project.sensor
    camera, source = scene.camera, scene.lasers[laser]
    T_camera_laser, plane = scene.T_camera_laser(laser), scene.laser_plane(laser)
    rows = look.project.extraction.axis == "rows"
    across, along = ((1.0, 0.0), (0.0, 1.0)) if rows else ((0.0, 1.0), (1.0, 0.0))
    nearest, farthest = working_range(camera, T_camera_laser)
    sharp = estimates.depth_of_field(camera)
    lit = look.lit(laser)
    curve = lit.curve
    hit = np.unique(curve.index)
    known = Readouts(
        name=source.name,
        baseline=float(np.linalg.norm(T_camera_laser[:3, 3])),
        working_nearest=nearest,
        working_farthest=farthest,
        working_depth_per_px=_working_resolution(camera, T_camera_laser, plane, across, nearest, farthest),
        sharp_nearest=sharp[0],
        sharp_farthest=sharp[1],
        blurs_images=sensor.defocus_by(camera.lens.model) != "nothing",
        full_well=full_electrons(sensor),
        occluded=look.fan(laser).occluded,
        scan_lines=camera.height if rows else camera.width,
        scan_lines_hit=len(hit),
    )
    if len(curve.index) == 0:
        return known
    pixels = estimates.line_pixels(lit)
    depth = estimates.resolution(camera, plane, pixels, across)[:, 2]
    width = estimates.line_width_px(camera, source, T_camera_laser, lit.normal, curve.point, pixels, rows)
    ambient = estimates.ambient_electrons(look, lit, pixels) + sensor.dark_current * sensor.exposure_time
    amplitude = estimates.line_electrons(camera, source, sensor, lit, pixels)
    if known.blurs_images:
        width, amplitude = estimates.blurred(width, amplitude, estimates.blur_px(camera, curve.point))
    light = amplitude * estimates.pixel_share(curve.position, width)
    peak = light + ambient
    read = estimates.read_variance(sensor)
    response = estimates.detection_response(amplitude, width, ambient, read)
    bound = estimates.centre_bound_px(amplitude, width, ambient, read)
    some = np.unique(np.linspace(0, len(width) - 1, SPECKLED).astype(int))
    shown = width[some], curve.position[some], amplitude[some], ambient[some]
    speckle = speckle_px(camera, source.wavelength_nm, *shown, read, sensor.speckle == "depolarised")
    many = np.unique(np.linspace(0, len(width) - 1, FILLED_PLACES).astype(int))
    lines = width[many], curve.position[many], amplitude[many], ambient[many]
    lit_materials = [scene.visible_objects[i].material for i in np.unique(curve.object_id)]
    return replace(
        known,
        triangulation_angle=_range(triangulation_angles(curve.point, T_camera_laser[:3, 3])),
        distance=_range(curve.depth_z),
        depth_per_px=_range(depth),
        along_per_px=_range(np.linalg.norm(estimates.resolution(camera, plane, pixels, along), axis=1)),
        width_px=_range(width),
        peak_electrons=_range(peak),
        saturated=float(np.mean(saturated_lines(sensor, camera, source.wavelength_nm, *lines))),
        brightest=brightest(sensor, camera, source.wavelength_nm, RARE),
        laser_electrons=_median(light),
        most_laser_electrons=None if (lit_by := _range(light)) is None else lit_by.high,
        ambient_electrons=float(np.median(ambient)),
        detected=_median(response / look.project.extraction.threshold),
        spreads=any(isinstance(material, Subsurface) for material in lit_materials),
        textured=any(_has_images(material) for material in lit_materials),
        blur_px=_range(estimates.blur_px(camera, curve.point)),
        photon_sigma=_median(bound * depth),
        speckle_sigma=_median(speckle * depth[some]),
        speckled=sensor.speckle != "off",
        calibration=calibration_fit(look.project, laser, curve.index, curve.position),
    )


def facet_chord(lasers: Sequence[Readouts]) -> float:
    """How far facets may be off a curved part, m, so that no depth tells: a tenth of the least predicted sigma.

    Of lasers that hit nothing, the sigma of a line found to GOOD_PX.
    """
    sigmas = []
    for one in lasers:
        if one.depth_sigma is not None and one.depth_sigma > 0.0:
            sigmas.append(one.depth_sigma)
        elif one.working_depth_per_px is not None:
            sigmas.append(GOOD_PX * min(one.working_depth_per_px))
    return UNSEEN * min(sigmas, default=UNKNOWN_SIGMA)


def _working_resolution(
    camera: Camera,
    T_camera_laser: Float,
    plane: Float,
    across: tuple[float, float],
    nearest: float | None,
    farthest: float | None,
) -> tuple[float, float] | None:
    axis, origin = T_camera_laser[:3, 2], T_camera_laser[:3, 3]
    if nearest is None or axis[2] <= 0.0:
        return None
    far = min(farthest if farthest is not None else math.inf, 10.0 * nearest)
    points = origin + ((np.array([nearest, far]) - origin[2]) / axis[2])[:, None] * axis
    pixels, _ = camera.project(points)
    change = estimates.resolution(camera, plane, pixels, across)[:, 2]
    return float(change[0]), float(change[1])


def _range(values: Float) -> Range | None:
    known = values[np.isfinite(values)]
    return Range(float(known.min()), float(np.median(known)), float(known.max())) if len(known) else None


def _median(values: Float) -> float | None:
    found = _range(values)
    return None if found is None else found.middle
