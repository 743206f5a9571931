"""A laser's light that met two or more surfaces: paths from the laser and from the camera, joined wherever they can be.

Every pass (`render.laser_indirect.bdpt_pass`) draws light paths, stratified along the fan, and camera paths where the
passes before saw light. The passes differ only in their random numbers, so their spread is an honest error. What no
joint can make, light through clear glass on both sides, is found by merging (`render.laser_indirect.photon_merging`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from render.base.errors import Cancelled
from render.base.threads import Cancel, Progress, map_chunks, thread_count
from render.camera.camera import Camera
from render.laser.laser import LineLaser
from render.laser_indirect.accumulator import MOST_CAMERA_PASS, MOST_PASS, Gathered, gather_takes
from render.laser_indirect.bdpt_pass import KINDS, LightPass
from render.laser_indirect.connection_buffer import BLOCK, Take
from render.laser_indirect.guiding import (
    BINS,
    NOWHERE,
    Guide,
    clear_pixels,
    first_guide,
    learn,
    look_behind,
    no_guide,
    pixels_looked_at,
    share_samples,
)
from render.laser_indirect.path_vertex import BENT, SUNK, UNJOINED
from render.laser_indirect.photon_emission import PARTS, Fan, aimed_fan, even_fan, fan_span
from render.world.world import World

Float = NDArray[np.float64]
Float32 = NDArray[np.float32]
Bool = NDArray[np.bool_]

LEAST_PASS = 1 << 12
"""Paths from the laser in a first pass, and half of those from the camera; a large image is worth longer ones."""
LOOK_PATHS = 1 << 11
PILOT_PATHS = 1 << 13
WAVE = 4
"""Passes at a time, whatever the number of threads."""
ALL_KINDS = BENT | SUNK | UNJOINED


@dataclass(frozen=True)
class IndirectImage:
    """Radiance of one laser's indirect light, and how well it is known."""

    radiance: Float32
    """(h, w) W/(m^2 sr)."""
    error: float
    """Estimated relative RMS error."""
    paths: int
    """From the laser."""
    dropped: int = 0
    """Contributions that were no number, infinite or negative."""
    clamped: int = 0
    """Pixels of passes that the clamp has cut."""
    cut: float = 0.0
    """Radiance that the clamp took away, mean over the image."""


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
    world: World, camera: Camera, laser: LineLaser, T_world_camera: Float, T_world_laser: Float, **options: Any
) -> IndirectImage:
    """The last of `indirect_images`, whose options it takes. Raises Cancelled."""
    *_, last = indirect_images(world, camera, laser, T_world_camera, T_world_laser, **options)
    return last


def indirect_images(
    world: World,
    camera: Camera,
    laser: LineLaser,
    T_world_camera: Float,
    T_world_laser: Float,
    *,
    target: float = 0.1,
    most_paths: int = 1 << 23,
    kinds: int = ALL_KINDS,
    clamp: float | None = None,
    seed: int = 0,
    threads: int | None = None,
    cancelled: Cancel | None = None,
    progress: Progress | None = None,
    enough: Cancel | None = None,
    keeps: Cancel | None = None,
    before: Gathered | None = None,
    keep: Callable[[Gathered], None] | None = None,
) -> Iterator[IndirectImage]:
    """Radiance of one laser's light after two or more surfaces, to a target relative RMS error. Raises Cancelled.

    An image at every doubling of the paths, and the final one. The error is that of the whole image: sqrt(sum of
    variances / sum of squares); `most_paths`, or `enough` (the time is over), ends it in any case. kinds: of light,
    besides plain interreflection (`render.laser_indirect.path_vertex`). clamp: most radiance of one pass in one pixel,
    W/(m^2 sr); biased. before: go on from there, to the same image bit for bit as without interruption. keep: told of
    what to go on from after every wave of passes; it stays whole when this raises Cancelled, where keeps() says so
    after one more image.
    """
    low, high, reach = fan_span(world, laser, T_world_laser)
    shape = (camera.height, camera.width)
    if high <= low:
        yield IndirectImage(np.zeros(shape, np.float32), 0.0, 0)
        return
    task = LightPass.of(world, camera, laser, T_world_camera, T_world_laser, reach, seed, kinds)
    takes = [empty_take(camera.width * camera.height) for _ in range(WAVE)]

    def wave(first: int, paths: int, fan: Fan, samples: Float, guide: Guide, hints: Bool | None = None) -> None:
        looked_at = pixels_looked_at(samples)

        def work(start: int, stop: int) -> None:
            for number in range(start, stop):
                task.run(first + number, paths, fan, samples, looked_at, guide, takes[number], cancelled, hints)

        map_chunks(work, WAVE, 1, min(WAVE, thread_count(threads)), cancelled)

    if before is None:
        # two looks only say where laser and camera should look: the first, by light, where it arrives at all (what is
        # behind glass only the camera finds), the second, from there, which light matters
        fan = even_fan(low, high)
        clear = clear_pixels(world, task.surface, camera, T_world_camera) if task.clear else NOWHERE
        hints = clear if task.clear else None
        wave(0, LOOK_PATHS, fan, first_samples(clear, camera, 8 * LOOK_PATHS), no_guide(camera), hints)
        before = first_knowledge(takes, fan, camera, kinds, clear)
        learnt = learn_with(takes, before)
        wave(WAVE, LOOK_PATHS, before.fan, before.samples, before.guide, hints)
        second_knowledge(before, takes, learnt, camera)
    so_far = before
    learnt = learn_with(takes, so_far)

    def image() -> IndirectImage:
        counts = so_far.paths, round(so_far.dropped), round(so_far.clamped)
        cut = so_far.cut / so_far.weight / so_far.total.size
        return IndirectImage(so_far.radiance(shape), so_far.error, *counts, cut)

    def unfinished() -> bool:
        return so_far.error > target and so_far.paths < most_paths

    shown = so_far.paths
    while unfinished():
        try:
            first = WAVE * (2 + so_far.waves)
            wave(first, so_far.next_paths, so_far.fan, so_far.samples, so_far.guide)
        except Cancelled:
            if so_far.passes and keeps is not None and keeps():
                yield image()
            raise
        so_far.add(takes, learnt, clamp, threads)
        if keep is not None:
            keep(so_far)
        if progress is not None:
            # the error falls with the root of the paths, at least
            done = max((target / so_far.error) ** 2, so_far.paths / most_paths) if so_far.error > 0.0 else 1.0
            progress(min(0.99, done))
        if enough is not None and enough():
            break
        if so_far.paths >= 2 * shown and unfinished():
            shown = so_far.paths
            yield image()
    yield image()


