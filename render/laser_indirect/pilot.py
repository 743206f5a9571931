"""A few short passes that tell what each kind of a laser's indirect light brings, and what it does to the line."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from render.base.arrays import Float
from render.base.threads import map_chunks, thread_count
from render.camera.camera import Camera
from render.laser.laser import LineLaser
from render.laser_indirect.accumulator import PASSES_A_WAVE
from render.laser_indirect.bdpt_pass import BdptPass
from render.laser_indirect.clear_light import ClearLight, clear_light
from render.laser_indirect.connection_buffer import PassBuffer, clear_pass
from render.laser_indirect.guiding import active_pixels, allocate_camera_paths, no_guide, reserve_for_specular
from render.laser_indirect.integrator import (
    LOOK_PATHS,
    arrived_paths,
    camera_reachable_share,
    empty_buffer,
    first_camera_paths,
    seen_specular,
)
from render.laser_indirect.line_goal import Effect, Projection
from render.laser_indirect.path_vertex import ALL_KINDS, CAUSTIC, INTERREFLECTION, SPECULAR_CHAIN
from render.laser_indirect.photon_emission import uniform_fan, visible_fan_range
from render.laser_indirect.sampling import Sampling
from render.run import Run
from render.world.placed import PlacedLaser
from render.world.world import World

PILOT_PATHS = 1 << 12
"""Light paths in a pass of the pilot. Chosen, not tuned."""

CUMULATIVE_KINDS = {
    "interreflection": INTERREFLECTION,
    "caustic": CAUSTIC,
    "specular_chain": CAUSTIC | SPECULAR_CHAIN,
    "subsurface": ALL_KINDS,
}
"""By field of `IndirectPilot`: its kind of light and all those before it."""


@dataclass(frozen=True)
class IndirectPilot:
    """What a pilot found: radiance summed over the image, with its standard error, of each kind of indirect light."""

    interreflection: tuple[float, float]
    """Over two or more surfaces, none of them a mirror, clear glass or a medium."""
    caustic: tuple[float, float]
    """Through clear glass or off mirrors, with an edge left that a connection can lie on."""
    specular_chain: tuple[float, float]
    """Through clear glass or off mirrors on both sides of each rough surface."""
    subsurface: tuple[float, float]
    """Through a medium."""
    effects: dict[str, float] = field(default_factory=dict)
    """By the same names, the most that it may well move any line or add to a peak, over what is allowed; empty: where
    errors matter is not known."""


def indirect_pilot(
    world: World,
    camera: Camera,
    laser: LineLaser,
    T_world_camera: Float,
    T_world_laser: Float,
    *,
    passes: int = PASSES_A_WAVE,
    projection: Projection | None = None,
    run: Run = Run(),
) -> IndirectPilot:
    """A pilot of a few short passes: what each kind of indirect light brings. Raises Cancelled.

    projection: where errors of this laser's light matter, for the effects.
    """
    low, high, reach = visible_fan_range(world, laser, T_world_laser)
    if high <= low:
        return IndirectPilot((0.0, 0.0), (0.0, 0.0), (0.0, 0.0), (0.0, 0.0))
    placed = PlacedLaser(world, camera, laser, T_world_camera, T_world_laser)
    task = BdptPass.of(placed, reach, run.seed, run=run)
    clear = clear_light(task, run)
    task = replace(task, clear=clear.mask(camera.width * camera.height))
    specular = seen_specular(task, T_world_camera, run)
    fan, guide, sums = uniform_fan(low, high), no_guide(camera), []
    buffer = empty_buffer(camera.width * camera.height)
    camera_paths = first_camera_paths(specular, camera, PILOT_PATHS)
    if task.specular:
        # what is seen through glass may be small, and is worth a look of its own
        first_look = Sampling(2 * LOOK_PATHS, fan, camera_paths, active_pixels(camera_paths), guide)
        task.run(passes, first_look, buffer, run.cancelled, specular)
        _, camera_radiance = camera_reachable_share([buffer])
        camera_paths = allocate_camera_paths(
            camera_radiance, camera.width, PILOT_PATHS, arrived_paths(camera_radiance), 1.0
        )
        reserve_for_specular(camera_paths, specular, PILOT_PATHS)
    sampling = Sampling(PILOT_PATHS, fan, camera_paths, active_pixels(camera_paths), guide)
    buffers = [empty_buffer(len(camera_paths)) for _ in range(passes)]
    found_sums, effect = _pilot_passes(task, clear, sampling, buffers, projection, run)
    # by bits of kind: none, CAUSTIC, SUBSURFACE_LIGHT, both of them; and SPECULAR_CHAIN
    for interreflection, caustic, subsurface, both, specular_chain in found_sums:
        sums.append((interreflection, caustic, specular_chain, subsurface + both))
    mean, error = np.mean(sums, axis=0), np.std(sums, axis=0, ddof=1) / math.sqrt(passes)
    pairs = [(float(m), float(e)) for m, e in zip(mean, error, strict=True)]
    found = IndirectPilot(pairs[0], pairs[1], pairs[2], pairs[3])
    if effect is None:
        return found
    present = [name for name, flux in zip(CUMULATIVE_KINDS, mean, strict=True) if flux > 0.0]
    if len(present) <= 1:
        return replace(found, effects={name: effect.most() if name in present else 0.0 for name in CUMULATIVE_KINDS})
    return replace(found, effects=_effects(task, clear, sampling, buffers, effect, run))


def _pilot_passes(
    task: BdptPass,
    clear: ClearLight,
    sampling: Sampling,
    buffers: list[PassBuffer],
    projection: Projection | None,
    run: Run,
) -> tuple[list[Float], Effect | None]:
    """Sums (KINDS,) of the light of each pass, and what all of them do to the line. The buffers, a pass's each, are
    zeroed. Raises Cancelled."""

    def work(start: int, stop: int) -> None:
        for number in range(start, stop):
            task.run(number, sampling, buffers[number], run.cancelled)
            clear.add_to(buffers[number], task.kinds)

    map_chunks(work, len(buffers), 1, thread_count(run.threads), run.cancelled)
    sums = [buffer.sums.copy() for buffer in buffers]
    effect = None if projection is None else Effect.of(projection, buffers)
    map_chunks(lambda start, stop: clear_pass(buffers[start]), len(buffers), 1, run.threads)
    return sums, effect


def _effects(
    task: BdptPass, clear: ClearLight, sampling: Sampling, buffers: list[PassBuffer], last: Effect, run: Run
) -> dict[str, float]:
    """What each kind of light does to the line, by passes of the same random numbers with ever more kinds.

    last: of all kinds. Raises Cancelled.
    """
    effects, before = {}, None
    for name, kinds in CUMULATIVE_KINDS.items():
        specular, with_it = task.specular and bool(kinds & CAUSTIC), last
        if kinds != ALL_KINDS:
            part = replace(task, kinds=kinds, specular=specular)
            with_it = _pilot_passes(part, clear, sampling, buffers, last.projection, run)[1] or last
        effects[name] = with_it.most(before)
        before = with_it
    return effects
