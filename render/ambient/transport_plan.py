"""How far ambient light is followed, and why: decided by the settings, or by a pilot that measures what that adds."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from render.ambient.integrator import AmbientImage, Arrays, Film, ambient_images
from render.ambient.path_tracer import camera_paths
from render.base.counts import AMBIENT_CLAMPED, AMBIENT_CUT, AMBIENT_DROPPED, AMBIENT_ERROR, AMBIENT_SAMPLES, Counts
from render.base.threads import Cancel, Progress
from render.material.bsdf import DIELECTRIC, SPECULAR_ROUGHNESS
from render.material.material import Emitter
from render.sampling.random import wrapped
from render.scene.lights import PointLight
from render.scene.scene import Scene
from render.scene.settings import RenderSettings
from render.world.world import World

Float = NDArray[np.float64]

AMBIENT = "light of lamps, surroundings and shining objects"
ONWARD = "ambient light that meets two or more surfaces (interreflection, light through glass)"

GROUPS, GROUP_PIXELS, PIXEL_SAMPLES = 16, 64, 16
"""The pilot's pixels, drawn by chance, in groups whose spread is its uncertainty; samples of each half on one."""
PILOT_SEED = 15_485_863


@dataclass(frozen=True)
class AmbientPlan:
    """The most surfaces that ambient light may meet (None: no bound), and the lines that say so."""

    surfaces: int | None
    lines: tuple[str, ...]


def has_ambient(scene: Scene) -> bool:
    """There is light besides the lasers."""
    shining = (item.material for item in scene.visible_objects if isinstance(item.material, Emitter))
    return bool(scene.lights) or any(scene.environment.radiance) or any(any(m.radiance) for m in shining)


def expected_ambient(scene: Scene, settings: RenderSettings) -> tuple[str, ...]:
    """The lines before anything was measured."""
    if not has_ambient(scene):
        return ("ambient: none, the scene has no lamp and dark surroundings",)
    effort = f"to {settings.ambient_error:.1%} or {settings.ambient_samples} samples a pixel"
    camera = scene.camera
    lines = [f"ambient: {AMBIENT} on {camera.width} x {camera.height} pixels, {effort}"]
    if settings.transport == "direct":
        lines.append(f"left out: {ONWARD} - switched off")
    elif settings.transport == "auto":
        lines.append(f"{ONWARD}: a pilot decides, it is left out below {settings.negligible:.2%} of the light")
    else:
        lines.append(f"interreflection: {ONWARD}{_bound(settings)} - asked for")
    return (*lines, *_clamp_line(settings))


def choose_ambient(
    world: World,
    scene: Scene,
    settings: RenderSettings,
    *,
    step: int = 0,
    seed: int = 0,
    cancelled: Cancel | None = None,
) -> AmbientPlan:
    """Decide how many surfaces ambient light may meet. Raises Cancelled."""
    if settings.transport == "direct" or not has_ambient(scene):
        return ambient_plan_of(None, world, scene, settings)
    share = onward_share(world, scene, settings.max_bounces, step=step, seed=seed, cancelled=cancelled)
    return ambient_plan_of(share, world, scene, settings)


def ambient_plan_of(
    measured_share: tuple[float, float] | None, world: World, scene: Scene, settings: RenderSettings
) -> AmbientPlan:
    """The plan that follows from what a pilot measured; None: nothing, as `choose_ambient` does not ask."""
    if not has_ambient(scene):
        return AmbientPlan(1, expected_ambient(scene, settings))
    effort = f"to {settings.ambient_error:.1%} or {settings.ambient_samples} samples a pixel"
    head = f"ambient: {AMBIENT}, {effort}"
    blind = _blind_lines(world, scene)
    if measured_share is None:
        return AmbientPlan(1, (head, f"left out: {ONWARD} - switched off, its share was not measured", *blind))
    share, error = measured_share
    measured = f"a pilot puts it at {share:.2%} +- {error:.2%} of what one surface reflects"
    if math.isinf(share):
        measured = "nothing that is seen is lit otherwise"
    if settings.transport == "auto" and share + 2.0 * error <= settings.negligible:
        line = f"left out: {ONWARD} - {measured}, below the negligible {settings.negligible:.2%}"
        return AmbientPlan(1, (head, line, *blind))
    why = f"asked for; {measured}" if settings.transport != "auto" else measured
    line = f"interreflection: {ONWARD}{_bound(settings)} - {why}"
    return AmbientPlan(settings.max_bounces, (head, line, *_clamp_line(settings), *blind))


