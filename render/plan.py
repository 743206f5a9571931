"""What a render computes and what it leaves out, and why: decided by the settings or by a short pilot."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from render.bidirectional import indirect_image, indirect_shares
from render.lens_plan import lens_lines
from render.scene import Scene
from render.settings import RenderSettings
from render.threads import Cancel, Progress
from render.vertex import BENT, PLAIN, SUNK, UNJOINED
from render.world import World

Float32 = NDArray[np.float32]

DIRECT = "direct: light of each laser that meets one surface, exact across the sheet, sampled across edges and shadows"


@dataclass(frozen=True)
class Rung:
    """One step of the ladder of light transport, each dearer than the one before."""

    name: str
    light: str
    kind: int
    """Bits of `render.vertex`; PLAIN: nothing but rough surfaces."""
    share: str
    """Of `render.bidirectional.Shares`."""


RUNGS = (
    Rung("interreflection", "laser light over two or more rough surfaces", PLAIN, "plain"),
    Rung(
        "caustic", "laser light through clear glass or off mirrors, joined from the laser or the camera", BENT, "bent"
    ),
    Rung(
        "specular-chain",
        "laser light through clear glass or off mirrors both before and after its one rough surface, by photon merging",
        BENT | UNJOINED,
        "unjoined",
    ),
    Rung("subsurface", "laser light that wandered below a surface, by random walk", SUNK, "sunk"),
)
INDIRECT = "light of the lasers that meets two or more surfaces"


@dataclass(frozen=True)
class Plan:
    """What is traced of the lasers' indirect light, and the lines that say so; "left out:" begins what is not done."""

    kinds: int | None
    """Kinds of light besides plain interreflection (`render.vertex`); None: no indirect light at all."""
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
    """Decide on the lasers' indirect light; a pilot of a few thousand paths measures what each rung would add.

    direct: (h, w) direct radiance of each laser.
    """
    tail = lens_lines(scene.camera)
    if settings.transport == "direct":
        return Plan(None, (DIRECT, f"left out: {INDIRECT} - switched off, its share was not measured", *tail))
    shares = pilot_shares(world, scene, direct, step=step, seed=seed, cancelled=cancelled)
    names = [rung.name for rung in RUNGS]
    wanted = names.index(settings.transport) if settings.transport in names else -1
    kinds: int | None = None
    lines = [DIRECT]
    for i, rung in enumerate(RUNGS):
        share, error = shares[rung.share]
        if share == error == 0.0 and i > max(wanted, 0):
            # nothing in the scene makes such light, or none that the pilot met
            continue
        measured = f"a pilot puts it at {share:.2%} +- {error:.2%} of the direct light in the image"
        # what may well be more than negligible is computed
        worth = share + 2.0 * error > settings.negligible
        if i <= wanted or (wanted < 0 and worth):
            kinds = (kinds or PLAIN) | rung.kind
            asked = "asked for; " if wanted >= 0 else ""
            lines.append(f"{rung.name}: {rung.light} - {asked}{measured}")
        else:
            why = "not asked for" if wanted >= 0 else f"below the negligible {settings.negligible:.2%}"
            lines.append(f"left out: {rung.light} ({rung.name}) - {measured}, {why}")
    return Plan(kinds, (*lines, *tail))


def indirect_light(
    world: World,
    scene: Scene,
    settings: RenderSettings,
    direct: tuple[Float32, ...],
    *,
    step: int = 0,
    seed: int = 0,
    threads: int | None = None,
    cancelled: Cancel | None = None,
    progress: Progress | None = None,
) -> tuple[Plan, tuple[Float32, ...], dict[str, float]]:
    """The plan, the indirect radiance of each laser as it says (none: empty), and what it took. Raises Cancelled."""
    plan = choose_plan(world, scene, settings, direct, step=step, seed=seed, cancelled=cancelled)
    images, counts = [], {}
    for i, laser in enumerate(scene.lasers if plan.kinds is not None else ()):
        image = indirect_image(
            world,
            scene.camera,
            laser,
            scene.T_world_camera(step),
            scene.T_world_laser(i, step),
            target=settings.indirect_error,
            most_paths=settings.light_paths,
            kinds=plan.kinds or PLAIN,
            seed=seed + i,
            threads=threads,
            cancelled=cancelled,
            progress=None if progress is None else partial(_share, progress, i, len(scene.lasers)),
        )
        images.append(image.radiance)
        counts[f"relative error of reflections, {laser.name}"] = image.error
        counts[f"light paths, {laser.name}"] = image.paths
    return plan, tuple(images), counts


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
) -> dict[str, tuple[float, float]]:
    """Each kind of indirect light over the direct light in the image, over all lasers, with its standard error."""
    known = sum(float(image.sum(dtype=np.float64)) for image in direct)
    found = []
    for i, laser in enumerate(scene.lasers):
        poses = scene.T_world_camera(step), scene.T_world_laser(i, step)
        pilot_seed = seed + 7919 * (i + 1)
        found.append(indirect_shares(world, scene.camera, laser, *poses, seed=pilot_seed, cancelled=cancelled))
    shares = {}
    for rung in RUNGS:
        parts = [getattr(one, rung.share) for one in found]
        flux, error = sum(part[0] for part in parts), math.sqrt(sum(part[1] ** 2 for part in parts))
        if known > 0.0:
            shares[rung.share] = (flux / known, error / known)
        else:
            shares[rung.share] = (math.inf, 0.0) if flux > 0.0 else (0.0, 0.0)
    return shares
