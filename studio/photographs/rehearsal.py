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
from render.sensor.develop import Image, develop
from render.sensor.response import band_response, joules_per_radiance, laser_response, relative_illumination
from render.sensor.sensor import Sensor
from studio.photographs.evidence import COLOURS
from studio.photographs.image_files import Photograph
from studio.photographs.line_profile import BESIDE, core_reach, stretch_of
from studio.photographs.photograph_set import Look
from studio.photographs.photographs import extract_photograph
from studio.photographs.twin_light import FULL, Numbers, electrons_of, light_of, numbers_of
from studio.photographs.twin_profile import pixel_gaussian
from studio.photographs.twin_seen import Piece, Seen, light_above, margin_of, runs
from studio.project.project import Project

LINES = 2048
"""Scan lines that are enough for one rehearsal."""
ALONG, STRAIGHT, STRAIGHT_PROCESSED = 33, 11, 33
"""Scan lines over which the line's light and its course are taken to be smooth: of photographs whose denoising makes
neighbours err alike more, as what is left of their errors would be rehearsed as the line's course."""
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
    """Of each (n, 2, c) DN beside its scan lines, left and right, of each channel, linear in light."""
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
        sensor = project.sensor.model_copy(update={"defocus": False})  # it is in the line's drawn width
        image = _developed(project, sensor, piece, stage, scale, seen.width, seed * len(seen.pieces) + k)
        taken = Photograph(image.pixels, "", stage.lossy[k])
        measured = extract_photograph(stage.paths[k], replace(stage.look, kept={stage.paths[k]: taken}), stage.threads)
        light = light_of(image.pixels, sensor, numbers_of(project, stage.laser).channel)
        stretch = stretch_of(light, measured.line, seen.half, seen.limit)
        both = np.isin(stretch.row, piece.stretch.row)
        stretch = stretch.of(both)
        of = piece.of(np.searchsorted(piece.stretch.row, stretch.row))
        pieces.append(replace(of, stretch=stretch, u=measured.line.u[stretch.row, 0]))
    return replace(seen, pieces=pieces)


def _developed(
    project: Project, sensor: Sensor, piece: Piece, stage: Stage, scale: float, width: float, seed: int
) -> Image:
    """The photograph of a piece of line so wide, as bright as the one it was found in: a second one, by the first.

    What a halo puts on the ground, and what tone curve, denoising and sharpening do to a mean of noisy light, some
    percent, is in that one already. Of numbers of 8 bits the noise that rounding leaves hangs on where between two of
    them the ground is.
    """

    def taken(ground: Float, brighter: float) -> Image:
        frame = _drawn(project, piece, stage, scale, margin_of(width), ground, brighter)
        return develop(frame, project.scene, sensor, seed=seed, threads=stage.threads)

    ground, axis = stage.ground[piece.photograph], stage.look.settings.axis
    image = taken(ground, 1.0)
    found = ground_of(image.pixels, piece, sensor, axis, width)
    light = light_of(image.pixels, sensor, numbers_of(project, stage.laser).channel)
    values = (light if axis == "rows" else light.T)[piece.stretch.row[:, None], piece.columns]
    brighter = float(np.median(light_above(piece.stretch.values)) / np.median(light_above(values)))
    return taken(np.maximum(2.0 * ground - found, 0.0), brighter)


def _drawn(
    project: Project, piece: Piece, stage: Stage, scale: float, margin: int, ground: Float, brighter: float
) -> Frame:
    """The light of a piece of line, times `brighter`, and of what is beside it: ground (n, 2, c) DN."""
    scene, sensor, camera = project.scene, project.sensor, project.scene.camera
    axis: Axis = stage.look.settings.axis
    numbers = numbers_of(project, stage.laser)
    joule = joules_per_radiance(camera, sensor)
    illumination = np.asarray(relative_illumination(camera, stage.threads), np.float64)
    response = laser_response(sensor, scene.lasers[stage.laser].wavelength_nm).ravel()
    if numbers.channel != "mono":
        letter = "RGB"[COLOURS.index(numbers.channel)]
        response = response[[one == letter for one in sensor.pattern]]
    per_dn = brighter / (numbers.gain * joule * float(response[0]))
    upright = illumination if axis == "rows" else illumination.T
    light: Float = np.zeros(upright.shape)
    # what a slant adds by the height of a pixel is no sheet
    steps = (piece.tilt - 1.0) / 12.0
    variance = np.maximum(scale**2 * (piece.sheet**2 - steps), 1e-4) + steps + piece.known
    for rows, u, bright, sigma in _runs(
        piece, np.sqrt(variance), margin, STRAIGHT if sensor.processing is None else STRAIGHT_PROCESSED
    ):
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
    radiance = _radiance(sensor, numbers, ground, joule)
    between = _between(radiance, piece, upright.shape)
    turned = between if axis == "rows" else between.swapaxes(0, 1)
    ambient: Float32 = np.ascontiguousarray(turned / np.maximum(illumination, 1e-6)[..., None], np.float32)
    return Frame(0, direct, ambient=ambient, curves=(), truth=None)


