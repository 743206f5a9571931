"""How well each light group of a frame is known so far, in words: for progress, results and the render panel."""

from __future__ import annotations

from render.ambient_plan import AMBIENT_ERROR, AMBIENT_SAMPLES, CLAMPED_SAMPLES, DROPPED_SAMPLES, has_ambient
from render.frame import Frame
from render.laser import LineLaser
from render.plan import indirect_error
from render.scene import Scene
from render.settings import RenderSettings

LASER, REFLECTED, AMBIENT = "laser light", "reflected laser light", "ambient light"
"""Stages of the render."""


def group_lines(frame: Frame, scene: Scene, settings: RenderSettings) -> list[tuple[str, str, str]]:
    """(stage, light group, what is known of it) of every group that has begun."""
    found = []
    for i, laser in enumerate(scene.lasers):
        error = frame.counts.get(f"relative error, {laser.name}")
        if error is not None:
            parts = [f"error {error:.2%}, target {settings.laser_error:.2%}"]
            parts += _left_out(frame.counts.get(f"dropped contributions of direct light, {laser.name}"))
            found.append((LASER, f"{laser.name}, direct", ", ".join(parts)))
        text = _reflected(frame, laser, i, settings)
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
    for laser in scene.lasers if frame.laser_indirect else ():
        error = counts.get(indirect_error(laser))
        if error is None:
            return True
        if error > settings.indirect_error and counts[f"light paths, {laser.name}"] < settings.light_paths:
            return True
    if not has_ambient(scene):
        return False
    error, samples = counts.get(AMBIENT_ERROR, 1.0), counts.get(AMBIENT_SAMPLES, 0.0)
    # whole samples on every tile: the mean may be a little off
    return error > settings.ambient_error and samples < 0.9 * settings.ambient_samples


def _reflected(frame: Frame, laser: LineLaser, index: int, settings: RenderSettings) -> str:
    error = frame.counts.get(indirect_error(laser))
    if error is None:
        return ""
    paths = frame.counts.get(f"light paths, {laser.name}", 0.0)
    parts = [f"error {error:.1%}, target {settings.indirect_error:.1%}", f"{paths / 1e6:.2g} million light paths"]
    direct = float(frame.laser_direct[index].sum(dtype="float64"))
    if direct > 0.0:
        parts.append(f"{float(frame.laser_indirect[index].sum(dtype='float64')) / direct:.2%} of the direct light")
    clamped = frame.counts.get(f"clamped contributions, {laser.name}")
    if clamped is not None:
        parts.append(f"clamped {clamped:.0f} times (biased)")
    parts += _left_out(frame.counts.get(f"dropped contributions, {laser.name}"))
    return ", ".join(parts)


def _ambient(frame: Frame, settings: RenderSettings) -> str:
    counts, parts = frame.counts, []
    if AMBIENT_ERROR in counts:
        parts.append(f"error {counts[AMBIENT_ERROR]:.2%}, target {settings.ambient_error:.2%}")
    parts.append(f"{counts.get(AMBIENT_SAMPLES, 0.0):.0f} of {settings.ambient_samples} samples")
    if CLAMPED_SAMPLES in counts:
        parts.append(f"clamped {counts[CLAMPED_SAMPLES]:.0f} contributions (biased)")
    parts += _left_out(counts.get(DROPPED_SAMPLES))
    return ", ".join(parts)


def _left_out(dropped: float | None) -> list[str]:
    return [f"{dropped:.0f} contributions were no number, and were left out"] if dropped else []
