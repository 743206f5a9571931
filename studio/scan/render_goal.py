"""Where the errors of a render matter, by the project's own sensor and line extraction: what the goal in depth asks.

The light so far is developed without noise and measured. What moves a row's position (`analysis.line.influence`) is
weighed by the goal's share of that row's sigma; elsewhere what counts is by how much light a peak would appear there,
or the line no longer be the strongest.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from analysis.error import MATCH_SIGMAS
from analysis.line.error_weights import Weights
from analysis.line.methods.narrow_line import COARSE
from analysis.line.result import Line
from render.base.arrays import Bool, Float32
from render.base.threads import map_chunks, rows_of
from render.frame import Frame, LaserCurve
from render.importance import CELL, Importance
from render.sampling.random import wrapped
from render.scene.settings import DepthGoal
from render.sensor.develop import Image, expected_electrons
from render.sensor.response import band_response, joules_per_radiance, laser_response, relative_illumination
from studio.project.project import Project
from studio.scan.line_extraction import extract_line, noise_model

DECISION = 3.0
"""Times the goal, of a pixel's own noise: ambient light that is known so well on the pixels of a narrow line leaves it
to the sensor which of two widths its fit finds. The influence function knows of one answer alone."""
DIRECT = 0.1
"""Share of the goal's variance that direct light has. Its error falls with the power 1.5 of the rays, that of all other
light with the power 0.5, and it takes a hundredth of the time: a tenth costs it about twice the rays of a third."""
PAIRS, JUMP = 2, 3.0
"""Pairs of images with opposite noise, and times the goal by which they must not differ from a straight line."""
ROWS, PIXELS = 64, 1 << 17
"""Scan lines at a time, at least, and pixels, which a processor's cache holds; an even number of lines."""


def goal_of(project: Project, threads: int | None = None) -> Callable[[Frame], Importance] | None:
    """What a render of the project asks (`Run.goal`); None: its goal is the image."""
    goal = project.render.goal
    if goal is None:
        return None
    return lambda frame: importance(project, goal, frame, threads)


def shares(goal: DepthGoal, *, reflected: bool, ambient: bool) -> tuple[float, float]:
    """Of a row's sigma: what direct light may add, and each other light that there is.

    The errors of the lights are independent, so that it is their variances that add up to the goal's.
    """
    others = int(reflected) + int(ambient)
    if not others:
        return goal.depth, goal.depth
    return goal.depth * math.sqrt(DIRECT), goal.depth * math.sqrt((1.0 - DIRECT) / others)


def importance(project: Project, goal: DepthGoal, frame: Frame, threads: int | None = None) -> Importance:
    """Of a frame as far as it is known. InputError: as `develop` and `extract`."""
    project = _as_far_as_known(project, frame)
    scene, sensor = project.scene, project.sensor
    rows = project.extraction.axis == "rows"
    illumination = relative_illumination(scene.camera, threads)
    joule = joules_per_radiance(scene.camera, sensor)
    bands = joule * band_response(sensor).sum(axis=2)
    reflected = any(step.computed is not False for step in frame.plan.of("indirect"))
    direct, allowed = shares(goal, reflected=reflected, ambient=frame.ambient is not None)
    lasers, peaks, moves = [], [], []
    ambient: Float32 = np.zeros(illumination.shape, np.float32)
    for i, laser in enumerate(scene.lasers):
        peak = np.empty_like(ambient)
        # zero but about the line: the system finds memory only for what is written, which `zeros_like` is
        weight, move = (np.zeros(ambient.shape, np.float32) for _ in range(2))
        response = joule * laser_response(sensor, laser.wavelength_nm)
        if rows:
            out = Weights(weight, peak, ambient, move, illumination, response, bands)
        else:
            out = Weights(weight.T, peak.T, ambient.T, move.T, illumination.T, response.T, bands.T)
        _weigh(project, frame, i, (allowed, DECISION * goal.depth), out, threads)
        lasers.append(weight)
        peaks.append(peak)
        moves.append(move)
    axis = project.extraction.axis
    return Importance(tuple(lasers), ambient, axis, tuple(peaks), allowed, tuple(moves), direct)


def _as_far_as_known(project: Project, frame: Frame) -> Project:
    """A blur that is left out makes the line sharper, an exposure that is left out brighter: both ask for more.

    What counts is the noise that the sensor gives each scan line, before neighbours are asked.
    """
    alone = project.extraction.model_copy(update={"smooth_along": False})
    project = project.model_copy(update={"extraction": alone})
    if frame.truth is not None and project.extraction.exposures == 1:
        return project
    sensor = project.sensor.model_copy(update={"defocus": False})
    extraction = project.extraction.model_copy(update={"exposures": 1})
    return project.model_copy(update={"sensor": sensor, "extraction": extraction})


def undecided_rows(project: Project, goal: DepthGoal, frame: Frame, laser: int, threads: int | None = None) -> int:
    """Scan lines where noise as small as the goal allows decides between two answers of the line extraction.

    To every pixel goes noise of DECISION goals of its own, of either sign, and its opposite: what moves with the light
    moves as far one way as the other, what jumps does not. The sensor's noise is a good deal larger; but of an image
    without noise, or with the same, another render may find another answer. InputError: as `develop` and `extract`.
    """
    project = _as_far_as_known(project, frame)
    electrons = _electrons(project, frame, laser, threads)
    image = _expected_image(project, electrons, threads)
    line = extract_line(project, image, laser, threads)
    floor = noise_model(image, project, laser).floor
    found = np.zeros(len(line.valid), np.bool_)
    images: tuple[Any, Any] = np.empty_like(electrons), np.empty_like(electrons)
    for pair in range(PAIRS):
        noise = floor, DECISION * goal.depth, wrapped(project.seed + PAIRS * laser + pair)
        _set_opposite(image, electrons, noise, images, threads)
        one, other = (extract_line(project, replace(image, pixels=pixels), laser, threads) for pixels in images)
        bent = np.abs(one.u + other.u - 2.0 * line.u) > JUMP * goal.depth * line.sigma_u
        changed = (one.valid != line.valid) | (other.valid != line.valid)
        found |= np.any(changed | (line.valid & bent), axis=1)
    return int(found.sum())