def _runs(piece: Piece, sigma: Float, margin: int, straight: int) -> list[tuple[NDArray[np.intp], Float, Float, Float]]:
    """Of each unbroken run of the line: scan lines, course px, light DN and sigma px, made smooth.

    margin: scan lines by which the ends, which were left out, are put on again. straight: over which it is smooth.
    """
    rows, u, values = piece.stretch.row, piece.u, piece.stretch.values
    light = light_above(values)
    found = []
    for some in runs(u, rows):
        every = np.arange(rows[some[0]], rows[some[-1]] + 1)
        course, bright, wide = (np.interp(every, rows[some], one[some]) for one in (u, light, sigma))
        if len(every) > straight:
            course = savgol_filter(course, straight, 2)
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


def _radiance(sensor: Sensor, numbers: Numbers, ground: Float, joule: float) -> Float:
    """(n, 2, 3) radiance of the bands that gives each channel's ground (n, 2, c)."""
    bands = band_response(sensor).reshape(4, 3)
    dark = sensor.dark_current * sensor.exposure_time
    if ground.shape[2] == 1:
        usual = np.maximum((ground - numbers.black) / numbers.gain - dark, 0.0)
        return np.asarray(np.repeat(usual / max(joule * float(bands[0].sum()), 1e-300), 3, axis=2))
    assert sensor.processing is not None
    place = ["RGB".index(one) for one in sensor.pattern]
    balance = np.array(sensor.processing.white_balance)[place]
    electrons = np.maximum(ground[..., place] * electrons_of(sensor) / (FULL * balance) - dark, 0.0)
    found = np.linalg.lstsq(joule * bands, electrons.reshape(-1, 4).T, rcond=None)[0]
    return np.asarray(np.maximum(found.T.reshape(*ground.shape[:2], 3), 0.0), np.float64)


def _between(beside: Float, piece: Piece, shape: tuple[int, ...]) -> Float:
    """Of something left and right of a line (n, 2, c) what is between, straight, for the whole image (h, w, c)."""
    half, rows = piece.stretch.values.shape[1] // 2, np.arange(shape[0])
    course = np.interp(rows, piece.stretch.row, piece.u)[:, None]
    right = np.clip((np.arange(shape[1]) - course + half) / (2.0 * half), 0.0, 1.0)[..., None]
    ends = [
        np.stack([np.interp(rows, piece.stretch.row, one) for one in side.T], axis=1) for side in beside.swapaxes(0, 1)
    ]
    left_end, right_end = (one[:, None, :] for one in ends)
    return np.asarray((1.0 - right) * left_end + right * right_end)


def ground_of(image: NDArray[Any], piece: Piece, sensor: Sensor, axis: Axis, width: float) -> Float:
    """(n, 2, c) DN, linear in light, of each channel left and right of a line of a sigma, px, smooth along it.

    A mean: a median of whole numbers is off by up to half a step. Of the pixels whose noise is told (`near`).
    """
    half = piece.stretch.values.shape[1] // 2
    middle = np.rint(piece.u).astype(np.intp)[:, None]
    apart = min(core_reach(width), half - BESIDE) + np.arange(1, BESIDE + 1)
    row = piece.stretch.row[:, None]
    channels = ("mono",) if image.ndim == 2 else COLOURS
    light = [light_of(image, sensor, one) for one in channels]
    sides = []
    for columns in (middle - apart, middle + apart):
        where = (row, columns) if axis == "rows" else (columns, row)
        sides.append(np.stack([one[where].mean(axis=1) for one in light], axis=1))
    beside = np.stack(sides, axis=1)
    return np.asarray(uniform_filter1d(beside, min(ALONG, len(beside)), axis=0, mode="nearest"))
