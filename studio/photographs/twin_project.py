"""From a project and photographs of the real scanner to the project of its twin."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from render.base.errors import InputError
from render.frame import LaserCurve
from render.laser.laser import Divergence, LineLaser, Waist
from render.scene.scene import Scene
from render.sensor.sensor import Sensor
from render.truth.laser_curve import laser_curve
from render.world.world import build_world
from studio.photographs.evidence import COLOURS
from studio.photographs.photograph_set import Wishes, look_at
from studio.photographs.photographs import Measured, check_size, extract_photograph, naming
from studio.photographs.rehearsal import Stage, ground_of, rehearsed
from studio.photographs.twin import Told, Twin, by_rehearsal
from studio.photographs.twin_light import FULL, light_of, numbers_of
from studio.photographs.twin_seen import Seen, light_above, look
from studio.preview.inspection import inspect
from studio.preview.laser_light import laser_electrons
from studio.project.project import Project

LIT = 0.01
"""Of the usual light of the project's line, below which a scan line has none to be compared."""


class Made(NamedTuple):
    """What photographs made of a project."""

    project: Project
    """Of the twin."""
    twin: Twin
    """What was fitted."""
    power: Told
    """Of the laser, W, if the surface is as bright as the project's."""
    warnings: tuple[str, ...]
    """For a person."""


def twin_of(project: Project, root: Path, laser: int, paths: Sequence[Path], threads: int | None = None) -> Made:
    """The project with sheet, blur, halo, noise and laser power as photographs of its scanner show them.

    root: the folder of its meshes. paths: the steps of its motion in order, or any number at its first step.
    InputError: the sensor is none that this fits, a photograph is not of its size, type or bits, or too little is seen.
    """
    sensor = project.sensor
    if sensor.processing is None and sensor.colour != "mono":
        cure = "take raw mono images or a camera's photographs, and a project with such a sensor"
        raise InputError("a twin is not fitted to a raw mosaic", where="sensor", found="a Bayer sensor", cure=cure)
    settings, numbers = project.extraction, numbers_of(project, laser)
    lossy = []
    for path in paths:
        taken = look_at([path], settings, Wishes(settings.axis)).read(path)[0]
        _check(taken.pixels, path, project)
        lossy.append(taken.lossy)
    seen_as = look_at(paths, settings, Wishes(settings.axis, channel=numbers.channel))
    measured = [extract_photograph(path, seen_as, threads) for path in paths]
    curves = _curves(project.scene, root, laser, measured, threads)
    with naming(paths[0]):
        images = [light_of(one.image, sensor, numbers.channel) for one in measured]
        seen = look(project, laser, images, [one.line for one in measured], curves, numbers)
    axis = seen_as.settings.axis
    by_number = {one.photograph: one for one in seen.pieces}
    ground = [
        ground_of(one.image, by_number[k], sensor, axis, seen.width) if k in by_number else np.zeros((0, 2, 1))
        for k, one in enumerate(measured)
    ]
    stage = Stage(laser, paths, seen_as, lossy, ground, threads)

    def rehearse(twin: Twin, seed: int, louder: float) -> Seen:
        return rehearsed(_louder(_with_twin(project, laser, twin), louder), seen, stage, twin.scale.value, seed)

    try:
        with naming(paths[0]):
            twin = by_rehearsal(project, seen, numbers, rehearse)
        made, power = _with_power(_with_twin(project, laser, twin), root, laser, twin, seen, threads)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"]))
        cure = "see that the photographs are of this project's scanner"
        raise InputError(f"the fit is beyond what a project may hold: {first['msg']}", where=where, cure=cure) from None
    warnings = []
    sheet = project.scene.lasers[laser].sheet
    if isinstance(sheet, Waist) and twin.scale.value**2 * sheet.m_squared < 1.0:
        warnings.append("the sheet is narrower than a beam of this wavelength stays: M^2 is 1, and it widens faster")
    if seen.facing:
        warnings.append(
            "the line is not where the project's surface has it, so the surface is taken to face the laser: on a "
            "slanted one the sheet comes out too wide or too narrow"
        )
    if twin.blur_px.why:
        warnings.append(
            f"the photographs tell the line's width, {twin.line_px.value:.4g} px, and not what of it is the sheet's, "
            f"which holds if the lens blur is {twin.blur_px.value:.3g} px; a part near and far, or slanted, tells"
        )
    if twin.ambient.value > 0.01 * twin.peak.value:
        warnings.append(
            f"{twin.ambient.value:.0f} e- of other light are beside the line; the project's lights are as they were"
        )
    return Made(made, twin, power, tuple(warnings))


def _check(pixels: NDArray[np.generic], path: Path, project: Project) -> None:
    """InputError: a photograph that the project's camera and sensor cannot have taken."""
    bits = project.sensor.bits
    with naming(path):
        check_size(pixels, project.scene.camera)
    coloured = project.sensor.colour != "mono"
    if (pixels.ndim == 3) != coloured:
        found = "a photograph in colour" if pixels.ndim == 3 else "a photograph without colour"
        wanted = "in colour" if coloured else "mono"
        raise InputError(f"the project's sensor takes images that are {wanted}", where=str(path), found=found)
    bits = bits if project.sensor.processing is None else 8
    if pixels.dtype != (np.uint8 if bits == 8 else np.uint16) or int(pixels.max()) > 2**bits - 1:
        found = f"{pixels.dtype} up to {pixels.max()}"
        cure = "set sensor.bits and sensor.black_level in the project"
        raise InputError(f"these are no numbers of {bits} bits", where=str(path), found=found, cure=cure)


