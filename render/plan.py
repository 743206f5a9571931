"""What a render computes and what it leaves out, and why: decided by the settings or by a short pilot."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from render.lens_plan import lens_lines
from render.light_path import indirect_flux, indirect_image
from render.scene import Scene
from render.settings import RenderSettings
from render.threads import Cancel, Progress
from render.world import World

Float32 = NDArray[np.float32]

DIRECT = "direct: light of each laser that meets one surface, exact across the sheet, sampled across edges and shadows"
INDIRECT = "light of the lasers that meets two or more surfaces (interreflection)"


@dataclass(frozen=True)
class Plan:
    """Whether the lasers' indirect light is traced, and the lines that say so; "left out:" begins what is not done."""

    indirect: bool
    lines: tuple[str, ...]

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
    """Decide on the lasers' indirect light; a pilot of a few thousand paths measures its share of the light.

    direct: (h, w) direct radiance of each laser.
    """
    tail = lens_lines(scene.camera)
    if settings.transport == "direct":
        return Plan(False, (DIRECT, f"left out: {INDIRECT} - switched off, its share was not measured", *tail))
    share, error = pilot_share(world, scene, direct, step=step, seed=seed, cancelled=cancelled)
    measured = f"a pilot puts it at {share:.2%} +- {error:.2%} of the direct light in the image"
    if settings.transport == "interreflection":
        return Plan(True, (DIRECT, f"interreflection: {INDIRECT} - asked for; {measured}", *tail))
    # what may well be more than negligible is computed
    if share + 2.0 * error > settings.negligible:
        return Plan(True, (DIRECT, f"interreflection: {INDIRECT} - {measured}", *tail))
    line = f"left out: {INDIRECT} - {measured}, below the negligible {settings.negligible:.2%}"
    return Plan(False, (DIRECT, line, *tail))


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
    for i, laser in enumerate(scene.lasers if plan.indirect else ()):
        image = indirect_image(
            world,
            scene.camera,
            laser,
            scene.T_world_camera(step),
            scene.T_world_laser(i, step),
            target=settings.indirect_error,
            most_paths=settings.light_paths,
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


def pilot_share(
    world: World,
    scene: Scene,
    direct: tuple[Float32, ...],
    *,
    step: int = 0,
    seed: int = 0,
    cancelled: Cancel | None = None,
) -> tuple[float, float]:
    """Indirect over direct light in the image, over all lasers, and its standard error."""
    known = sum(float(image.sum(dtype=np.float64)) for image in direct)
    flux = variance = 0.0
    for i, laser in enumerate(scene.lasers):
        poses = scene.T_world_camera(step), scene.T_world_laser(i, step)
        mean, error = indirect_flux(world, scene.camera, laser, *poses, seed=seed + 7919 * (i + 1), cancelled=cancelled)
        flux, variance = flux + mean, variance + error**2
    if known <= 0.0:
        return (math.inf, 0.0) if flux > 0.0 else (0.0, 0.0)
    return flux / known, math.sqrt(variance) / known
