"""What the light groups of a frame have in common: a plan, work, and estimates that get better.

To add one: section 11 of `render/README.md`.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Generic, Protocol, TypeVar

from render.frame import Estimate, Frame
from render.plan import GroupPlan, TransportStep
from render.run import Run
from render.scene.scene import Scene
from render.scene.settings import RenderSettings
from render.world.placed import PlacedScene
from render.world.world import World

Shares = dict[str, tuple[float, float]]
"""By kind of light, what a pilot found of it over what is computed anyhow, with its standard error."""
P = TypeVar("P", bound=GroupPlan)


class LightGroup(Protocol, Generic[P]):
    """A product of the renderer: one field of a `Frame`.

    Where no pilot decides, what has a value here stays as it is. To add one: `render/README.md`.
    """

    group: str
    """Of its steps in the plan."""
    field: str
    """Of `Frame`."""
    stage: str
    """Its name in progress and wall times."""

    def expected(self, scene: Scene, settings: RenderSettings) -> tuple[TransportStep, ...]:
        """The steps of the plan before anything is measured; where all are left out, the group has nothing to do."""

    def work(self, scene: Scene, settings: RenderSettings) -> float:
        """About how many rays it takes."""

    def estimates(
        self, placed: PlacedScene, settings: RenderSettings, plan: P, frame: Frame, run: Run
    ) -> Iterator[Estimate]:
        """Ever better values of the field; frame: with the groups before it. Raises Cancelled."""

    def parts(self, scene: Scene) -> int:
        """Images that have an equal share of the time of a frame each; 0: it takes what it needs."""
        return 0

    def measures(self, scene: Scene, settings: RenderSettings) -> bool:
        """A pilot is to decide, or to measure the share of what was requested."""
        return False

    def measured(self, placed: PlacedScene, settings: RenderSettings, frame: Frame, run: Run) -> Shares:
        """What a pilot finds, where `measures`. frame: with the groups before it. Raises Cancelled."""
        return {}

    def plan(self, shares: Shares | None, world: World, scene: Scene, settings: RenderSettings) -> P:
        """What is computed, given what a pilot found; None: there was none."""

    def mark(self, plan: P) -> str:
        """What of a plan decides numbers; empty: nothing."""
        return ""


def chosen_plan(
    group: LightGroup[P], placed: PlacedScene, settings: RenderSettings, frame: Frame, run: Run = Run()
) -> P:
    """The plan of one frame by itself, after a pilot where there is to be one. Raises Cancelled."""
    measures = group.measures(placed.scene, settings)
    shares = group.measured(placed, settings, frame, run) if measures else None
    return group.plan(shares, placed.world, placed.scene, settings)


def has_work(group: LightGroup[P], scene: Scene, settings: RenderSettings) -> bool:
    """Some of its steps are computed, or may be."""
    return any(step.computed is not False for step in group.expected(scene, settings))
