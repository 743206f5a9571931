"""A laser's light that met two or more surfaces, by guided bidirectional path tracing.

Every pass (`render.laser_indirect.bdpt_pass`) draws light paths, stratified along the fan, and camera paths where the
passes before saw light. The passes of a wave differ only in their random numbers, so their spread estimates the error.
What no connection can make, light through clear glass on both sides, is found by walks
(`render.laser_indirect.manifold_walk`) where the camera sees it over plane mirrors and faces of glass, and by merging
(`render.laser_indirect.photon_merging`) where it does not. The equations are in `render/README.md`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from render.base.arrays import Bool, Float, Float32
from render.base.errors import Cancelled
from render.base.nonzero import nonzero_places
from render.base.threads import Cancel, map_chunks, thread_count
from render.camera.camera import Camera
from render.importance import Importance
from render.laser.laser import LineLaser
from render.laser_indirect.accumulator import MOST_CAMERA_PASS, MOST_PASS, PASSES_A_WAVE, Accumulator, sum_looks
from render.laser_indirect.bdpt_pass import KINDS, BdptPass
from render.laser_indirect.clear_light import NO_LIGHT, ClearLight, clear_light
from render.laser_indirect.connection_buffer import BLOCK, PassBuffer
from render.laser_indirect.guiding import (
    BINS,
    NO_PIXELS,
    active_pixels,
    allocate_camera_paths,
    find_specular_pixels,
    first_guide,
    no_guide,
    reserve_for_specular,
    update_guide,
)
from render.laser_indirect.lesson import ReflectedLesson
from render.laser_indirect.line_goal import Weigh
from render.laser_indirect.line_paths import alike_on_a_line
from render.laser_indirect.lone_light import spread_lone
from render.laser_indirect.path_vertex import ALL_KINDS
from render.laser_indirect.photon_emission import FAN_BINS, FanDistribution, guided_fan, uniform_fan, visible_fan_range
from render.laser_indirect.sampling import NO_KEYS, Sampling
from render.run import Run
from render.world.placed import PlacedLaser
from render.world.world import World

LEAST_PASS, LINE_PASS = 1 << 11, 1 << 9
"""Light paths in a pass of the first wave: at least, more in a large image; and half of its camera paths. Where the
line is the goal, whose needs do not grow with the image."""
LOOK_PATHS, LINE_LOOK = 1 << 10, 1 << 9
"""Light paths in a pass of a first look, which only guides; where the line is the goal. Chosen, not tuned."""
LOOK_SIZE = 0.05
"""Beside a pass of the first wave, what one of a look weighs in how many camera paths each line needs. It is guided by
little, and one bright path of it would claim paths for its line until a hundred times as many had outvoted it."""
LOOKS, TAUGHT = 3, 1 << 16
"""First looks at most, before whose passes those of the waves are not numbered; and waves at most of the frame that
teaches, whose random numbers those that it teaches must not have again: they would be sampled by what they gave."""


@dataclass(frozen=True)
class IndirectImage:
    """Radiance of one laser's indirect light, and how well it is known."""

    radiance: Float32
    """(h, w) W/(m^2 sr)."""
    error: float
    """Estimated relative RMS error."""
    paths: int
    """From the laser."""
    invalid: int = 0
    """Contributions that were NaN, infinite or negative, and were dropped."""
    clamped: int = 0
    """Pixels of passes that the clamp lowered."""
    clamped_radiance: float = 0.0
    """Radiance that the clamp took away, mean over the image."""
    line_deviation: float = math.inf
    """Estimated deviation of the measured line over the allowed one; infinite: not known."""
    out_of_reach: bool = False
    """The line's goal would have taken far more paths than that of the image, or than are allowed."""
    lines: int | None = None
    """Scan lines with a line; None: no error of theirs is asked for."""
    unknown: int | None = None
    """Those whose own estimated deviation is above the allowed one."""
    spread: float | None = None
    """Share of the light that was spread, as single paths would have been peaks; None: no line is the goal."""


@dataclass(frozen=True)
class Aim:
    """Where errors of one laser's light matter; its light ends where they are small enough."""

    laser: int
    importance: Importance
    """By the other light so far."""
    weigh: Weigh
    """By its own light as well."""


def indirect_image(
    world: World, camera: Camera, laser: LineLaser, T_world_camera: Float, T_world_laser: Float, **options: Any
) -> IndirectImage:
    """The last of `indirect_images`, whose options it takes. Raises Cancelled."""
    *_, last = indirect_images(PlacedLaser(world, camera, laser, T_world_camera, T_world_laser), **options)
    return last


