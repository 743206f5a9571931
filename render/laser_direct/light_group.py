"""The direct light of all lasers, as one of a frame's light groups."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from render.frame import Estimate, Frame
from render.laser_direct.integrator import DirectImage, direct_image
from render.light_group import LightGroup, Shares
from render.plan import GroupPlan, GroupQuality, TransportStep
from render.run import Run
from render.scene.scene import Scene
from render.scene.settings import RenderSettings
from render.world.placed import PlacedScene
from render.world.world import World

QUICK_ERROR = 0.05
"""Relative error of a first frame, and of the direct light that a pilot's errors are compared with."""


@dataclass(frozen=True)
class DirectLight(LightGroup[GroupPlan]):
    """Light that met one surface, exact across the sheet, sampled across edges and shadows."""

    quick: bool = False
    """Render to `QUICK_ERROR` only, for a first frame."""

    group = "direct"
    field = "laser_direct"
    stage = "laser light"

    def expected(self, scene: Scene, settings: RenderSettings) -> tuple[TransportStep, ...]:
        return (TransportStep("direct", "direct", True, "always"),)

    def plan(self, shares: Shares | None, world: World, scene: Scene, settings: RenderSettings) -> GroupPlan:
        return GroupPlan(self.expected(scene, settings))

    def work(self, scene: Scene, settings: RenderSettings) -> float:
        """Estimated rays: four a pixel for a line that covers a twentieth of the image, more for a finer target."""
        pixels, target = scene.camera.width * scene.camera.height, self._target(settings)
        return 0.2 * pixels * len(scene.lasers) * (1.0 + 0.2 * math.log2(max(1.0, QUICK_ERROR / target)))

    def estimates(
        self, placed: PlacedScene, settings: RenderSettings, plan: GroupPlan, frame: Frame, run: Run
    ) -> Iterator[Estimate]:
        """One estimate: (h, w) radiance of each laser."""
        images, count, target = [], len(placed.lasers), self._target(settings)
        for i, laser in enumerate(placed.lasers):
            part = run.between(i / count, (i + 1) / count).shifted(i)
            images.append(direct_image(*laser, target=target, run=part))
        quality = [
            quality_of(laser.name, image, settings) for laser, image in zip(placed.scene.lasers, images, strict=True)
        ]
        yield Estimate(tuple(image.radiance for image in images), tuple(quality))

    def _target(self, settings: RenderSettings) -> float:
        return QUICK_ERROR if self.quick else settings.laser_error


def quality_of(laser: str, image: DirectImage, settings: RenderSettings) -> GroupQuality:
    """How well one laser's direct light is known; its target is that of the last image, not of a quick one."""
    return GroupQuality(
        "direct",
        laser,
        image.error,
        settings.laser_error,
        image.samples,
        "samples",
        invalid=image.invalid,
        lit_pixels=image.pixels,
    )
