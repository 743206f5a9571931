"""How well each light group of a frame is known so far, in words and as data: for progress, results, a notebook."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from render.ambient.transport_plan import has_ambient
from render.base.counts import (
    AMBIENT_CLAMPED,
    AMBIENT_DROPPED,
    AMBIENT_ERROR,
    AMBIENT_SAMPLES,
    DIRECT_DROPPED,
    DIRECT_ERROR,
    DIRECT_SAMPLES,
    INDIRECT_CLAMPED,
    INDIRECT_DROPPED,
    INDIRECT_ERROR,
    LIGHT_PATHS,
)
from render.frame import Frame
from render.scene.scene import Scene
from render.scene.settings import RenderSettings

LASER, REFLECTED, AMBIENT = "laser light", "reflected laser light", "ambient light"
"""Stages of the render."""


def group_lines(frame: Frame, scene: Scene, settings: RenderSettings) -> list[tuple[str, str, str]]:
    """(stage, light group, what is known of it) of every group that has begun."""
    found = []
    for i, laser in enumerate(scene.lasers):
        error = frame.counts.get(DIRECT_ERROR.of(i))
        if error is not None:
            parts = [f"error {error:.2%}, target {settings.laser_error:.2%}"]
            parts += _left_out(frame.counts.get(DIRECT_DROPPED.of(i)))
            found.append((LASER, f"{laser.name}, direct", ", ".join(parts)))
        text = _reflected(frame, i, settings)
        if text:
            found.append((REFLECTED, f"{laser.name}, reflected on", text))
    if frame.ambient is not None:
        found.append((AMBIENT, "ambient", _ambient(frame, settings)))
    return found


def note(stage: str, frame: Frame, scene: Scene, settings: RenderSettings) -> str:
    """The same for the groups of one stage, on one line."""
    return "; ".join(text for of, _, text in group_lines(frame, scene, settings) if of == stage)


def unfinished(frame: Frame, scene: Scene, settings: RenderSettings) -> bool:
    """Some light group has reached neither its target error nor the most work that it may take."""
    counts = frame.counts
    for i in range(len(scene.lasers) if frame.laser_indirect else 0):
        error = counts.get(INDIRECT_ERROR.of(i))
        if error is None:
            return True
        if error > settings.indirect_error and counts[LIGHT_PATHS.of(i)] < settings.light_paths:
            return True
    if not has_ambient(scene):
        return False
    error, samples = counts.get(AMBIENT_ERROR, 1.0), counts.get(AMBIENT_SAMPLES, 0.0)
    # whole samples on every tile: the mean may be a little off
    return error > settings.ambient_error and samples < 0.9 * settings.ambient_samples


def _reflected(frame: Frame, index: int, settings: RenderSettings) -> str:
    error = frame.counts.get(INDIRECT_ERROR.of(index))
    if error is None:
        return ""
    paths = frame.counts.get(LIGHT_PATHS.of(index), 0.0)
    parts = [f"error {error:.1%}, target {settings.indirect_error:.1%}", f"{paths / 1e6:.2g} million light paths"]
    direct = float(frame.laser_direct[index].sum(dtype="float64"))
    if direct > 0.0:
        parts.append(f"{float(frame.laser_indirect[index].sum(dtype='float64')) / direct:.2%} of the direct light")
    clamped = frame.counts.get(INDIRECT_CLAMPED.of(index))
    if clamped is not None:
        parts.append(f"clamped {clamped:.0f} times (biased)")
    parts += _left_out(frame.counts.get(INDIRECT_DROPPED.of(index)))
    return ", ".join(parts)


def _ambient(frame: Frame, settings: RenderSettings) -> str:
    counts, parts = frame.counts, []
    if AMBIENT_ERROR in counts:
        parts.append(f"error {counts[AMBIENT_ERROR]:.2%}, target {settings.ambient_error:.2%}")
    parts.append(f"{counts.get(AMBIENT_SAMPLES, 0.0):.0f} of {settings.ambient_samples} samples")
    if AMBIENT_CLAMPED in counts:
        parts.append(f"clamped {counts[AMBIENT_CLAMPED]:.0f} contributions (biased)")
    parts += _left_out(counts.get(AMBIENT_DROPPED))
    return ", ".join(parts)


def _left_out(dropped: float | None) -> list[str]:
    return [f"{dropped:.0f} contributions were no number, and were left out"] if dropped else []


@dataclass(frozen=True)
class GroupQuality:
    """How well one light group is known: the numbers behind `group_lines`."""

    group: Literal["direct", "indirect", "ambient"]
    laser: str | None
    """Its name; None: ambient light."""
    error: float
    """Relative RMS error, a fraction; NaN: not known."""
    target: float
    """The error that was requested."""
    work: float
    """In `unit`."""
    unit: Literal["samples", "light paths", "samples a pixel"]
    dropped: float
    """Contributions that were no number, and were left out."""
    clamped: float
    """Contributions cut by a clamp, which biases the group."""

    @property
    def reached(self) -> bool:
        """The error is at most the target; where it is not, the work or the time that was allowed ended it."""
        return self.error <= self.target


def group_qualities(frame: Frame, scene: Scene, settings: RenderSettings) -> tuple[GroupQuality, ...]:
    """Of every group that has begun: each laser's direct and indirect light, then ambient light."""
    counts, found = frame.counts, []
    for i, laser in enumerate(scene.lasers):
        if DIRECT_ERROR.of(i) in counts:
            direct = (counts.get(one.of(i), 0.0) for one in (DIRECT_ERROR, DIRECT_SAMPLES, DIRECT_DROPPED))
            error, work, dropped = direct
            target = settings.laser_error
            found.append(GroupQuality("direct", laser.name, error, target, work, "samples", dropped, 0.0))
        if INDIRECT_ERROR.of(i) in counts:
            indirect = (INDIRECT_ERROR, LIGHT_PATHS, INDIRECT_DROPPED, INDIRECT_CLAMPED)
            error, work, dropped, clamped = (counts.get(one.of(i), 0.0) for one in indirect)
            target = settings.indirect_error
            found.append(GroupQuality("indirect", laser.name, error, target, work, "light paths", dropped, clamped))
    if frame.ambient is not None:
        work, dropped, clamped = (counts.get(one, 0.0) for one in (AMBIENT_SAMPLES, AMBIENT_DROPPED, AMBIENT_CLAMPED))
        error, target = counts.get(AMBIENT_ERROR, float("nan")), settings.ambient_error
        found.append(GroupQuality("ambient", None, error, target, work, "samples a pixel", dropped, clamped))
    return tuple(found)
