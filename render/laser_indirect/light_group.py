"""The indirect light of all lasers, as one of a frame's light groups."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from render.base.arrays import Float32
from render.frame import Estimate, Frame
from render.importance import Importance
from render.laser_indirect.integrator import Aim, IndirectImage, indirect_images
from render.laser_indirect.line_goal import LOOK_SIGMA
from render.laser_indirect.line_sums import smoothed
from render.laser_indirect.path_vertex import INTERREFLECTION
from render.laser_indirect.transport_plan import SWITCHED_OFF, IndirectPlan, pilot_shares, plan_of
from render.light_group import LightGroup, Shares
from render.plan import GroupQuality, TransportStep
from render.run import Run
from render.scene.scene import Scene
from render.scene.settings import RenderSettings
from render.world.placed import PlacedScene
from render.world.world import World

ROOT_SECOND = 3.5
"""s^(1/2), of seconds over the root of the pilot's: where a pilot takes long, behind glass or of many pixels, the light
takes longer, but not by as much. Chosen on the ready-made projects, from which single renders are off by a
factor of 1.5 (standard deviation of the logarithm 0.4)."""


class IndirectLight(LightGroup[IndirectPlan]):
    """Light of the lasers that met two or more surfaces."""

    group = "indirect"
    field = "laser_indirect"
    stage = "reflected laser light"

    def expected(self, scene: Scene, settings: RenderSettings) -> tuple[TransportStep, ...]:
        match settings.transport:
            case "direct":
                return (SWITCHED_OFF,)
            case "auto":
                return (TransportStep("indirect", "indirect", None, "pilot"),)
            case name:
                return (TransportStep("indirect", name, True, "requested"),)

    def work(self, scene: Scene, settings: RenderSettings) -> float:
        """Next to none where there is nothing to reflect on, dozens of rays a pixel where there is."""
        return 8.0 * scene.camera.width * scene.camera.height

    def parts(self, scene: Scene) -> int:
        return len(scene.lasers)

    def measures(self, scene: Scene, settings: RenderSettings) -> bool:
        return settings.transport != "direct"

    def measured(self, placed: PlacedScene, settings: RenderSettings, frame: Frame, run: Run) -> Shares:
        """Of each kind, over the direct light of the frame; with a goal also its effect on the line."""
        return pilot_shares(placed, frame.laser_direct, run, frame.importance if settings.goal is not None else None)

    def foretold(self, pilot_seconds: float, scene: Scene) -> float:
        return ROOT_SECOND * math.sqrt(pilot_seconds)

    def plan(self, shares: Shares | None, world: World, scene: Scene, settings: RenderSettings) -> IndirectPlan:
        return IndirectPlan((SWITCHED_OFF,)) if shares is None else plan_of(shares, settings)

    def mark(self, plan: IndirectPlan) -> str:
        return f"laser light {plan.kinds}"

    def estimates(
        self, placed: PlacedScene, settings: RenderSettings, plan: IndirectPlan, frame: Frame, run: Run
    ) -> Iterator[Estimate]:
        """(h, w) radiance of each laser, dark until its turn."""
        count = len(placed.lasers) if plan.kinds is not None else 0
        images = [np.zeros((placed.camera.height, placed.camera.width), np.float32)] * count
        quality: list[GroupQuality] = []
        for i, laser in enumerate(placed.lasers[:count]):
            part = replace(run.between(i / count, (i + 1) / count).shifted(i), part=f"laser {i}")
            aim = _aim(i, images, frame, run)
            for image in indirect_images(
                laser,
                target=settings.indirect_error,
                most_paths=settings.light_paths,
                kinds=plan.kinds or INTERREFLECTION,
                clamp=settings.laser_clamp,
                left=count - i,
                aim=aim,
                run=part,
            ):
                images[i] = image.radiance
                allowed = None if aim is None else aim.importance.allowed
                quality[i:] = [quality_of(laser.laser.name, image, settings, allowed, frame.laser_direct[i])]
                yield Estimate(tuple(images), tuple(quality))
        if frame.importance is not None and run.teaches:
            run.teach(self.field, tuple(smoothed(image, LOOK_SIGMA) for image in images))


def _aim(laser: int, images: list[Float32], frame: Frame, run: Run) -> Aim | None:
    """Where errors of a laser's light matter; None: everywhere alike."""
    goal, importance = run.goal, frame.importance
    if goal is None or importance is None:
        return None

    def weigh(light: Float32) -> Importance:
        reflected = (*images[:laser], light, *images[laser + 1 :])
        return goal(replace(frame, laser_indirect=reflected))

    return Aim(laser, importance, weigh)


def quality_of(
    laser: str, image: IndirectImage, settings: RenderSettings, allowed: float | None, direct: Float32
) -> GroupQuality:
    """How well one laser's indirect light is known, and what share of its direct light it is.

    allowed: deviation that it may add to a line, over the line's own sigma; None: its goal is the image.
    """
    clamped = settings.laser_clamp is not None
    known = float(direct.sum(dtype=np.float64))
    return GroupQuality(
        "indirect",
        laser,
        image.error if allowed is None else image.line_deviation * allowed,
        settings.indirect_error if allowed is None else allowed,
        image.paths,
        "light paths",
        settings.light_paths,
        of="image" if allowed is None else "line",
        image_error=None if allowed is None else image.error,
        image_target=None if allowed is None else settings.indirect_error,
        spread=image.spread,
        lines=image.lines,
        unknown=image.unknown,
        out_of_reach=image.out_of_reach,
        invalid=image.invalid,
        clamped=image.clamped if clamped else None,
        clamped_radiance=image.clamped_radiance if clamped else None,
        share=float(image.radiance.sum(dtype=np.float64)) / known if known > 0.0 else None,
    )
