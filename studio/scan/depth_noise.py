"""What the noise of a render adds to the measured depth: how much a goal allows, before a scan, and what was reached.

A goal is a share of each row's own sigma. In metres it is that share of the depth's standard deviation by photons, read
noise and speckle: before the scan as the scene foretells it (`studio.preview.readouts`), after it as the points tell.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, get_args

import numpy as np

from analysis.report.light_text import STAGES
from analysis.report.record import ScanRecord
from render.plan import Group, GroupQuality
from studio.preview.preview import Preview
from studio.preview.readouts import readouts
from studio.project.project import Project
from studio.scan.render_goal import shares


@dataclass(frozen=True)
class DepthNoise:
    """Of one light, in the depth that is measured with one laser."""

    laser: str
    group: Group
    allowed: float
    """Standard deviation over that by the sensor's noise and speckle, in 95 % of the rows."""
    foreseen_m: float | None
    """The same of depth_z in a median row, as foretold; None: no line is in the image."""
    reached: float | None = None
    """What `allowed` came to in the first frame; None: its light was rendered for the image, or is not known."""
    reached_m: float | None = None
    """Of depth_z, in a median row."""
    foretold_seconds: float | None = None
    """Processor seconds of this light, of all lasers and frames, as the scan's pilots foretell them; None: none did."""
    seconds: float | None = None
    """Wall time of the same."""


def foreseen_noise(project: Project, root: Path, threads: int | None = None) -> tuple[DepthNoise, ...]:
    """Before anything is rendered: light by light as it will be; empty where the goal is the image's.

    InputError: a mesh or texture below `root` that does not load.
    """
    from render.products import expected_plan

    goal, scene = project.render.goal, project.scene
    if goal is None or not scene.lasers:
        return ()
    steps = [step for step in expected_plan(scene, project.render_settings).steps if step.computed is not False]
    there = {step.group for step in steps if step.reason != "absent"}
    direct, other = shares(goal, reflected="indirect" in there, ambient="ambient" in there)
    look, found = Preview(threads).look(project, root), []
    for i, laser in enumerate(scene.lasers):
        sigma = readouts(look, i).depth_sigma
        for group in get_args(Group):
            allowed = direct if group == "direct" else other
            if group in there:
                foreseen = None if sigma is None else allowed * sigma
                found.append(DepthNoise(laser=laser.name, group=group, allowed=allowed, foreseen_m=foreseen))
    return tuple(found)


def with_foretold(foreseen: Iterable[DepthNoise], frame: Mapping[str, float], frames: int) -> tuple[DepthNoise, ...]:
    """With the seconds of so many frames; frame: processor seconds of one, by light group."""
    return tuple(
        replace(one, foretold_seconds=frame[one.group] * frames) if one.group in frame else one for one in foreseen
    )


def reached_noise(
    foreseen: Iterable[DepthNoise],
    quality: Iterable[GroupQuality],
    record: ScanRecord | None,
    seconds: Mapping[str, float],
) -> tuple[DepthNoise, ...]:
    """After a scan.

    quality: of its first frame's light; record: of its points, None where none were measured; seconds: wall time by
    stage.
    """
    known = {(one.laser, one.group): one for one in quality if one.of == "line" and math.isfinite(one.error)}
    sigmas = {} if record is None else {laser.name: _sigma(record, i) for i, laser in enumerate(record.scene.lasers)}
    found = []
    for one in foreseen:
        light = known.get((None if one.group == "ambient" else one.laser, one.group))
        spent = seconds.get(STAGES[one.group])
        if light is None:
            found.append(replace(one, seconds=spent))
            continue
        sigma = sigmas.get(one.laser)
        depth = None if sigma is None else light.error * sigma
        # what a pilot left out has left its share to the others
        found.append(replace(one, allowed=light.target, reached=light.error, reached_m=depth, seconds=spent))
    return tuple(found)


def noise_records(found: Iterable[DepthNoise]) -> list[dict[str, Any]]:
    """As the manifest has them."""
    return [asdict(one) for one in found]


def _sigma(record: ScanRecord, laser: int) -> float | None:
    """Median standard deviation of depth_z by noise, m."""
    sigma = record.chosen(laser).rows["sigma_depth"]
    sigma = sigma[np.isfinite(sigma)]
    return float(np.median(sigma)) if len(sigma) else None