def indirect_images(
    placed: PlacedLaser,
    *,
    target: float = 0.1,
    most_paths: int = 1 << 23,
    kinds: int = ALL_KINDS,
    clamp: float | None = None,
    left: int = 1,
    aim: Aim | None = None,
    run: Run = Run(),
) -> Iterator[IndirectImage]:
    """Radiance of one laser's light after two or more surfaces, to a target relative RMS error. Raises Cancelled.

    An image at every doubling of the paths, where somebody watches, and the final one. The error is that of the whole
    image: sqrt(sum of variances / sum of squares); with an aim it is enough that the measured line is known.
    `most_paths`, or the end of the time, ends it in any case. kinds: of light, besides plain interreflection
    (`render.laser_indirect.path_vertex`). clamp: most radiance of one pass in one pixel, W/(m^2 sr); biased. left:
    lasers that have their share of the time, with this one. Resumed it gives the image of an uninterrupted run; what it
    keeps is whole when Cancelled is raised.
    """
    world, camera, laser, _, T_world_laser = placed
    low, high, reach = visible_fan_range(world, laser, T_world_laser)
    shape = (camera.height, camera.width)
    if high <= low:
        yield IndirectImage(np.zeros(shape, np.float32), 0.0, 0, line_deviation=0.0)
        return
    task = BdptPass.of(placed, reach, run.seed, kinds, run)
    clear = clear_light(task, run)
    waves = Waves(replace(task, clear=clear.mask(camera.width * camera.height)), camera, run, clear)
    time_is_over = run.time_is_over(left)
    so_far = run.restore(Accumulator.of_arrays)
    if so_far is None:
        so_far = waves.begun(placed, uniform_fan(low, high), kinds, aim)
    # where the line is the goal, its rivals elsewhere are known by waves that go beyond the image's error
    so_far.target = target if aim is None else 0.0
    so_far.aim_at(None if aim is None else aim.importance, 0 if aim is None else aim.laser)
    wave_moments = attach_wave_moments(waves.buffers, so_far)

    def image() -> IndirectImage:
        counts = so_far.paths, round(so_far.invalid) + clear.invalid, round(so_far.clamped)
        clamped_radiance = so_far.clamped_radiance / so_far.weight / so_far.total.size
        radiance, share = with_lone_spread(so_far, shape)
        found = IndirectImage(
            clear.added_to(radiance, kinds),
            clear.error_with(so_far, kinds),
            *counts,
            clamped_radiance,
            line_deviation(),
            given_up(),
            spread=share,
        )
        line = so_far.line
        if line is None:
            return found
        return replace(found, lines=int(line.projection.lit.sum()), unknown=line.unknown(so_far.weight))

    def line_deviation() -> float:
        line = so_far.line
        return math.inf if line is None else math.hypot(so_far.line_deviation, clear.line_deviation(line.projection))

    def given_up() -> bool:
        return so_far.line is not None and so_far.line.out_of_reach

    def unfinished() -> bool:
        known = clear.error_with(so_far, kinds) <= target or (aim is not None and so_far.line_error <= 1.0)
        return not known and so_far.paths < most_paths

    def over() -> bool:
        return run.cancelled() or (so_far.passes > 0 and time_is_over())

    shown = so_far.paths
    while unfinished():
        try:
            # after the passes of the looks
            sampling = sampling_of(so_far, so_far.next_paths)
            waves.trace(PASSES_A_WAVE * (waves.looks + so_far.waves), sampling, stopped=over)
        except Cancelled:
            if not run.cancelled():
                # the time is over, and the wave under way is lost
                break
            if so_far.passes and run.keep_partial():
                yield image()
            raise
        so_far.add(waves.buffers, wave_moments, clamp, run.threads)
        # a target of zero is never reached: the paths that there may be end the render
        off = clear.error_with(so_far, kinds) / target if target > 0.0 else math.inf
        if so_far.line is not None:
            so_far.line.judge(so_far.line_deviation, off, so_far.paths, most_paths)
        run.keep(so_far)
        # the error falls with the root of the paths, at least
        beyond = min(off, math.inf if aim is None else so_far.line_error)
        done = max(beyond**-2, so_far.paths / most_paths) if beyond > 0.0 else 1.0
        run.progress(min(0.99, done))
        if time_is_over():
            break
        if run.watched and so_far.paths >= 2 * shown and unfinished():
            shown = so_far.paths
            yield image()
    run.teach(run.part, ReflectedLesson.of(so_far))
    # before there is one more image: they are the largest part of the memory
    waves.buffers.clear()
    yield image()


