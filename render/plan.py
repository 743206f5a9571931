"""What a render computes of the light, what it leaves out and why, and how well each part is known. Data, no sentences.

`analysis.report.light_text` makes sentences of it, for console, window and report.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

Group = Literal["direct", "indirect", "ambient"]
"""A light group: laser light that met one surface, laser light that met more, all other light."""
Reason = Literal[
    "always",
    "requested",
    "not requested",
    "switched off",
    "pilot",
    "negligible",
    "implied",
    "absent",
    "pinhole",
    "sensor",
    "unreachable",
]
"""Why a step is computed or left out. pilot: a pilot decides, or found that it matters; negligible: it found too
little; implied: it comes with a step that is computed; absent: there is none of it; pinhole: the camera has no
aperture; sensor: the developed image has it instead; unreachable: no path from the camera finds it."""


@dataclass(frozen=True)
class TransportStep:
    """One part of the light's way from its source into the image."""

    group: Group | Literal["lens", "truth"]
    name: str
    """"direct", "interreflection", "caustic", "specular-chain", "subsurface", "ambient" ...; "indirect" is all laser
    light over two or more surfaces at once, where nothing tells its kinds apart yet."""
    computed: bool | None
    """None: a pilot is yet to decide."""
    reason: Reason
    share: float | None = None
    """What a pilot measured, over the direct light in the image (ambient: over what one surface reflects); infinite:
    there is none of that. None: not measured."""
    error: float | None = None
    """Standard error of the share."""
    moves: float | None = None
    """With a goal the most that it may well move the line of any row, or add to a peak there, as a pilot found: over
    the line's own sigma. None: not measured."""


@dataclass(frozen=True)
class ThinLens:
    """What a thin lens does to the image."""

    f_number: float
    focus_distance: float | None
    """m; None: far away."""
    aperture: float
    """Diameter, m."""
    tilt: float
    """Between the plane of focus and the plane that faces the camera, rad."""
    blind: float
    """Share of the image where no depth is in focus."""


@dataclass(frozen=True)
class Plan:
    """The steps of a frame, in the order of its light groups, and the settings that bound them."""

    steps: tuple[TransportStep, ...] = ()
    negligible: float | None = None
    """Share of the light below which a pilot leaves a step out."""
    image_size: tuple[int, int] | None = None
    """Width and height, px."""
    ambient_error: float | None = None
    ambient_samples: int | None = None
    max_bounces: int | None = None
    """The most surfaces that ambient light may meet; None: no bound."""
    laser_clamp: float | None = None
    """Most radiance of one pass of a laser's indirect light in a pixel, W/(m^2 sr); biased. None: none."""
    clamp: float | None = None
    """Most that one sample of ambient light over two or more surfaces may add, W/(m^2 sr); biased. None: none."""
    lens: ThinLens | None = None
    """None: a pinhole."""
    pilot_steps: tuple[int, ...] = ()
    """Steps of the scan on which pilots decided for all its frames; empty: this frame's own."""
    frame_count: int = 1
    text: tuple[str, ...] = ()
    """Sentences, of a frame whose file is of a version that knew nothing else."""
    goal: float | None = None
    """What the render's noise may add to the measured line, over the line's own sigma; None: the image is the goal."""

    def of(self, group: str) -> tuple[TransportStep, ...]:
        """The steps of one group."""
        return tuple(step for step in self.steps if step.group == group)

    def step(self, group: str, name: str) -> TransportStep | None:
        """One step; None: the plan does not name it."""
        return next((step for step in self.of(group) if step.name == name), None)

    def with_steps(self, group: str, steps: tuple[TransportStep, ...]) -> Plan:
        """The plan with other steps of a group that has some."""
        first = next(i for i, step in enumerate(self.steps) if step.group == group)
        others = [step for step in self.steps if step.group != group]
        return replace(self, steps=(*others[:first], *steps, *others[first:]))


@dataclass(frozen=True)
class GroupPlan:
    """What one light group computes."""

    steps: tuple[TransportStep, ...]


@dataclass(frozen=True)
class GroupQuality:
    """How well one light group of one laser is known, and what it took."""

    group: Group
    laser: str | None
    """Its name; None: ambient light."""
    error: float
    """Estimated relative RMS error, a fraction; NaN: not known."""
    target: float
    """The error that was requested."""
    work: float
    """In `unit`."""
    unit: Literal["samples", "light paths", "samples a pixel"]
    most: float = math.inf
    """Work at which it ends in any case."""
    invalid: float = 0.0
    """Contributions that were NaN, infinite or negative, and were dropped."""
    clamped: float | None = None
    """Contributions that a clamp lowered, which biases the group; None: there is no clamp."""
    clamped_radiance: float | None = None
    """Radiance that the clamp took away, W/(m^2 sr), mean over the image."""
    lit_pixels: float | None = None
    """Of direct light: the pixels that the laser lights."""
    share: float | None = None
    """Of indirect light: radiance over that of the direct light, both summed over the image; None: there is none."""
    of: Literal["image", "line"] = "image"
    """What error and target are of: the light of the image, or the position of the line measured in it, whose error is
    a standard deviation over that by the sensor's noise."""
    image_error: float | None = None
    """Of the line: the estimated relative RMS error of the image that it takes."""
    image_target: float | None = None
    """Image error at which it ends as well: light of which so much is known may be rendered no further."""
    out_of_reach: bool = False
    """Of the line: its goal would have taken far more work than is allowed, or than the error of the image, which was
    rendered in its place."""
    spread: float | None = None
    """Of indirect light for the line: the share that was spread about its place, as it was a peak beside the line by
    the light of one pass alone; None: it is for the image."""
    lines: int | None = None
    """Of the line: scan lines with a line."""
    unknown: int | None = None
    """Of the line: those of `lines` that this light's noise moves by more than the target, as far as can be told."""
    undecided: int | None = None
    """Of direct light for the line: scan lines in which noise as small as the goal decides between two answers of the
    line extraction, so that another render may find another one; None: not looked at."""
    coarse_error: float | None = None
    """Of ambient light that is rendered for the line: relative RMS error of what is interpolated, where no error
    matters, found on held-out pixels; None: nothing is."""

    @property
    def reached(self) -> bool:
        """The error or the image error is at most its target; else the work or the time that was allowed ended it."""
        image = self.image_error is not None and self.image_target is not None and self.image_error <= self.image_target
        return self.error <= self.target or image

    @property
    def reason(self) -> Literal["target", "work", "unfinished"]:
        """Why it is as it is: the target is reached, all work is spent, or it was stopped, or is under way."""
        if self.reached:
            return "target"
        # direct light ends where no pixel can be divided further; ambient light is counted in whole samples on every
        # tile, so that their mean may be a little off
        allowance = 0.9 if self.group == "ambient" else 1.0
        done = self.group == "direct" or self.work >= allowance * self.most
        return "work" if done else "unfinished"


def line_noise(quality: tuple[GroupQuality, ...]) -> dict[str, float]:
    """By each laser's name what the noise of all light so far adds to the line measured in it, over the line's own
    sigma: in all but the worst lines, and a little more than that, as the worst of one light are not those of another.
    Infinite: of some light it is not known, as its goal is that of the image. Empty: nothing was rendered for a line.
    """
    if not any(one.of == "line" for one in quality):
        return {}
    found = {}
    for name in dict.fromkeys(one.laser for one in quality if one.laser is not None):
        seen = [one for one in quality if one.laser in (name, None)]
        known = all(one.of == "line" and math.isfinite(one.error) for one in seen)
        found[name] = math.hypot(*(one.error for one in seen)) if known else math.inf
    return found