def _curves(
    scene: Scene, root: Path, laser: int, measured: Sequence[Measured], threads: int | None
) -> list[LaserCurve]:
    """The project's own line for each photograph."""
    found: list[LaserCurve] = []
    for k, one in enumerate(measured):
        step = k if len(measured) <= scene.frame_count else 0
        if k and not step:
            found.append(found[0])
            continue
        poses = scene.T_world_camera(step), scene.T_world_laser(laser, step)
        world = build_world(scene, root, step)
        found.append(laser_curve(world, scene.camera, scene.lasers[laser], *poses, one.line.axis, threads))
    return found


def _with_twin(project: Project, laser: int, twin: Twin) -> Project:
    """The project with the fitted sheet and sensor."""
    sensor, pitch = project.sensor, project.scene.camera.pixel_pitch
    values = sensor.model_dump()
    values.update(blur_sigma=twin.blur_px.value * pitch, halo=twin.halo.value, halo_sigma=twin.halo_px.value * pitch)
    gain, top = twin.gain.value, 2.0**sensor.bits - 1.0
    values.update(read_noise=twin.read_noise.value)
    if sensor.processing is not None:
        share = numbers_of(project, laser).share
        values.update(full_well=FULL * share / gain, gain=None)
    else:
        values.update(full_well=(twin.saturation.value - sensor.black_level) / gain)
        values.update(gain=gain if sensor.gain is not None or twin.saturation.value < top else None)
        if sensor.speckle == "off":
            values.update(prnu=twin.scatter.value)
    lasers = list(project.scene.lasers)
    lasers[laser] = wider(lasers[laser], twin.scale.value)
    return _with_lasers(project, tuple(lasers)).model_copy(update={"sensor": Sensor.model_validate(values)})


def _louder(project: Project, times: float) -> Project:
    """The project with so many times the variance of the noise, at the same light and numbers."""
    if times == 1.0:
        return project
    sensor = project.sensor
    values = {"full_well": sensor.full_well / times, "read_noise": sensor.read_noise / times**0.5}
    gain = None if sensor.gain is None else sensor.gain * times
    return project.model_copy(update={"sensor": sensor.model_copy(update={**values, "gain": gain})})


def wider(laser: LineLaser, scale: float) -> LineLaser:
    """The laser with a sheet `scale` times as wide at every distance."""
    sheet = laser.sheet
    if isinstance(sheet, Divergence):
        angle = 2.0 * math.atan(scale * math.tan(sheet.full_angle / 2.0))
        return laser.model_copy(update={"sheet": Divergence(full_angle=angle)})
    # the Rayleigh length stays, pi w^2 / (M^2 lambda), down to that of a perfect beam
    values = {"radius": scale * sheet.radius, "m_squared": max(scale**2 * sheet.m_squared, 1.0)}
    return laser.model_copy(update={"sheet": type(sheet).model_validate({**sheet.model_dump(), **values})})


def _with_power(
    project: Project, root: Path, laser: int, twin: Twin, seen: Seen, threads: int | None
) -> tuple[Project, Told]:
    """The project whose line is as bright as the photographs': power times reflectance is all that they show."""
    brighter = _brighter(_of_one_colour(project, laser), root, laser, twin, seen, threads)
    lasers = list(project.scene.lasers)
    power = lasers[laser].power
    if not brighter > 0.0:
        return project, Told(power, 0.0, "the project's laser lights nothing that its camera sees")
    scaled = power * brighter
    lasers[laser] = LineLaser.model_validate({**lasers[laser].model_dump(), "power": scaled})
    return _with_lasers(project, tuple(lasers)), Told(scaled, scaled * twin.peak.sigma / twin.peak.value)


def _brighter(project: Project, root: Path, laser: int, twin: Twin, seen: Seen, threads: int | None) -> float:
    """How many times as much light the photographs have of the line as the project's own; 0: it has none.

    Of the same scan lines, as some are brighter than others and not all of them are seen; where the line is not the
    project's, of the brightest pixel in the median.
    """
    first = [piece for piece in seen.pieces if piece.photograph == 0 or project.scene.frame_count == 1]
    if seen.facing or not first:
        light = inspect(project, root, threads).lasers[laser].light_electrons
        return twin.peak.value / light if light else 0.0
    electrons = laser_electrons(project, root, laser, threads)
    found, own = (
        np.concatenate([light_above(one) for one in windows])
        for windows in (
            [piece.stretch.values for piece in first],
            [electrons[piece.stretch.row[:, None], piece.columns].astype(np.float64) for piece in first],
        )
    )
    there = own > LIT * float(np.median(own))
    return float(np.median(found[there] / own[there])) / twin.gain.value if there.any() else 0.0


def _of_one_colour(project: Project, laser: int) -> Project:
    """The project with a sensor that has the colour everywhere that is measured, which a mosaic has not on each row."""
    channel = numbers_of(project, laser).channel
    if channel == "mono":
        return project
    curve = project.sensor.efficiency[COLOURS.index(channel)]
    return project.model_copy(
        update={"sensor": project.sensor.model_copy(update={"colour": "mono", "efficiency": (curve,)})}
    )


def _with_lasers(project: Project, lasers: tuple[LineLaser, ...]) -> Project:
    rig = project.scene.rig.model_copy(update={"lasers": lasers})
    return project.model_copy(update={"scene": project.scene.model_copy(update={"rig": rig})})
