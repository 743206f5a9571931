"""A measure of the part where it was read: the curves of its profile, and its dimension, as lines on the part."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from analysis.cloud import at_first_step
from analysis.gauges.outline import outline
from analysis.gauges.profile import Profile
from analysis.gauges.read import Reading
from analysis.report.gauge_table import label_of
from render.base.arrays import Float
from render.base.pose import invert, transform_points
from render.scene.scene import Scene
from studio.project.project import ProfileSection
from studio.scan.sheet_lean import T_section_camera


@dataclass(frozen=True)
class MeasureIn3D:
    """All m, where the objects are at step 0."""

    text: str
    """Its name, value and verdict."""
    verdict: str | None
    lines: tuple[Float, ...]
    """Polylines (k, 3): fitted curves, and the dimension last, where it is a length."""
    place: Float
    """(3,) of the text."""


def measures_in_3d(
    readings: list[Reading],
    profile: Profile,
    scene: Scene,
    laser: int,
    step: int,
    section: ProfileSection,
    step_told: str = "",
) -> list[MeasureIn3D]:
    """Of the readings of one laser's profile, those that have a value and lines of their own.

    step_told: the step in words, where it stands behind their names.
    """
    T_world_section = scene.T_world_camera(step) @ invert(T_section_camera(scene, laser, step, section))
    found = []
    for one in readings:
        if one.reason or not np.isfinite(one.value):
            continue
        curves, dimension = outline(one.gauge, profile)
        lines = [*curves, *([dimension] if len(dimension) else [])]
        if not lines:
            continue
        placed = [
            at_first_step(transform_points(T_world_section, _in_section(line, profile)), scene, step) for line in lines
        ]
        at = placed[-1].mean(axis=0) if len(dimension) else placed[0][-1]
        found.append(MeasureIn3D(label_of(one, step_told), one.verdict, tuple(placed), at))
    return found


def _in_section(line: Float, profile: Profile) -> Float:
    """(k, 2) across the fan and height -> (k, 3) in the section's frame, as far off its plane as the points there."""
    off = np.zeros(len(line))
    if profile.place is not None and len(profile.place):
        order = np.argsort(profile.place[:, 1], kind="stable")
        off = np.interp(line[:, 0], profile.place[order, 1], profile.place[order, 0])
    return np.stack([off, line[:, 0], -line[:, 1]], axis=1)
