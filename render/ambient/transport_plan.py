"""How far ambient light is followed, and why: decided by the settings, or by a pilot that measures what that adds."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import uniform_filter1d

from render.ambient.directions import Draws
from render.ambient.path_kernels import Film
from render.ambient.path_tracer import camera_paths
from render.ambient.pixel_samples import PixelSamples
from render.base.arrays import Int
from render.importance import Importance, known_below
from render.light_group import Shares
from render.material.bsdf import DIELECTRIC, SPECULAR_ROUGHNESS
from render.material.material import Emitter
from render.plan import GroupPlan, TransportStep
from render.run import Run, ignore
from render.scene.lights import PointLight
from render.scene.scene import Scene
from render.scene.settings import RenderSettings
from render.world.placed import PlacedScene
from render.world.world import World

ONWARD = "interreflection"
"""Ambient light that meets two or more surfaces, light through glass among it."""
GROUPS, GROUP_PIXELS, PIXEL_SAMPLES = 16, 64, 16
"""The pilot's pixels, drawn by chance, in groups whose spread is its uncertainty; samples of each half on one."""
PILOT_SEED = 15_485_863
EFFECT_LINES, EFFECT_SAMPLES, EFFECT_POOLED = 512, 4, 9
"""Scan lines at most, spread evenly, and samples of each half of their pixels, that tell what it does to the line; and
how many of these lines are taken together, since so few samples say little of one."""
EFFECT = "effect of interreflection"
"""Where shares have how far it may move the line, over what is allowed."""

LAMPS = TransportStep("ambient", "ambient", True, "always")
DARK = TransportStep("ambient", "ambient", False, "absent")
SWITCHED_OFF = TransportStep("ambient", ONWARD, False, "switched off")
UNREACHABLE = TransportStep("ambient", "point lamps through polished glass", False, "unreachable")
"""No path from the camera meets a point."""


@dataclass(frozen=True)
class AmbientPlan(GroupPlan):
    """The most surfaces that ambient light may meet, and why."""

    surfaces: int | None = 1
    """None: no bound."""


def has_ambient(scene: Scene) -> bool:
    """There is light besides the lasers."""
    shining = (item.material for item in scene.visible_objects if isinstance(item.material, Emitter))
    return bool(scene.lights) or any(scene.environment.radiance) or any(any(m.radiance) for m in shining)


def plan_of(shares: Shares | None, world: World, scene: Scene, settings: RenderSettings) -> AmbientPlan:
    """The plan that follows from what a pilot measured; None: nothing, since direct light alone is requested."""
    if not has_ambient(scene):
        return AmbientPlan((DARK,))
    blind = (UNREACHABLE,) if _is_blind(world, scene) else ()
    if shares is None:
        return AmbientPlan((LAMPS, SWITCHED_OFF, *blind))
    share, error = shares[ONWARD]
    effect = shares[EFFECT][0] if EFFECT in shares else None
    step = TransportStep(
        "ambient", ONWARD, True, "pilot" if settings.transport == "auto" else "requested", share, error
    )
    if effect is not None and settings.goal is not None:
        step = replace(step, moves=effect * settings.goal.depth)
    # more light, however even, is more noise
    if settings.transport == "auto" and share + 2.0 * error <= settings.negligible and (effect or 0.0) <= 1.0:
        return AmbientPlan((LAMPS, replace(step, computed=False, reason="negligible"), *blind))
    return AmbientPlan((LAMPS, step, *blind), settings.max_bounces)


def onward_share(placed: PlacedScene, most: int | None = None, run: Run = Run()) -> tuple[float, float]:
    """Light by way of two surfaces and more over that by way of one, in the image, and its standard error.

    most: surfaces that it may meet. The lights themselves, where they are seen, count for nothing. Infinite: nothing
    comes by way of one surface. Raises Cancelled.
    """
    camera, own = placed.camera, run.shifted(PILOT_SEED).seed
    view = camera.view(placed.T_world_camera)
    draw = np.random.default_rng(own).integers(camera.width * camera.height, size=GROUPS * GROUP_PIXELS)
    sums = []
    # the same numbers each time, so that what is common to all is the same to the last bit
    for surfaces in (0, 1, most):
        paths = camera_paths(placed.world, placed.scene, view, surfaces=surfaces, seed=own)
        total = np.zeros((2 * len(draw), 4))
        first = np.zeros((len(draw), 2), np.int32)
        count = np.full_like(first, PIXEL_SAMPLES)
        paths.add(draw.astype(np.int32), first, count, Film(total, np.zeros(2)), run.cancelled)
        sums.append(total[:, :3].reshape(GROUPS, -1).sum(axis=1))
    seen, once, all_of_it = sums
    known, onward = once - seen, np.maximum(all_of_it - once, 0.0)
    if known.sum() <= 0.0:
        return (math.inf, 0.0) if onward.sum() > 0.0 else (0.0, 0.0)
    share = float(onward.sum() / known.sum())
    spread = float(np.sum((onward - share * known) ** 2)) * GROUPS / (GROUPS - 1)
    return share, math.sqrt(spread) / float(known.sum())


def onward_effect(placed: PlacedScene, importance: Importance, most: int | None = None, run: Run = Run()) -> float:
    """How far light by way of two surfaces and more moves lines, over what is allowed: all but the twentieth that may
    miss a goal, by no more. most: surfaces that it may meet. Raises Cancelled.

    The product of what both halves of a few samples say is the square of that, without the variance of either.
    """
    camera, own = placed.camera, run.shifted(PILOT_SEED).seed
    view, quiet, found = camera.view(placed.T_world_camera), replace(run, progress=ignore), [0.0]
    for move in importance.ambient_moves:
        on = np.flatnonzero(move)
        line = on // camera.width if importance.axis == "rows" else on % camera.width
        lit = np.unique(line)
        if not len(lit):
            continue
        some = np.isin(line, lit[:: -(-len(lit) // EFFECT_LINES)])
        pixels: Int = on[some].astype(np.int32)
        keys: Int = line[some].astype(np.int32)
        light = []
        # the same numbers both times, and on all pixels of a line
        for surfaces in (1, most):
            film = PixelSamples(pixels)
            paths = camera_paths(placed.world, placed.scene, view, surfaces=surfaces, seed=own)
            film.add(paths, pixels, np.full((len(pixels), 2), EFFECT_SAMPLES, np.int32), quiet, Draws(keys))
            light.append(film.means())
        onward = (light[1] - light[0]) * move.ravel()[pixels, None, None]
        moved = np.array([np.bincount(keys, part) for part in onward.reshape(len(pixels), -1).T]).reshape(2, 3, -1)
        squares = (moved[0] * moved[1])[:, np.unique(keys)]
        found.append(math.sqrt(max(known_below(uniform_filter1d(squares, EFFECT_POOLED, axis=1).max(axis=0)), 0.0)))
    return max(found)


def _is_blind(world: World, scene: Scene) -> bool:
    """A point lamp may be seen by way of polished glass, which no path from the camera finds."""
    rows = world.surface.rows
    polished = np.any((rows[:, 0] == DIELECTRIC) & (np.maximum(rows[:, 1], rows[:, 2]) < SPECULAR_ROUGHNESS))
    return bool(polished) and any(isinstance(light, PointLight) for light in scene.lights)
