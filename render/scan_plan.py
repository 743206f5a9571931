"""One plan of the light for all frames of a scan: decided beforehand, on frames spread over it.

Frames that decide alone would differ where a share is about the negligible one, and with them their errors.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from render.ambient.transport_plan import AmbientPlan, ambient_plan_of, has_ambient, onward_share
from render.base.threads import Cancel, Progress
from render.laser_direct.integrator import direct_image
from render.laser_indirect.transport_plan import TRANSPORT_STEPS, Plan, direct_plan, pilot_shares, plan_of
from render.scene.scene import Scene
from render.scene.settings import RenderSettings
from render.world.world import World

FRAMES = 5
"""Frames that are looked at."""
DIRECT_ERROR = 0.05
"""Relative error of the direct light that shares are told of: far below their own."""


@dataclass(frozen=True)
class ScanPlan:
    """What every frame of a scan computes."""

    light: Plan
    ambient: AmbientPlan

    @property
    def mark(self) -> str:
        """What of it decides a frame's numbers."""
        return f"laser light {self.light.kinds}, ambient light {self.ambient.surfaces}"


def looked_at(frame_count: int) -> tuple[int, ...]:
    """The steps on which a plan is decided: the first, the last, and some evenly between."""
    return tuple(np.linspace(0, frame_count - 1, min(frame_count, FRAMES)).astype(int).tolist())


def plan_scan(
    scene: Scene,
    settings: RenderSettings,
    world: Callable[[int], World],
    *,
    seed: int = 0,
    threads: int | None = None,
    cancelled: Cancel | None = None,
    progress: Progress = lambda done: None,
) -> ScanPlan | None:
    """The plan for all steps of a scan, however many of them are rendered; None: one frame decides for itself.

    world: that of a step. Of each kind of light the largest share counts that a pilot finds on any of the steps. The
    same on any number of threads. Raises Cancelled.
    """
    steps = looked_at(scene.frame_count)
    if len(steps) == 1:
        return None
    if settings.transport == "direct":
        return ScanPlan(direct_plan(scene), ambient_plan_of(None, world(0), scene, settings))
    shares, onward = [], []
    for i, step in enumerate(steps):
        here = world(step)
        direct = tuple(
            direct_image(
                here,
                scene.camera,
                laser,
                scene.T_world_camera(step),
                scene.T_world_laser(k, step),
                target=DIRECT_ERROR,
                seed=seed + k,
                threads=threads,
                cancelled=cancelled,
            ).radiance
            for k, laser in enumerate(scene.lasers)
        )
        progress((i + 0.5) / len(steps))
        shares.append(pilot_shares(here, scene, direct, step=step, seed=seed, cancelled=cancelled))
        if has_ambient(scene):
            found = onward_share(here, scene, settings.max_bounces, step=step, seed=seed, cancelled=cancelled)
            onward.append(found)
        progress((i + 1.0) / len(steps))
    largest = {
        transport.share: max((one[transport.share] for one in shares), key=_at_most) for transport in TRANSPORT_STEPS
    }
    light = plan_of(largest, scene, settings)
    said = (
        f"the same for all {scene.frame_count} frames: pilots on the steps {', '.join(map(str, steps))}, of which the "
        "largest share counts"
    )
    ambient = ambient_plan_of(max(onward, key=_at_most, default=None), world(0), scene, settings)
    return ScanPlan(replace(light, lines=(*light.lines, said)), ambient)


def _at_most(share: tuple[float, float]) -> float:
    """As `plan_of` judges it."""
    return share[0] + 2.0 * share[1]
