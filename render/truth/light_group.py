"""The exact truth of every pixel, as one of the parts of a frame that are rendered in turn."""

from __future__ import annotations

from collections.abc import Iterator

from render.frame import Estimate, Frame
from render.light_group import LightGroup, Shares
from render.plan import GroupPlan, TransportStep
from render.run import Run
from render.scene.scene import Scene
from render.scene.settings import RenderSettings
from render.truth.pixel_truth import truth_images
from render.world.placed import PlacedScene
from render.world.world import World


class PixelTruth(LightGroup[GroupPlan]):
    """Depth, position, normal and object at every pixel's centre."""

    group = "truth"
    field = "truth"
    stage = "truth images"

    def expected(self, scene: Scene, settings: RenderSettings) -> tuple[TransportStep, ...]:
        wanted = settings.truth_images
        return (TransportStep("truth", "pixels", wanted, "always" if wanted else "switched off"),)

    def plan(self, shares: Shares | None, world: World, scene: Scene, settings: RenderSettings) -> GroupPlan:
        return GroupPlan(self.expected(scene, settings))

    def work(self, scene: Scene, settings: RenderSettings) -> float:
        """Number of rays: one a pixel."""
        return float(scene.camera.width * scene.camera.height)

    def estimates(
        self, placed: PlacedScene, settings: RenderSettings, plan: GroupPlan, frame: Frame, run: Run
    ) -> Iterator[Estimate]:
        """One estimate, which is exact."""
        yield Estimate(truth_images(placed.world, placed.camera, placed.T_world_camera, run))
