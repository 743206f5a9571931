"""A twin's own photographs: its line drawn where the photographs have it, through its sensor, and measured as they are.

What the closed forms leave out is alike in both and cancels: how positions scatter, slant, speckle, sharpening,
denoising and compression. A drawn line needs no render, so that a rehearsal takes as long as measuring does. This is
indirect inference (Gourieroux, Monfort and Renault, Journal of Applied Econometrics 8, 1993).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d
from scipy.signal import savgol_filter

from render.base.arrays import Float, Float32
from render.frame import Axis, Frame
from render.sensor.develop import develop
from render.sensor.response import band_response, joules_per_radiance, laser_response, relative_illumination
from render.sensor.sensor import Sensor
from studio.photographs.evidence import COLOURS
from studio.photographs.image_files import Photograph
from studio.photographs.line_profile import stretch_of
from studio.photographs.photograph_set import Look
from studio.photographs.photographs import extract_photograph
from studio.photographs.twin_light import Numbers, electrons_of, light_of, numbers_of
from studio.photographs.twin_profile import pixel_gaussian
from studio.photographs.twin_seen import Piece, Seen, margin_of, runs
from studio.project.project import Project

LINES = 2048
"""Scan lines that are enough for one rehearsal."""
ALONG, STRAIGHT = 33, 11
"""Scan lines over which the line's light and its course are taken to be smooth."""
REACH = 7.0
"""Sigmas to which a line is drawn."""


@dataclass(frozen=True)
class Stage:
    """Of what photographs a rehearsal is like."""

    laser: int
    paths: Sequence[Path]
    look: Look
    """How they are measured."""
    lossy: Sequence[bool]
    ground: Sequence[Float]
    """Of each (c,) DN beside the line, of each channel, linear in light."""
    threads: int | None


def rehearsed(project: Project, seen: Seen, stage: Stage, scale: float, seed: int) -> Seen:
    """What the photographs would have shown if the twin's project were right. scale: of the sheet as `seen` has it."""
    pieces: list[Piece] = []
    lines = 0
    for piece in seen.pieces:
        if lines >= LINES:
            break
        lines += len(piece.u)
        k = piece.photograph
        frame = _drawn(project, piece, stage, scale, margin_of(seen.width))
        sensor = project.sensor.model_copy(update={"defocus": False})  # it is in the line's drawn width
        image = develop(frame, project.scene, sensor, seed=seed * len(seen.pieces) + k, threads=stage.threads)
        taken = Photograph(image.pixels, "", stage.lossy[k])
        measured = extract_photograph(stage.paths[k], replace(stage.look, kept={stage.paths[k]: taken}), stage.threads)
        light = light_of(image.pixels, sensor, numbers_of(project, stage.laser).channel)
        stretch = stretch_of(light, measured.line, seen.half, seen.limit)
        both = np.isin(stretch.row, piece.stretch.row)
        stretch = stretch.of(both)
        of = piece.of(np.searchsorted(piece.stretch.row, stretch.row))
        pieces.append(replace(of, stretch=stretch, u=measured.line.u[stretch.row, 0]))
    return replace(seen, pieces=pieces)


def _drawn(project: Project, piece: Piece, stage: Stage, scale: float, margin: int) -> Frame:
    """The light of a piece of line, and of what is beside it."""
    scene, sensor, camera = project.scene, project.sensor, project.scene.camera
    axis: Axis = stage.look.settings.axis
    numbers = numbers_of(project, stage.laser)
    joule = joules_per_radiance(camera, sensor)
    illumination = np.asarray(relative_illumination(camera, stage.threads), np.float64)
    response = laser_response(sensor, scene.lasers[stage.laser].wavelength_nm).ravel()
    if numbers.channel != "mono":
        letter = "RGB"[COLOURS.index(numbers.channel)]
        response = response[[one == letter for one in sensor.pattern]]
    per_dn = 1.0 / (numbers.gain * joule * float(response[0]))
    upright = illumination if axis == "rows" else illumination.T
    light: Float = np.zeros(upright.shape)
    # what a slant adds by the height of a pixel is no sheet
    steps = (piece.tilt - 1.0) / 12.0
    variance = np.maximum(scale**2 * (piece.sheet**2 - steps), 1e-4) + steps + piece.known
    for rows, u, bright, sigma in _runs(piece, np.sqrt(variance), margin):
        reach = int(np.ceil(REACH * float(sigma.max()))) + 1
        columns = np.rint(u).astype(np.intp)[:, None] + np.arange(-reach, reach + 1)
        inside = (columns >= 0) & (columns < light.shape[1]) & (rows < light.shape[0])[:, None]
        share = pixel_gaussian(columns - u[:, None], sigma[:, None]) * bright[:, None]
        row = np.broadcast_to(rows[:, None], columns.shape)
        # two runs that step overlap where both were made longer
        there = row[inside], columns[inside]
        light[there] = np.maximum(light[there], share[inside] * per_dn)
    light = light / np.maximum(upright, 1e-6)
    image: Float32 = np.ascontiguousarray(light if axis == "rows" else light.T, np.float32)
    direct = tuple(image if i == stage.laser else np.zeros_like(image) for i in range(len(scene.lasers)))
    ambient = _ambient(sensor, numbers, stage.ground[piece.photograph], joule, illumination)
    return Frame(0, direct, ambient=ambient, curves=(), truth=None)