def with_lone_spread(so_far: Accumulator, shape: tuple[int, int]) -> tuple[Float32, float | None]:
    """(h, w) radiance so far, with the peaks of single passes spread, and the share of it that was; None: no line is
    the goal."""
    radiance, lone = so_far.radiance(shape), so_far.lone()
    return radiance, None if lone is None else spread_lone(radiance, *lone)


class Waves:
    """Waves of passes, each pass into a buffer of its own, of which there are as many as a wave has passes."""

    def __init__(self, task: BdptPass, camera: Camera, run: Run, clear: ClearLight = NO_LIGHT) -> None:
        self.task, self.camera, self.run, self.clear = task, camera, run, clear
        self.lesson: ReflectedLesson | None = run.taught(run.part)
        self.looks = LOOKS if self.lesson is None else TAUGHT
        """Waves, before whose passes those of the waves are not numbered."""
        self.buffers = [empty_buffer(camera.width * camera.height) for _ in range(PASSES_A_WAVE)]

    def trace(
        self, first: int, sampling: Sampling, specular: Bool | None = None, stopped: Cancel | None = None
    ) -> None:
        """Passes first .. first + PASSES_A_WAVE; specular: as for `BdptPass.run`; stopped: in place of the run's
        `cancelled`. Raises Cancelled."""
        run, cancelled = self.run, stopped or self.run.cancelled

        def work(start: int, stop: int) -> None:
            for number in range(start, stop):
                self.task.run(first + number, sampling, self.buffers[number], cancelled, specular)

        map_chunks(work, PASSES_A_WAVE, 1, min(PASSES_A_WAVE, thread_count(run.threads)), cancelled)

    def begun(self, placed: PlacedLaser, fan: FanDistribution, kinds: int, aim: Aim | None) -> Accumulator:
        """An empty accumulator that knows where to look: by what the first frame of a block found, or first looks."""
        if self.lesson is not None and aim is not None:
            specular = seen_specular(self.task, placed.T_world_camera, self.run)
            found = self.lesson.begin(fan, kinds, specular, aim.importance, aim.laser)
            if found is not None:
                return found
        return self.first_looks(placed, fan, kinds, aim)

    def first_looks(self, placed: PlacedLaser, fan: FanDistribution, kinds: int, aim: Aim | None) -> Accumulator:
        """An empty accumulator that knows where laser and camera should look; the light of the looks is thrown away.

        The first finds, by light, where it arrives at all (what is behind glass only the camera finds), the second,
        from there, which light matters, and a third, where the line is the goal, how many paths each scan line needs.
        """
        task, camera, look_paths = self.task, self.camera, LOOK_PATHS if aim is None else LINE_LOOK
        specular = seen_specular(task, placed.T_world_camera, self.run)
        behind = specular if task.specular else None
        camera_paths = first_camera_paths(specular, camera, 16 * look_paths)
        first_look = Sampling(look_paths, fan, camera_paths, active_pixels(camera_paths), no_guide(camera))
        self.trace(0, first_look, behind)
        found = initialise_guiding(self.buffers, fan, camera, kinds, specular, aimed=aim is not None)
        wave_moments = attach_wave_moments(self.buffers, found)
        self.trace(PASSES_A_WAVE, sampling_of(found, look_paths), behind)
        if aim is not None:
            found.aim_at(aim.importance, aim.laser)
            assert found.line is not None
            found.learn(found.line.spread(self.buffers), LOOK_SIZE)
        refine_guiding(found, self.buffers, wave_moments, camera)
        if aim is not None and found.line is not None:

            def weigh(light: Float32) -> Importance:
                return aim.weigh(self.clear.added_to(light, kinds))

            self.trace(2 * PASSES_A_WAVE, sampling_of(found, found.next_paths), behind)
            found.line = found.line.look(self.buffers, weigh, aim.laser)
            found.learn(found.line.spread(self.buffers), LOOK_SIZE)
            refine_guiding(found, self.buffers, wave_moments, camera)
        return found


def initialise_guiding(
    buffers: list[PassBuffer], fan: FanDistribution, camera: Camera, kinds: int, specular: Bool, *, aimed: bool
) -> Accumulator:
    """An empty accumulator, guided by a first look, whose buffers are zeroed; aimed: the line is the goal."""
    pixels, look_paths = camera.width * camera.height, LINE_LOOK if aimed else LOOK_PATHS
    fan = guided_fan(fan, np.sum([buffer.fan_moments for buffer in buffers], axis=0))
    share, camera_radiance = camera_reachable_share(buffers)
    # where the line is the goal this is only asked for its surroundings, which the next look is to find
    arrived = None if aimed else arrived_paths(camera_radiance)
    camera_paths = allocate_camera_paths(camera_radiance, camera.width, look_paths * share, arrived, 1.0)
    reserve_for_specular(camera_paths, specular, look_paths)
    guide = first_guide(camera_paths, camera)
    guide_moments = np.zeros((len(guide.cumulative), BINS))
    size = LINE_PASS if aimed else min(max(1 << max((pixels >> 9).bit_length() - 1, 0), LEAST_PASS), MOST_PASS)
    sums = np.zeros(pixels), np.zeros(pixels, np.float32)
    return Accumulator(kinds, fan, size, 1, share, specular, camera_paths, guide, guide_moments, *sums)


