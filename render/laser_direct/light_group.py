"""The direct light of all lasers, as one of a frame's light groups."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from render.frame import Estimate, Frame
from render.importance import Importance, known_below
from render.laser_direct.integrator import DirectImage, direct_image
from render.light_group import LightGroup, Shares
from render.plan import GroupPlan, GroupQuality, TransportStep
from render.run import Run
from render.scene.scene import Scene
from render.scene.settings import RenderSettings
from render.world.placed import PlacedLaser, PlacedScene
from render.world.world import World

QUICK_ERROR = 0.05
"""Relative error of a first frame, and of the direct light that a pilot's errors are compared with."""
FINER, ROUNDS, FINEST = 4.0, 4, 1e-5
"""Most by which a round makes the target finer where the lines ask for it, rounds, and the finest target."""


@dataclass(frozen=True)
class DirectLight(LightGroup[GroupPlan]):
    """Light that met one surface, exact across the sheet, sampled across edges and shadows."""

    quick: bool = False
    """Render to `QUICK_ERROR` only, for a first frame."""
    aimed: bool = False
    """Render until the lines are known well enough, by what the frame says of where errors matter."""

    group = "direct"
    field = "laser_direct"
    stage = "laser light"

    def expected(self, scene: Scene, settings: RenderSettings) -> tuple[TransportStep, ...]:
        return (TransportStep("direct", "direct", True, "always"),)

    def plan(self, shares: Shares | None, world: World, scene: Scene, settings: RenderSettings) -> GroupPlan:
        return GroupPlan(self.expected(scene, settings))

    def work(self, scene: Scene, settings: RenderSettings) -> float:
        """Estimated rays: four a pixel for a line that covers a twentieth of the image, more for a finer target."""
        if self.aimed:
            return 0.0
        pixels, target = scene.camera.width * scene.camera.height, self._target(settings)
        return 0.2 * pixels * len(scene.lasers) * (1.0 + 0.2 * math.log2(max(1.0, QUICK_ERROR / target)))

    def estimates(
        self, placed: PlacedScene, settings: RenderSettings, plan: GroupPlan, frame: Frame, run: Run
    ) -> Iterator[Estimate]:
        """One estimate: (h, w) radiance of each laser."""
        images, count, target = [], len(placed.lasers), self._target(settings)
        for i, laser in enumerate(placed.lasers):
            part = run.between(i / count, (i + 1) / count).shifted(i)
            if self.aimed and frame.importance is not None:
                images.append(known_lines(laser, target, frame.importance, i, part))
            else:
                images.append(first_image(laser, target, i, part))
        importance = frame.importance if self.aimed else None
        quality = [
            quality_of(laser.name, image, settings, importance, i)
            for i, (laser, image) in enumerate(zip(placed.scene.lasers, images, strict=True))
        ]
        yield Estimate(tuple(image.radiance for image in images), tuple(quality))

    def _target(self, settings: RenderSettings) -> float:
        return QUICK_ERROR if self.quick else settings.laser_error


def first_image(placed: PlacedLaser, target: float, number: int, run: Run) -> DirectImage:
    """The image to a target; what the run's memory holds of it, where lines are asked for after the image. Raises
    Cancelled."""
    world, camera, laser, *poses = placed
    made_of = camera, laser, *(pose.tobytes() for pose in poses), target, run.seed
    image: DirectImage | None = run.recall(f"laser {number}, direct", world, made_of)
    if image is None:
        image = direct_image(*placed, target=target, run=run)
        run.leave(f"laser {number}, direct", world, made_of, image)
    return image


def known_lines(placed: PlacedLaser, target: float, importance: Importance, laser: int, run: Run) -> DirectImage:
    """The image whose lines are known as well as direct light's share of the goal asks, to the target at least; or the
    finest that edges allow. Raises Cancelled."""
    image = first_image(placed, target, laser, run)
    for _ in range(ROUNDS):
        over = line_deviation(image, importance, laser) / importance.direct
        target = min(target, image.error)
        if over <= 1.0 or target <= FINEST:
            break
        target = max(target / min(1.1 * over, FINER), FINEST)
        finer = direct_image(*placed, target=target, run=run)
        divided, image = finer.samples > image.samples, finer
        if not divided:
            break
    return image


def line_deviation(image: DirectImage, importance: Importance, laser: int) -> float:
    """By how much the error of the image moves `LINES_KNOWN` of the lines at most, over their own sigma."""
    return known_below(importance.line_deviations(laser, image.reached, image.known_error))


def quality_of(
    laser: str, image: DirectImage, settings: RenderSettings, importance: Importance | None = None, index: int = 0
) -> GroupQuality:
    """How well one laser's direct light is known; its target is that of the last image, not of a quick one.

    importance: where errors of the light of laser number `index` matter, once the line is the goal.
    """
    deviations = (
        np.zeros(0) if importance is None else importance.line_deviations(index, image.reached, image.known_error)
    )
    return GroupQuality(
        "direct",
        laser,
        image.error if importance is None else known_below(deviations),
        settings.laser_error if importance is None else importance.direct,
        image.samples,
        "samples",
        of="image" if importance is None else "line",
        image_error=None if importance is None else image.error,
        lines=None if importance is None else len(deviations),
        unknown=None if importance is None else int(np.sum(deviations > importance.direct)),
        invalid=image.invalid,
        lit_pixels=image.pixels,
    )