def _runs(piece: Piece, sigma: Float, margin: int) -> list[tuple[NDArray[np.intp], Float, Float, Float]]:
    """Of each unbroken run of the line: scan lines, course px, light DN and sigma px, made smooth.

    margin: scan lines by which the ends, which were left out, are put on again.
    """
    rows, u, values = piece.stretch.row, piece.u, piece.stretch.values
    beside = np.median(values[:, [0, 1, -2, -1]], axis=1)
    light = (values - beside[:, None]).sum(axis=1)
    found = []
    for some in runs(u, rows):
        every = np.arange(rows[some[0]], rows[some[-1]] + 1)
        course, bright, wide = (np.interp(every, rows[some], one[some]) for one in (u, light, sigma))
        if len(every) > STRAIGHT:
            course = savgol_filter(course, STRAIGHT, 2)
        bright = uniform_filter1d(bright, min(ALONG, len(every)), mode="nearest")
        longer = np.arange(every[0] - margin, every[-1] + margin + 1)
        course = (
            np.pad(course, margin, mode="reflect", reflect_type="odd")
            if len(course) > margin
            else np.pad(course, margin, mode="edge")
        )
        bright, wide = (np.pad(one, margin, mode="edge") for one in (np.maximum(bright, 0.0), wide))
        inside = longer >= 0
        found.append((longer[inside], course[inside], bright[inside], wide[inside]))
    return found


def _ambient(sensor: Sensor, numbers: Numbers, ground: Float, joule: float, illumination: Float) -> Float32:
    """(h, w, 3) radiance that gives each channel's ground."""
    bands = band_response(sensor).reshape(4, 3)
    dark = sensor.dark_current * sensor.exposure_time
    radiance: Float
    if len(ground) == 1:
        usual = max(float(ground[0] - numbers.black) / numbers.gain - dark, 0.0)
        radiance = np.full(3, usual / max(joule * float(bands[0].sum()), 1e-300))
    else:
        assert sensor.processing is not None
        place = ["RGB".index(one) for one in sensor.pattern]
        balance = np.array(sensor.processing.white_balance)[place]
        electrons = ground[place] * electrons_of(sensor) / (255.0 * balance) - dark
        radiance = np.asarray(np.linalg.lstsq(joule * bands, np.maximum(electrons, 0.0), rcond=None)[0], np.float64)
    return np.asarray(np.maximum(radiance, 0.0) / np.maximum(illumination, 1e-6)[..., None], np.float32)


def ground_of(image: NDArray[Any], piece: Piece, sensor: Sensor, axis: Axis) -> Float:
    """(c,) DN, linear in light, of each channel beside the line, median."""
    half = piece.stretch.values.shape[1] // 2
    middle = np.rint(piece.u).astype(np.intp)[:, None]
    columns = middle + np.array([-half, -half + 1, half - 1, half])
    row = piece.stretch.row[:, None]
    where = (row, columns) if axis == "rows" else (columns, row)
    if image.ndim == 2:
        return np.array([float(np.median(light_of(image, sensor, "mono")[where]))])
    return np.array([float(np.median(light_of(image, sensor, one)[where])) for one in COLOURS])
