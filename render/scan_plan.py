"""One plan of the light for all frames of a scan: decided beforehand, on frames spread over it.

Frames that decide alone would differ where a share is about the negligible one, and with them their errors.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from render.frame import Frame
from render.light_group import LightGroup, Shares, seconds_of, timed_pilot
from render.plan import GroupPlan
from render.products import PRODUCTS, QUICK, ambient_look, expected_plan
from render.run import Run, ignore
from render.scene.scene import Scene
from render.scene.settings import RenderSettings
from render.world.placed import PlacedScene
from render.world.world import World

FRAMES = 5
"""Frames on which pilots run."""


@dataclass(frozen=True)
class ScanPlan:
    """What every frame of a scan computes."""

    plans: Mapping[str, GroupPlan]
    """By light group."""
    pilot_steps: tuple[int, ...] = ()
    """Steps of the scan on which pilots decided."""
    frame_count: int = 1
    foretold: Mapping[str, float] = field(default_factory=dict)
    """Processor seconds of a frame by light group, as the pilots tell (`LightGroup.foretold`)."""

    @property
    def mark(self) -> str:
        """What of it decides a frame's numbers."""
        marks = (product.mark(self.plans[product.group]) for product in PRODUCTS)
        return ", ".join(mark for mark in marks if mark)


def pilot_steps(frame_count: int) -> tuple[int, ...]:
    """The steps on which a plan is decided: the first, the last, and some evenly between."""
    return tuple(np.linspace(0, frame_count - 1, min(frame_count, FRAMES)).astype(int).tolist())


def plan_scan(
    scene: Scene, settings: RenderSettings, world: Callable[[int], World], run: Run = Run()
) -> ScanPlan | None:
    """The plan for all steps of a scan, however many of them are rendered; None: one frame decides for itself.

    world: that of a step. Of each kind of light the largest share counts that a pilot finds on any of the steps. The
    same on any number of threads. Raises Cancelled.
    """
    steps = pilot_steps(scene.frame_count)
    if len(steps) == 1:
        return None
    deciding = [product for product in PRODUCTS if product.measures(scene, settings)]
    found: dict[str, list[Shares]] = {product.group: [] for product in deciding}
    foretold = dict.fromkeys(found, 0.0)
    for i, step in enumerate(steps if deciding else ()):
        part = run.between(i / len(steps), (i + 1) / len(steps))
        for group, (shares, spent) in _pilots(deciding, PlacedScene(world(step), scene, step), settings, part).items():
            found[group].append(shares)
            foretold[group] += spent / len(steps)
    plans = {
        product.group: product.plan(_largest(found.get(product.group, [])), world(0), scene, settings)
        for product in PRODUCTS
    }
    told = {group: seconds for group, seconds in foretold.items() if seconds > 0.0}
    return ScanPlan(plans, steps if deciding else (), scene.frame_count, told)


def _pilots(
    deciding: list[LightGroup[Any]], placed: PlacedScene, settings: RenderSettings, run: Run
) -> dict[str, tuple[Shares, float]]:
    """What the pilots find on one step, and the seconds that they foretell; 0: none."""
    quiet = replace(run, progress=ignore)
    frame = Frame(placed.step, (), None, (), None)
    for estimate in QUICK.estimates(placed, settings, GroupPlan(()), frame, quiet):
        frame = frame.with_estimate(QUICK.field, estimate)
    if run.goal is not None and settings.goal is not None and placed.lasers:
        look = ambient_look(placed, settings, quiet)
        expected = replace(frame, ambient=look, plan=expected_plan(placed.scene, settings))
        frame = replace(frame, importance=run.goal(expected))
    run.progress(0.5)
    found = {}
    for product in deciding:
        shares, seconds = timed_pilot(product, placed, settings, frame, quiet)
        chosen = product.plan(shares, placed.world, placed.scene, settings)
        found[product.group] = shares, seconds_of(product, chosen, seconds, frame, placed.scene)
    run.progress(1.0)
    return found


def _largest(found: list[Shares]) -> Shares | None:
    """Of each kind the largest that it may well be, by its standard error; None: nothing was measured."""
    if not found:
        return None
    return {kind: max((shares[kind] for shares in found), key=lambda one: one[0] + 2.0 * one[1]) for kind in found[0]}
