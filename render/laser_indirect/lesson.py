"""What a laser's reflected light in one frame tells of it in others that are much like it: where to look, how often.

Light and errors are each frame's own. What is taught only guides, as what earlier passes have found does.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from render.base.arrays import Bool, Float, Float32
from render.importance import Importance
from render.laser_indirect.accumulator import PASSES_A_WAVE, Accumulator
from render.laser_indirect.guiding import Guide
from render.laser_indirect.line_goal import margin_of
from render.laser_indirect.line_paths import PathDemand
from render.laser_indirect.photon_emission import FAN_BINS, UNIFORM_FRACTION, FanDistribution

SIZES = (1, 1, 2)
"""Of the waves after which the goal is to be met, in that of the first: with one or two, the spread of their few passes
says too little of the error."""
LEAST_PASS, MOST_PASS = 1 << 8, 1 << 14
"""Light paths in a pass of the first wave."""
AIMED_AT = 0.85
"""Of what a line may be off: a little more than is needed, as another wave would double the work."""


@dataclass(frozen=True)
class ReflectedLesson:
    """What passes of a frame have learnt."""

    fan: FanDistribution
    guide: Guide
    guide_moments: Float
    camera_share: float
    growth_limit: int
    camera_radiance: Float32
    """(pixels,) as `Accumulator.camera_radiance`."""
    demand: PathDemand
    alone: Float
    """(lines,) as `LineErrors.alone`: which lines are alike."""
    size: int
    """Light paths in a pass of a first wave with which waves of `SIZES` would have met the goal."""

    @classmethod
    def of(cls, found: Accumulator) -> ReflectedLesson | None:
        """Of a frame whose light is known; None: it had no line as its goal, or did not reach it."""
        if found.line is None or not found.waves or found.line.out_of_reach:
            return None
        freedom = (PASSES_A_WAVE - 1) * sum(SIZES) ** 2 / sum(size**2 for size in SIZES)
        needed = (
            found.paths * (margin_of(freedom) * found.line_deviation / AIMED_AT) ** 2 / (sum(SIZES) * PASSES_A_WAVE)
        )
        # as many times more of the light paths as a pass has beyond its size
        size = needed * found.size * found.growth / found.next_paths
        return cls(
            found.fan,
            found.guide,
            found.guide_moments.copy(),
            found.camera_share,
            found.growth_limit,
            found.camera_radiance,
            found.demand,
            found.line.alone,
            int(min(max(size, LEAST_PASS), MOST_PASS)),
        )

    def begin(
        self, fan: FanDistribution, kinds: int, specular: Bool, importance: Importance, laser: int
    ) -> Accumulator | None:
        """An empty accumulator of another frame, whose fan is uniform so far; None: its image is another."""
        pixels = len(self.camera_radiance)
        images = np.zeros(pixels, np.float32), np.zeros(pixels), self.camera_radiance.copy()
        if importance.laser[laser].size != pixels:
            return None
        found = Accumulator(
            kinds,
            fan_between(self.fan, fan),
            self.size,
            self.growth_limit,
            self.camera_share,
            specular,
            images[0],
            self.guide,
            self.guide_moments.copy(),
            *images[1:],
        )
        found.aim_at(importance, laser)
        if [found.demand.lines.shape, found.demand.blocks.shape] == [self.demand.lines.shape, self.demand.blocks.shape]:
            found.demand = self._demand(np.any(importance.laser[laser], axis=1 if importance.axis == "rows" else 0))
            found.line = None if found.line is None else replace(found.line, alone=self.alone)
        found.guide_camera(self.camera_radiance, 0.0)
        return found

    def _demand(self, lit: Bool) -> PathDemand:
        """Half as it was learnt, half alike on all lit lines: a few passes tell little of one, and the next frame may
        need most on another."""
        lines = self.demand.lines
        even = float(lines[lit].mean()) if lit.any() else 0.0
        return replace(self.demand, lines=0.5 * (lines + even), size=1.0)


def fan_between(learnt: FanDistribution, other: FanDistribution) -> FanDistribution:
    """A learnt density of photons between the quantiles of another fan, everywhere with a share that stays uniform."""
    if (learnt.low, learnt.high) == (other.low, other.high):
        return learnt
    edges = np.linspace(other.low, other.high, FAN_BINS + 1)
    known = np.interp(edges, np.linspace(learnt.low, learnt.high, FAN_BINS + 1), learnt.cumulative)
    density = np.diff(known)
    if not density.sum() > 0.0:
        return other
    density = (1.0 - UNIFORM_FRACTION) * density / density.sum() + UNIFORM_FRACTION / FAN_BINS
    cumulative = np.concatenate([[0.0], np.cumsum(density)])
    return other._replace(cumulative=cumulative / cumulative[-1])