def first_knowledge(takes: list[Take], fan: Fan, camera: Camera, kinds: int, clear: Bool) -> Gathered:
    """Nothing gathered yet, but where a first look (cleared) says that light is to be found."""
    pixels = camera.width * camera.height
    fan = aimed_fan(fan, np.sum([take.found for take in takes], axis=0))
    share, helped = looked(takes)
    samples = share_samples(helped, camera.width, LOOK_PATHS * share, arrived(helped), 1.0)
    look_behind(samples, clear, LOOK_PATHS)
    guide = first_guide(samples, camera)
    knowledge = np.zeros((len(guide.cumulative), BINS))
    size = min(max(1 << (pixels >> 8).bit_length() - 1, LEAST_PASS), MOST_PASS)
    sums = np.zeros(pixels), np.zeros(pixels, np.float32)
    return Gathered(kinds, fan, size, 1, share, clear, samples, guide, knowledge, *sums)


def second_knowledge(first: Gathered, takes: list[Take], learnt: Float, camera: Camera) -> None:
    """Add what a second look (cleared) has found, and set the size of the passes to come."""
    first.guide = learn(first.guide, learnt, first.knowledge)
    first.share, helped = looked(takes)
    if len(first.clear):
        # where something may be behind glass is not forgotten when the first passes find nothing there
        first.helped[:] = helped
    # a wide glow is best known by passes with a path for each of its pixels
    first.most = max((MOST_CAMERA_PASS // 2 if first.share > 0.5 else MOST_PASS) // first.size, 1)
    share_samples(helped, camera.width, first.wanted, first.samples, float(WAVE))
    look_behind(first.samples, first.clear, first.wanted)


def arrived(helped: Float32) -> Float:
    """(pixels,) roughly how many light paths of a first look came to each."""
    return helped.astype(np.float64) * (WAVE * LOOK_PATHS / max(float(helped.sum()), 1e-300))


def looked(takes: list[Take]) -> tuple[float, Float32]:
    """What camera paths could help with: its share of the light, and (pixels,) of takes, which are cleared."""
    helped = np.zeros_like(takes[0].helped)
    light, by_camera, *_ = gather_takes(takes, np.zeros(len(helped)), helped)
    for take in takes:
        take.dropped[:] = 0.0
    return min(by_camera / light, 1.0) if light > 0.0 else 1.0, helped


def learn_with(takes: list[Take], so_far: Gathered) -> Float:
    """Give each take (in place) its part of the array that is returned, to learn in."""
    learnt = np.zeros((WAVE, *so_far.knowledge.shape))
    takes[:] = [take._replace(learnt=learnt[i]) for i, take in enumerate(takes)]
    return learnt


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
    clear = clear_pixels(world, task.surface, camera, T_world_camera) if task.clear else NOWHERE
    fan, guide, sums = even_fan(low, high), no_guide(camera), []
    take = empty_take(camera.width * camera.height)
    samples = first_samples(clear, camera, PILOT_PATHS)
    if task.clear:
        # what is seen through glass may be small, and is worth a look of its own
        task.run(passes, LOOK_PATHS, fan, samples, pixels_looked_at(samples), guide, take, cancelled, clear)
        _, helped = looked([take])
        samples = share_samples(helped, camera.width, PILOT_PATHS, arrived(helped), 1.0)
        look_behind(samples, clear, PILOT_PATHS)
    looked_at = pixels_looked_at(samples)
    for number in range(passes):
        take = empty_take(camera.width * camera.height)
        task.run(number, PILOT_PATHS, fan, samples, looked_at, guide, take, cancelled)
        plain, bent, sunk, both, unjoined = take.sums
        sums.append((plain, bent, unjoined, sunk + both))
    mean, error = np.mean(sums, axis=0), np.std(sums, axis=0, ddof=1) / math.sqrt(passes)
    return Shares(*((float(m), float(e)) for m, e in zip(mean, error, strict=True)))


def empty_take(pixels: int) -> Take:
    """Nothing yet, and no guide to learn for; of the images the system finds room only where light arrives."""
    zeros = np.zeros(KINDS), np.zeros(PARTS), np.zeros((0, BINS))
    touched = np.zeros(-(-pixels // BLOCK), np.bool_)
    return Take(np.zeros(pixels), np.zeros(pixels, np.float32), *zeros, np.zeros(1), touched)


def first_samples(clear: Bool, camera: Camera, count: int) -> Float:
    """(pixels,) camera paths of a first look: at most `count`, on what the camera sees of mirrors and clear glass."""
    samples = np.zeros(camera.width * camera.height)
    if len(clear):
        samples[clear] = min(1.0, count / max(int(clear.sum()), 1))
    return samples
