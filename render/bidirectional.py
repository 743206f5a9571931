"""A laser's light that met two or more surfaces: paths from the laser and from the camera, joined wherever they can be.

Every pass (`render.light_pass`) draws light paths, stratified along the fan, and camera paths where the passes before
saw light. The passes differ only in their random numbers, so their spread is an honest error. What no joint can
make, light through clear glass on both sides, is found by merging (`render.merge`).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numba
import numpy as np
from numpy.typing import NDArray

from render.camera import Camera
from render.connect import Take
from render.emission import PARTS, aimed_fan, even_fan, fan_span
from render.guide import BINS, clear_pixels, first_guide, learn, no_guide, share_samples
from render.laser import LineLaser
from render.light_pass import KINDS, LightPass
from render.threads import Cancel, Progress, map_chunks, thread_count
from render.vertex import BENT, SUNK, UNJOINED
from render.world import World

Float = NDArray[np.float64]
Float32 = NDArray[np.float32]

PASS_PATHS, PASS_SAMPLES = 1 << 14, 1 << 14
"""Paths from the laser and from the camera in a pass."""
MOST_DOUBLINGS = 2
"""Of the paths from the laser, where camera paths bring nothing."""
PILOT_PATHS = 1 << 13
WAVE = 4
"""Passes at a time, whatever the number of threads."""
ALL_KINDS = BENT | SUNK | UNJOINED


@dataclass(frozen=True)
class IndirectImage:
    """(h, w) float32 radiance, W/(m^2 sr); the estimated relative RMS error; the light paths it took."""

    radiance: Float32
    error: float
    paths: int


@dataclass(frozen=True)
class Shares:
    """Radiance summed over the image, with its standard error, of each kind of indirect light."""

    plain: tuple[float, float]
    """Over two or more surfaces, none of them a mirror, clear glass or a medium."""
    bent: tuple[float, float]
    """Through clear glass or off mirrors, on one side of some joint."""
    unjoined: tuple[float, float]
    """Through clear glass or off mirrors on both sides of a single rough surface."""
    sunk: tuple[float, float]
    """Through a medium."""


def indirect_image(
    world: World,
    camera: Camera,
    laser: LineLaser,
    T_world_camera: Float,
    T_world_laser: Float,
    *,
    target: float = 0.1,
    most_paths: int = 1 << 23,
    kinds: int = ALL_KINDS,
    seed: int = 0,
    threads: int | None = None,
    cancelled: Cancel | None = None,
    progress: Progress | None = None,
    refined: Callable[[IndirectImage], bool] | None = None,
) -> IndirectImage:
    """Radiance of one laser's light after two or more surfaces, to a target relative RMS error. Raises Cancelled.

    The error is that of the whole image: sqrt(sum of variances / sum of squares). `most_paths` ends it in any case.
    kinds: of light, besides plain interreflection (`render.vertex`). refined: given the image at every doubling of the
    passes; it ends the render by returning True.
    """
    low, high, reach = fan_span(world, laser, T_world_laser)
    shape = (camera.height, camera.width)
    if high <= low:
        return IndirectImage(np.zeros(shape, np.float32), 0.0, 0)
    task = LightPass.of(world, camera, laser, T_world_camera, T_world_laser, reach, seed, kinds)
    pixels = camera.width * camera.height
    fan, paths, guide, samples = even_fan(low, high), PASS_PATHS, no_guide(camera), first_samples(task, camera)
    takes = [empty_take(pixels) for _ in range(WAVE)]

    def wave(first: int) -> None:
        def work(start: int, stop: int) -> None:
            for number in range(start, stop):
                task.run(first + number, paths, fan, samples, guide, takes[number], cancelled)

        map_chunks(work, WAVE, 1, min(WAVE, thread_count(threads)), cancelled)

    total, squares = np.zeros(pixels), np.zeros(pixels)
    # a first look only says where laser and camera should look; what is behind glass only the camera finds
    wave(0)
    for take in takes:
        gather_pass(take.image, total, squares)
    fan = aimed_fan(fan, np.sum([take.found for take in takes], axis=0))
    helped = np.zeros(pixels, np.float32)
    for take in takes:
        helped += take.helped
        take.helped[:] = 0.0
    # where camera paths have little to bring, most of the work is left to those from the laser
    share = float(helped.sum()) / max(float(total.sum()), 1e-300)
    wanted, paths = PASS_SAMPLES * share, PASS_PATHS * 2 ** round(MOST_DOUBLINGS * (1.0 - share))
    samples = share_samples(helped, camera.width, wanted)
    guide, learnt = first_guide(samples, camera, WAVE)
    takes = [take._replace(learnt=learnt[i]) for i, take in enumerate(takes)]
    knowledge = np.zeros(learnt.shape[1:])
    helped[:], total[:], squares[:] = 0.0, 0.0, 0.0
    passes, error = 0, math.inf

    def image() -> IndirectImage:
        return IndirectImage((total / passes).astype(np.float32).reshape(shape), error, passes * paths)

    while passes * paths < most_paths:
        wave(WAVE + passes)
        for take in takes:
            first, second = gather_pass(take.image, total, squares)
            helped += take.helped
            take.helped[:] = 0.0
        passes += WAVE
        variance = max(second - first / passes, 0.0) / (passes - 1) / passes
        mean_square = max(first / passes**2 - variance, 1e-300)
        error = math.sqrt(variance / mean_square) if first > 0.0 else 0.0
        if error <= target:
            break
        doubled = passes & (passes - 1) == 0
        if doubled and refined is not None and refined(image()):
            break
        if doubled:
            samples = share_samples(helped, camera.width, wanted)
        guide = learn(guide, learnt, knowledge)
        if progress is not None:
            # the error falls with the root of the passes, at least
            needed = passes * (error / target) ** 2 if math.isfinite(error) else math.inf
            progress(min(0.99, passes / min(needed, most_paths / paths)))
    return image()


def indirect_shares(
    world: World,
    camera: Camera,
    laser: LineLaser,
    T_world_camera: Float,
    T_world_laser: Float,
    *,
    passes: int = 4,
    seed: int = 0,
    cancelled: Cancel | None = None,
) -> Shares:
    """A pilot of a few short passes: what each kind of indirect light brings. Raises Cancelled."""
    low, high, reach = fan_span(world, laser, T_world_laser)
    if high <= low:
        return Shares((0.0, 0.0), (0.0, 0.0), (0.0, 0.0), (0.0, 0.0))
    task = LightPass.of(world, camera, laser, T_world_camera, T_world_laser, reach, seed, ALL_KINDS)
    fan, guide, samples, sums = even_fan(low, high), no_guide(camera), first_samples(task, camera), []
    for number in range(passes):
        take = empty_take(camera.width * camera.height)
        task.run(number, PILOT_PATHS, fan, samples, guide, take, cancelled)
        plain, bent, sunk, both, unjoined = take.sums
        sums.append((plain, bent, unjoined, sunk + both))
    mean, error = np.mean(sums, axis=0), np.std(sums, axis=0, ddof=1) / math.sqrt(passes)
    return Shares(*((float(m), float(e)) for m, e in zip(mean, error, strict=True)))


def empty_take(pixels: int) -> Take:
    """Nothing yet, and no guide to learn for."""
    zeros = np.zeros(KINDS), np.zeros(PARTS), np.zeros((0, BINS))
    return Take(np.zeros(pixels), np.zeros(pixels, np.float32), *zeros)


def first_samples(task: LightPass, camera: Camera) -> Float:
    """(pixels,) camera paths of the first look: about a pass's, on what the camera sees of mirrors and clear glass."""
    if not task.clear:
        return np.zeros(camera.width * camera.height)
    samples = clear_pixels(task.world, task.surface, camera, task.view.T_world_camera)
    return samples * min(1.0, 2 * PASS_SAMPLES / max(float(samples.sum()), 1.0))


@numba.njit(nogil=True, cache=True)
def gather_pass(image: Float, total: Float, squares: Float) -> tuple[float, float]:
    """Fold a pass into the running sums and clear it; returns the sums of total^2 and of squares."""
    first = second = 0.0
    for j in range(image.shape[0]):
        value = image[j]
        if value != 0.0:
            total[j] += value
            squares[j] += value * value
            image[j] = 0.0
        first += total[j] * total[j]
        second += squares[j]
    return first, second
