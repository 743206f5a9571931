"""What the light groups of a frame have in common: a plan, work, and estimates that get better.

To add one: section 11 of `render/README.md`.
"""

from __future__ import annotations

import time
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

    def foretold(self, pilot_seconds: float, scene: Scene) -> float:
        """Processor seconds of this light in a frame that is rendered for the line, about: by those of its
        pilot, which are part of them."""
        return 0.0

    def plan(self, shares: Shares | None, world: World, scene: Scene, settings: RenderSettings) -> P:
        """What is computed, given what a pilot found; None: there was none."""

    def mark(self, plan: P) -> str:
        """What of a plan decides numbers; empty: nothing."""
        return ""


def chosen_plan(
    group: LightGroup[P], placed: PlacedScene, settings: RenderSettings, frame: Frame, run: Run = Run()
) -> tuple[P, float]:
    """The plan of one frame by itself, after a pilot where there is to be one, and the processor seconds that this
    foretells; 0: none did. Raises Cancelled."""
    if not group.measures(placed.scene, settings):
        return group.plan(None, placed.world, placed.scene, settings), 0.0
    shares, seconds = timed_pilot(group, placed, settings, frame, run)
    chosen = group.plan(shares, placed.world, placed.scene, settings)
    return chosen, seconds_of(group, chosen, seconds, frame, placed.scene)


def seconds_of(group: LightGroup[P], plan: P, pilot_seconds: float, frame: Frame, scene: Scene) -> float:
    """Processor seconds that a pilot foretells; 0: none are left, or nothing is known of what the image is the goal
    of."""
    if frame.importance is None or not any(step.computed for step in plan.steps):
        return 0.0
    return group.foretold(pilot_seconds, scene)


def timed_pilot(
    group: LightGroup[P], placed: PlacedScene, settings: RenderSettings, frame: Frame, run: Run
) -> tuple[Shares, float]:
    """What a pilot finds, and its processor seconds. Raises Cancelled."""
    began = time.process_time()
    return group.measured(placed, settings, frame, run), time.process_time() - began


def has_work(group: LightGroup[P], scene: Scene, settings: RenderSettings) -> bool:
    """Some of its steps are computed, or may be."""
    return any(step.computed is not False for step in group.expected(scene, settings))
