"""The line in an image whose sensor and rig are known: exposures fused, peaks checked against the geometry."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from analysis.line.detection.noise import NoiseModel
from analysis.line.result import Line
from analysis.line.selection.geometry import WorkingVolume
from analysis.line.selection.learned import READY_MADE, load_chooser
from analysis.line.series.hdr import fuse
from analysis.line.settings import ExtractionSettings, Method
from render.sensor.develop import Image
from studio.editing.units import Unit
from studio.preview.scintillation import scintillation
from studio.project.allowed_files import allowed_file
from studio.project.project import Project


def noise_model(image: Image, project: Project, laser: int) -> NoiseModel:
    """How the numbers of a laser's image become electrons, and what scatters them: of the project's sensor and lens."""
    wavelength = project.scene.lasers[laser].wavelength_nm
    table, fineness = scintillation(project.sensor, project.scene.camera, wavelength)
    return NoiseModel(
        gain=image.gain,
        black_level=image.black_level,
        read_noise=math.hypot(image.read_noise, project.sensor.dsnu),  # new in each pixel, if not in each frame
        saturation=image.saturation,
        scintillation=table,
        fineness=fineness,
    )


def working_volume(project: Project, laser: int, settings: ExtractionSettings | None = None) -> WorkingVolume | None:
    """Where the project's rig measures with one laser; None where no geometric check is requested."""
    chosen = project.extraction if settings is None else settings
    if not chosen.geometry:
        return None
    return WorkingVolume(
        project.scene.camera,
        project.scene.lasers[laser],
        project.scene.T_camera_laser(laser),
        nearest=chosen.nearest or 0.0,
        farthest=math.inf if chosen.farthest is None else chosen.farthest,
    )


def extraction_of(project: Project) -> ExtractionSettings:
    """The project's settings, with the file of a chooser. InputError: it lies outside the project's folder."""
    settings = project.extraction
    if settings.chooser is None:
        return settings
    file = allowed_file(project.folder, settings.chooser, "extraction.chooser")
    return settings.model_copy(update={"chooser": str(file)})


def check_chooser(project: Project) -> None:
    """Before anything is rendered for a learned selection. InputError: its weights are no chooser's."""
    settings = extraction_of(project)
    if settings.select == "learned":
        load_chooser(READY_MADE if settings.chooser is None else Path(settings.chooser))


def extract_line(
    project: Project, image: Image, laser: int, threads: int | None = None, method: Method | None = None
) -> Line:
    """The line of one laser in its image, by the project's method or another; `note` tells what was done beyond that.

    InputError: as `extract` and `fuse`.
    """
    from analysis.line.extract import extract  # takes a while: not before there is an image

    settings = extraction_of(project)
    # what a camera has processed is a photograph like a stranger's, which tells its noise itself
    noise = None if image.processed else noise_model(image, project, laser)
    if method == "likelihood" != settings.method:
        settings = settings.model_copy(update={"smoothing": 0.0})  # it needs independent pixels
    if image.pattern is not None and settings.pattern is None:
        settings = settings.model_copy(update={"pattern": image.pattern})
    pixels: NDArray[Any] = image.pixels
    variance = None
    if image.shorter and noise is not None:
        series = (image, *image.shorter)
        fused = fuse([one.pixels for one in series], [one.exposure_time for one in series], noise)
        pixels, variance, noise = fused.electrons, fused.variance, fused.noise
    volume = working_volume(project, laser, settings)
    line = extract(
        pixels, method=method, settings=settings, noise=noise, variance=variance, volume=volume, threads=threads
    )
    return replace(line, note=note_of(line, settings, [one.exposure_time for one in (image, *image.shorter)]))


def note_of(line: Line, settings: ExtractionSettings, times: list[float]) -> str:
    """What was done beyond the method itself, for a person."""
    notes = [line.note] if line.note else []
    if len(times) > 1:
        notes.append(f"{len(times)} exposures fused, " + ", ".join(Unit.of("s").format(time) for time in times) + " ms")
    if line.candidates is not None:
        told = {
            "continuous": "the smoothest chain of peaks",
            "learned": "what the chooser takes for the line",
        }
        notes.append(told.get(settings.select, f"the {settings.select} peak"))
        if settings.geometry:
            near, far = settings.nearest or 0.0, settings.farthest
            end = "" if far is None else f" to {far * 1e3:g} mm"
            notes.append(
                "only peaks on the laser's plane and within its fan" + f", {near * 1e3:g} mm{end} away"
                if near or far
                else "only peaks on the laser's plane and within its fan"
            )
    return "; ".join(notes)
