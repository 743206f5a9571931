"""Ambient light, as one of a frame's light groups."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from render.ambient.integrator import AmbientImage
from render.ambient.measured_light import image_light, measured_images, seen_from
from render.ambient.transport_plan import (
    DARK,
    EFFECT,
    LAMPS,
    ONWARD,
    SWITCHED_OFF,
    AmbientPlan,
    has_ambient,
    onward_effect,
    onward_share,
    plan_of,
)
from render.frame import Estimate, Frame
from render.importance import Importance
from render.light_group import LightGroup, Shares
from render.plan import GroupQuality, TransportStep
from render.run import Run
from render.scene.scene import Scene
from render.scene.settings import RenderSettings
from render.world.placed import PlacedScene
from render.world.world import World

PILOTS, PILOTS_A_MEGAPIXEL = 4.0, 2.2
"""How often its pilot's time this light takes for the line in a small image, and for each million pixels. Chosen on the
ready-made projects, from which single renders are off by a factor of 1.5."""


class AmbientLight(LightGroup[AmbientPlan]):
    """Light of lamps, surroundings and shining objects."""

    group = "ambient"
    field = "ambient"
    stage = "ambient light"

    def expected(self, scene: Scene, settings: RenderSettings) -> tuple[TransportStep, ...]:
        if not has_ambient(scene):
            return (DARK,)
        match settings.transport:
            case "direct":
                return LAMPS, SWITCHED_OFF
            case "auto":
                return LAMPS, TransportStep("ambient", ONWARD, None, "pilot")
            case _:
                return LAMPS, TransportStep("ambient", ONWARD, True, "requested")

    def work(self, scene: Scene, settings: RenderSettings) -> float:
        """A camera ray and two more a sample; it ends before that where the error is reached."""
        return 3.0 * scene.camera.width * scene.camera.height * settings.ambient_samples

    def parts(self, scene: Scene) -> int:
        return 1

    def measures(self, scene: Scene, settings: RenderSettings) -> bool:
        return settings.transport != "direct" and has_ambient(scene)

    def measured(self, placed: PlacedScene, settings: RenderSettings, frame: Frame, run: Run) -> Shares:
        """Light that goes on over that by way of one surface; with a goal also what it does to the line."""
        shares: Shares = {ONWARD: onward_share(placed, settings.max_bounces, run)}
        if settings.goal is not None and frame.importance is not None:
            shares[EFFECT] = onward_effect(placed, frame.importance, settings.max_bounces, run), 0.0
        return shares

    def foretold(self, pilot_seconds: float, scene: Scene) -> float:
        """The pilot is as long for any image, the light is not."""
        return (PILOTS + PILOTS_A_MEGAPIXEL * 1e-6 * scene.camera.width * scene.camera.height) * pilot_seconds

    def plan(self, shares: Shares | None, world: World, scene: Scene, settings: RenderSettings) -> AmbientPlan:
        return plan_of(shares, world, scene, settings)

    def mark(self, plan: AmbientPlan) -> str:
        return f"ambient light {plan.surfaces}"

    def estimates(
        self, placed: PlacedScene, settings: RenderSettings, plan: AmbientPlan, frame: Frame, run: Run
    ) -> Iterator[Estimate]:
        """(h, w, 3) radiance in the bands R, G, B; to the goal of the frame's importance, where it has one."""
        most, importance, target = settings.ambient_samples, frame.importance, settings.ambient_error
        how: dict[str, Any] = {"most": most, "surfaces": plan.surfaces, "clamp": settings.clamp}

        def images(part: Run) -> Iterator[AmbientImage]:
            if importance is not None:
                yield from measured_images(placed, importance, **how, target=target, run=part)
                return
            made_of = seen_from(placed, target, *how.values(), run.seed)
            kept = run.recall(self.field, placed.world, made_of)
            if kept is not None:
                yield kept
                return
            for image in image_light(placed, target=target, **how, run=part):
                yield image
            run.leave(self.field, placed.world, made_of, image, for_others=True)

        for image in replace(run, part="ambient").until_over(images):
            run.teach(self.field, image.radiance)
            yield Estimate(image.radiance, (quality_of(image, settings, importance),))


def quality_of(image: AmbientImage, settings: RenderSettings, importance: Importance | None = None) -> GroupQuality:
    """How well the ambient light is known; its error is not, after a single sample. importance: where errors matter."""
    clamped = settings.clamp is not None
    allowed = None if importance is None or image.coarse_error is None else importance.allowed
    return GroupQuality(
        "ambient",
        None,
        image.error if allowed is None else image.error * allowed,
        settings.ambient_error if allowed is None else allowed,
        image.samples,
        "samples a pixel",
        settings.ambient_samples,
        of="image" if allowed is None else "line",
        invalid=image.invalid,
        clamped=image.clamped if clamped else None,
        clamped_radiance=image.clamped_radiance if clamped else None,
        lines=image.lines,
        unknown=image.unknown,
        coarse_error=image.coarse_error,
    )