def refine_guiding(first: Accumulator, buffers: list[PassBuffer], wave_moments: Float, camera: Camera) -> None:
    """Refine the guiding by a second look, whose buffers are zeroed, and say how far passes may grow."""
    first.guide = update_guide(first.guide, wave_moments, first.guide_moments)
    first.camera_share, camera_radiance = camera_reachable_share(buffers)
    if len(first.specular):
        # where something may be behind glass is not forgotten when the first passes find nothing there
        first.camera_radiance[:] = camera_radiance
    # a wide glow is best known by passes with a path for each of its pixels
    first.growth_limit = max((MOST_CAMERA_PASS // 2 if first.camera_share > 0.5 else MOST_PASS) // first.size, 1)
    first.guide_camera(camera_radiance, float(PASSES_A_WAVE))


def arrived_paths(camera_radiance: Float32) -> Float32:
    """(pixels,) roughly how many light paths of a first look came to each."""
    paths, arrived = np.zeros(len(camera_radiance), np.float32), nonzero_places(camera_radiance)
    radiance = camera_radiance[arrived].astype(np.float64)
    paths[arrived] = radiance * (PASSES_A_WAVE * LOOK_PATHS / max(float(radiance.sum()), 1e-300))
    return paths


def camera_reachable_share(buffers: list[PassBuffer]) -> tuple[float, Float32]:
    """What techniques that start at the camera could make, whichever found it: share of the light, (pixels,) radiance.

    The buffers are zeroed.
    """
    camera_radiance = np.zeros(len(buffers[0].camera_radiance), np.float32)
    light, by_camera = sum_looks(buffers, camera_radiance)
    for buffer in buffers:
        buffer.invalid[:] = 0.0
    return min(by_camera / light, 1.0) if light > 0.0 else 1.0, camera_radiance


def sampling_of(so_far: Accumulator, light_paths: int) -> Sampling:
    """How the next passes sample, by what the passes so far have found."""
    active, line = active_pixels(so_far.camera_paths), so_far.line
    keys = NO_KEYS if line is None or line.out_of_reach else alike_on_a_line(line.projection)
    return Sampling(light_paths, so_far.fan, so_far.camera_paths, active, so_far.guide, keys)


def attach_wave_moments(buffers: list[PassBuffer], so_far: Accumulator) -> Float:
    """Give each buffer, in place, its part of the array that is returned."""
    wave_moments = np.zeros((PASSES_A_WAVE, *so_far.guide_moments.shape))
    buffers[:] = [buffer._replace(wave_moments=wave_moments[i]) for i, buffer in enumerate(buffers)]
    return wave_moments


def seen_specular(task: BdptPass, T_world_camera: Float, run: Run) -> Bool:
    """(pixels,) where the camera sees a mirror or clear glass whose light is wanted; (0,): there is none."""
    if not task.specular:
        return NO_PIXELS
    made_of = T_world_camera.tobytes(), task.camera
    return run.remembered(
        "specular pixels",
        task.world,
        made_of,
        lambda: find_specular_pixels(task.world, task.surface, task.camera, T_world_camera),
    )


def empty_buffer(pixels: int) -> PassBuffer:
    """Zeros, without a guide; the system finds memory for the images only where light arrives."""
    zeros = np.zeros(KINDS), np.zeros(FAN_BINS), np.zeros((0, BINS))
    touched = np.zeros(-(-pixels // BLOCK), np.bool_)
    return PassBuffer(np.zeros(pixels, np.float32), np.zeros(pixels, np.float32), *zeros, np.zeros(1), touched)


def first_camera_paths(specular: Bool, camera: Camera, count: int) -> Float32:
    """(pixels,) camera paths of a first look: at most `count`, on what the camera sees of mirrors and clear glass."""
    camera_paths = np.zeros(camera.width * camera.height, np.float32)
    if len(specular):
        camera_paths[specular] = min(1.0, count / max(int(specular.sum()), 1))
    return camera_paths