def planned_images(  # noqa: PLR0913
    world: World,
    scene: Scene,
    settings: RenderSettings,
    plan: AmbientPlan,
    *,
    step: int = 0,
    seed: int = 0,
    threads: int | None = None,
    cancelled: Cancel | None = None,
    progress: Progress | None = None,
    keeps: Cancel | None = None,
    before: Arrays | None = None,
    keep: Callable[[Film], None] | None = None,
) -> Iterator[tuple[AmbientImage, Counts]]:
    """Ever better images as the plan says, and what `Frame.counts` tells of each.

    keeps, before, keep: see `ambient_images`.

    Raises Cancelled.
    """
    images = ambient_images(
        world,
        scene,
        scene.camera,
        scene.T_world_camera(step),
        target=settings.ambient_error,
        most=settings.ambient_samples,
        surfaces=plan.surfaces,
        clamp=settings.clamp,
        seed=seed,
        threads=threads,
        cancelled=cancelled,
        progress=progress,
        keeps=keeps,
        before=before,
        keep=keep,
    )
    for image in images:
        counts: Counts = {AMBIENT_SAMPLES: image.samples, AMBIENT_DROPPED: float(image.dropped)}
        if not math.isnan(image.error):
            counts[AMBIENT_ERROR] = image.error
        if settings.clamp is not None:
            counts |= {AMBIENT_CLAMPED: float(image.clamped), AMBIENT_CUT: image.cut}
        yield image, counts


def onward_share(
    world: World,
    scene: Scene,
    most: int | None = None,
    *,
    step: int = 0,
    seed: int = 0,
    cancelled: Cancel | None = None,
) -> tuple[float, float]:
    """Light by way of two surfaces and more over that by way of one, in the image, and its standard error.

    most: surfaces that it may meet. The lights themselves, where they are seen, count for nothing. Infinite: nothing
    comes by way of one surface.
    """
    camera = scene.camera
    view, own = camera.view(scene.T_world_camera(step)), wrapped(seed + PILOT_SEED)
    draw = np.random.default_rng(own).integers(camera.width * camera.height, size=GROUPS * GROUP_PIXELS)
    sums = []
    # the same numbers each time, so that what is common to all is the same to the last bit
    for surfaces in (0, 1, most):
        paths = camera_paths(world, scene, view, surfaces=surfaces, seed=own)
        total = np.zeros((2 * len(draw), 4))
        first = np.zeros((len(draw), 2), np.int32)
        count = np.full_like(first, PIXEL_SAMPLES)
        paths.add(draw.astype(np.int32), first, count, total, np.zeros(2), cancelled)
        sums.append(total[:, :3].reshape(GROUPS, -1).sum(axis=1))
    seen, once, all_of_it = sums
    known, onward = once - seen, np.maximum(all_of_it - once, 0.0)
    if known.sum() <= 0.0:
        return (math.inf, 0.0) if onward.sum() > 0.0 else (0.0, 0.0)
    share = float(onward.sum() / known.sum())
    spread = float(np.sum((onward - share * known) ** 2)) * GROUPS / (GROUPS - 1)
    return share, math.sqrt(spread) / float(known.sum())


def _bound(settings: RenderSettings) -> str:
    return "" if settings.max_bounces is None else f", {settings.max_bounces} at most"


def _clamp_line(settings: RenderSettings) -> tuple[str, ...]:
    if settings.clamp is None:
        return ()
    return (
        f"clamp: no sample of ambient light by way of two or more surfaces adds more than {settings.clamp:g} W/(m^2 sr)"
        " - biased, too dark where it cuts",
    )


def _blind_lines(world: World, scene: Scene) -> tuple[str, ...]:
    """What no path from the camera can find, or is not followed."""
    rows, lines = world.surface.rows, []
    polished = np.any((rows[:, 0] == DIELECTRIC) & (np.maximum(rows[:, 1], rows[:, 2]) < SPECULAR_ROUGHNESS))
    if polished and any(isinstance(light, PointLight) for light in scene.lights):
        lines.append("left out: light of point lamps by way of polished glass - no path from the camera meets a point")
    return tuple(lines)
