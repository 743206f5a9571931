"""What a render computes and what it leaves out, and why: decided by the settings or by a short pilot."""

from __future__ import annotations

import functools
import math
import operator
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from render.base.counts import (
    INDIRECT_CLAMPED,
    INDIRECT_CUT,
    INDIRECT_DROPPED,
    INDIRECT_ERROR,
    LIGHT_PATHS,
    Counts,
)
from render.base.threads import Cancel, Progress
from render.camera.focus import lens_lines
from render.checkpoint import RenderState, laser_part
from render.laser_indirect.accumulator import Accumulator
from render.laser_indirect.integrator import indirect_images, indirect_shares
from render.laser_indirect.path_vertex import CAUSTIC, INTERREFLECTION, SPECULAR_CHAIN, SUBSURFACE_LIGHT
from render.sampling.random import wrapped
from render.scene.scene import Scene
from render.scene.settings import RenderSettings
from render.world.world import World

Float32 = NDArray[np.float32]
Shares = dict[str, tuple[float, float]]
"""By `TransportStep.share`: light of that kind over the direct light in the image, and its standard error."""

DIRECT = "direct: light of each laser that meets one surface, exact across the sheet, sampled across edges and shadows"


@dataclass(frozen=True)
class TransportStep:
    """One step of the ladder of light transport, each dearer than the one before."""

    name: str
    light: str
    kind: int
    """Bits of `render.laser_indirect.path_vertex`; INTERREFLECTION: nothing but rough surfaces."""
    share: str
    """Of `render.laser_indirect.integrator.Shares`."""


TRANSPORT_STEPS = (
    TransportStep("interreflection", "laser light over two or more rough surfaces", INTERREFLECTION, "interreflection"),
    TransportStep(
        "caustic",
        "laser light through clear glass or off mirrors, joined from the laser or the camera",
        CAUSTIC,
        "caustic",
    ),
    TransportStep(
        "specular-chain",
        "laser light through clear glass or off mirrors both before and after its one rough surface, by photon merging",
        CAUSTIC | SPECULAR_CHAIN,
        "specular_chain",
    ),
    TransportStep(
        "subsurface", "laser light that wandered below a surface, by random walk", SUBSURFACE_LIGHT, "subsurface"
    ),
)
INDIRECT = "light of the lasers that meets two or more surfaces"


@dataclass(frozen=True)
class Plan:
    """What is traced of the lasers' indirect light, and the lines that say so; "left out:" begins what is not done."""

    kinds: int | None
    """Kinds of light besides plain interreflection (`render.laser_indirect.path_vertex`); None: no indirect light at
    all.
    """
    lines: tuple[str, ...]

    @property
    def indirect(self) -> bool:
        return self.kinds is not None

    @property
    def text(self) -> str:
        return "\n".join(self.lines)


def choose_plan(
    world: World,
    scene: Scene,
    settings: RenderSettings,
    direct: tuple[Float32, ...],
    *,
    step: int = 0,
    seed: int = 0,
    cancelled: Cancel | None = None,
) -> Plan:
    """Decide on the lasers' indirect light; a pilot of few paths measures what each transport step would add.

    direct: (h, w) direct radiance of each laser.
    """
    if settings.transport == "direct":
        return direct_plan(scene)
    shares = pilot_shares(world, scene, direct, step=step, seed=seed, cancelled=cancelled)
    return plan_of(shares, scene, settings)


def direct_plan(scene: Scene) -> Plan:
    """Where nothing is asked for but direct light."""
    left_out = f"left out: {INDIRECT} - switched off, its share was not measured"
    return Plan(None, (DIRECT, left_out, *lens_lines(scene.camera)))


def plan_of(shares: Shares, scene: Scene, settings: RenderSettings) -> Plan:
    """The plan that follows from what a pilot measured."""
    names = [transport.name for transport in TRANSPORT_STEPS]
    wanted = names.index(settings.transport) if settings.transport in names else -1
    computed = {}
    for i, transport in enumerate(TRANSPORT_STEPS):
        share, error = shares[transport.share]
        # what may well be more than negligible is computed
        computed[transport.name] = i <= wanted or (wanted < 0 and share + 2.0 * error > settings.negligible)
    chosen = [transport for transport in TRANSPORT_STEPS if computed[transport.name]]
    kinds = (
        functools.reduce(operator.or_, (transport.kind for transport in chosen), INTERREFLECTION) if chosen else None
    )
    lines = [DIRECT]
    for i, transport in enumerate(TRANSPORT_STEPS):
        share, error = shares[transport.share]
        if share == error == 0.0 and i > max(wanted, 0):
            # nothing in the scene makes such light, or none that the pilot met
            continue
        measured = f"a pilot puts it at {share:.2%} +- {error:.2%} of the direct light in the image"
        if math.isinf(share):
            measured = "there is no direct light in the image to compare it with"
        if computed[transport.name]:
            asked = "asked for; " if wanted >= 0 else ""
            lines.append(f"{transport.name}: {transport.light} - {asked}{measured}")
        elif kinds is not None and transport.kind & kinds == transport.kind:
            lines.append(f"{transport.name}: {transport.light} - comes with {chosen[-1].name}; {measured}")
        else:
            why = "not asked for" if wanted >= 0 else f"below the negligible {settings.negligible:.2%}"
            lines.append(f"left out: {transport.light} ({transport.name}) - {measured}, {why}")
    clamped = clamp_line(settings) if kinds is not None else ()
    return Plan(kinds, (*lines, *clamped, *lens_lines(scene.camera)))