def _set_opposite(
    image: Image,
    electrons: Float32,
    noise: tuple[float, float, int],
    pair: tuple[Float32, Float32],
    threads: int | None,
) -> None:
    """Two images (h, w) of mean electrons (h, w), as `opposite_images` makes them; image: that without noise."""
    from render.sensor.opposite_images import opposite_images

    numbers = image.gain, image.black_level, float(image.saturation)

    def work(start: int, stop: int) -> None:
        some = slice(start, stop)
        opposite_images(electrons[some], start, noise, numbers, (pair[0][some], pair[1][some]))

    map_chunks(work, len(electrons), rows_of(electrons.shape[1], ROWS, PIXELS), threads)


def _weigh(
    project: Project, frame: Frame, laser: int, allowed: tuple[float, float], out: Weights, threads: int | None
) -> None:
    """The weights of one laser -> out; allowed: shares of a scan line's sigma, of what moves the line, and of the noise
    of each pixel that a narrow line is measured on."""
    from analysis.line.detection.rivals import rival_weights  # these take a while: not before something is rendered
    from analysis.line.influence import influence

    electrons = _electrons(project, frame, laser, threads)
    image = _expected_image(project, electrons, threads)
    noise = noise_model(image, project, laser)
    line = extract_line(project, image, laser, threads)
    settings = project.extraction
    if image.pattern is not None and settings.pattern is None:
        settings = settings.model_copy(update={"pattern": image.pattern})
    # of a selection the candidates' method is the one that measured them
    derivative = influence(image.pixels, line, settings, noise, threads, shared=True)
    del image  # as large as what is written from here on
    valid = line.valid
    # the pilots of a scan have no exact line: they ask for no less
    stray = strays(line, frame.curves[laser]) if frame.curves else np.zeros(len(valid), np.bool_)
    narrow = np.any(valid & (line.width < COARSE), axis=1)
    width = np.min(np.where(valid & np.isfinite(line.width), line.width, np.inf), axis=1)
    least = np.where(stray, width, 0.0)
    if line.axis == "columns":
        electrons, derivative = electrons.T, derivative.T
    # a whole row counts as one sum there, of which a quarter of its pixels may come near
    evenly = 1.0 / math.sqrt(max(0.25 * electrons.shape[1] / CELL, 1.0))

    told = np.min(np.where(valid & np.isfinite(line.sigma_u), line.sigma_u, np.inf), axis=1)
    told = np.where(valid.any(axis=1), np.where(np.isfinite(told), told, 0.0), np.inf)
    numbers = float(noise.floor), *allowed, evenly

    def work(start: int, stop: int) -> None:
        some = slice(start, stop)
        light, moves = np.ascontiguousarray(electrons[some]), np.ascontiguousarray(derivative[some])
        risen = rival_weights(light, (line.u[some], line.width[some], valid[some]), noise, settings)
        out.put(some, (light, moves, risen), (told[some], least[some], narrow[some]), numbers)

    map_chunks(work, len(electrons), rows_of(electrons.shape[1], ROWS, PIXELS), threads)


def strays(line: Line, curve: LaserCurve) -> Bool:
    """(lines,) where all that was measured is away from the exact line of the same laser: a reflection, a shining edge.

    Such a scan line has to stay false, which no share of its sigma decides. Its depth is off by far more than its own
    width, of which the goal's share is asked.
    """
    lit = curve.irradiance > 0.0
    index, position = curve.index[lit], curve.position[lit]
    apart = np.full(line.u.shape, np.inf)
    np.minimum.at(apart, index, np.abs(line.u[index] - position[:, None]))
    wrong = apart > np.maximum(MATCH_SIGMAS * line.width, 1.0)
    return np.asarray(line.valid.any(axis=1) & np.all(wrong | ~line.valid, axis=1))


def _electrons(project: Project, frame: Frame, laser: int, threads: int | None) -> Float32:
    """(h, w) mean electrons while one laser fires."""
    powers = [one.power if i == laser else 0.0 for i, one in enumerate(project.scene.lasers)]
    return expected_electrons(frame, project.scene, project.sensor, threads=threads, laser_power=powers)


def _expected_image(project: Project, electrons: Float32, threads: int | None = None) -> Image:
    """The image of mean electrons (h, w), not quantised."""
    sensor = project.sensor
    top, gain = float(2**sensor.bits - 1), sensor.dn_per_electron
    saturation = min(top, math.floor(gain * sensor.full_well + sensor.black_level + 0.5))
    numbers: Any = np.empty_like(electrons)

    def work(start: int, stop: int) -> None:
        out = numbers[start:stop]
        np.multiply(electrons[start:stop], np.float32(gain), out=out)
        out += np.float32(sensor.black_level)
        np.minimum(out, np.float32(saturation), out=out)

    map_chunks(work, len(electrons), rows_of(electrons.shape[1], ROWS, PIXELS), threads)
    pattern = sensor.pattern if sensor.colour == "bayer" else None
    return Image(
        numbers, sensor.bits, gain, sensor.black_level, saturation, sensor.read_noise, pattern, sensor.exposure_time
    )