def indirect_light(  # noqa: PLR0913
    world: World,
    scene: Scene,
    settings: RenderSettings,
    plan: Plan,
    *,
    step: int = 0,
    seed: int = 0,
    threads: int | None = None,
    cancelled: Cancel | None = None,
    progress: Progress | None = None,
    keeps: Cancel | None = None,
    enough: Callable[[int], Cancel | None] = lambda left: None,
    state: RenderState | None = None,
) -> Iterator[tuple[tuple[Float32, ...], Counts]]:
    """Ever better indirect radiance of each laser as the plan says (dark until its turn), and `Frame.counts` of it.

    enough: given how many lasers are left to be done, what ends the next one (`indirect_images`). state: to go on from,
    and to keep. Raises Cancelled; where keeps() then says so, after one more image.
    """
    count = len(scene.lasers) if plan.kinds is not None else 0
    images = [np.zeros((scene.camera.height, scene.camera.width), np.float32)] * count
    counts: Counts = {}
    for i, laser in enumerate(scene.lasers[:count]):
        for image in indirect_images(
            world,
            scene.camera,
            laser,
            scene.T_world_camera(step),
            scene.T_world_laser(i, step),
            target=settings.indirect_error,
            most_paths=settings.light_paths,
            kinds=plan.kinds or INTERREFLECTION,
            clamp=settings.laser_clamp,
            seed=wrapped(seed + i),
            threads=threads,
            cancelled=cancelled,
            progress=None if progress is None else partial(_share, progress, i, count),
            keeps=keeps,
            enough=enough(count - i),
            resume_from=None if state is None else state.restore(laser_part(i), Accumulator.of_arrays),
            keep=None if state is None else partial(state.keep, laser_part(i)),
        ):
            images[i] = image.radiance
            counts[INDIRECT_ERROR.of(i)] = image.error
            counts[LIGHT_PATHS.of(i)] = image.paths
            counts[INDIRECT_DROPPED.of(i)] = image.dropped
            if settings.laser_clamp is not None:
                counts[INDIRECT_CLAMPED.of(i)] = image.clamped
                counts[INDIRECT_CUT.of(i)] = image.cut
            yield tuple(images), dict(counts)


def clamp_line(settings: RenderSettings) -> tuple[str, ...]:
    """What the clamp on the lasers' indirect light does, if there is one."""
    if settings.laser_clamp is None:
        return ()
    return (
        f"clamp: no pass of a laser's indirect light puts more than {settings.laser_clamp:g} W/(m^2 sr) into a pixel"
        " - biased, too dark where it cuts",
    )


def _share(progress: Progress, index: int, count: int, done: float) -> None:
    progress((index + done) / count)


def pilot_shares(
    world: World,
    scene: Scene,
    direct: tuple[Float32, ...],
    *,
    step: int = 0,
    seed: int = 0,
    cancelled: Cancel | None = None,
) -> Shares:
    """Each kind of indirect light over the direct light in the image, over all lasers, with its standard error."""
    known = sum(float(image.sum(dtype=np.float64)) for image in direct)
    found = []
    for i, laser in enumerate(scene.lasers):
        poses = scene.T_world_camera(step), scene.T_world_laser(i, step)
        pilot_seed = wrapped(seed + 7919 * (i + 1))
        found.append(indirect_shares(world, scene.camera, laser, *poses, seed=pilot_seed, cancelled=cancelled))
    shares = {}
    for transport in TRANSPORT_STEPS:
        parts = [getattr(one, transport.share) for one in found]
        flux, error = sum(part[0] for part in parts), math.sqrt(sum(part[1] ** 2 for part in parts))
        if known > 0.0:
            shares[transport.share] = (flux / known, error / known)
        else:
            shares[transport.share] = (math.inf, 0.0) if flux > 0.0 else (0.0, 0.0)
    return shares
