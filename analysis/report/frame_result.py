"""What became of one frame: of each laser the exact line, and what every method made of its image."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from analysis.error import Errors
from analysis.gauges.of_scan import Patch
from analysis.gauges.read import Reading
from analysis.line.result import Line
from analysis.triangulate import Points
from render.base.counts import Counts
from render.frame import LaserCurve
from render.plan import GroupQuality, Plan


@dataclass(frozen=True)
class Extraction:
    """One method's line in one laser's image, and what became of it."""

    line: Line
    points: Points
    errors: Errors


@dataclass(frozen=True)
class LaserResult:
    """One laser in one frame."""

    curve: LaserCurve
    """The exact line, same axis as the extractions."""
    extractions: tuple[Extraction, ...]
    """At least one; the first is the one that the headline speaks of, others are compared with it."""
    image: NDArray[np.generic] | None
    """(h, w) or (h, w, 3) digital numbers (DN) that the lines were extracted from. May be None on frames that the
    report shall not show; it shows one frame, chosen among those whose lasers all have an image."""


@dataclass(frozen=True)
class FrameResult:
    """One step of the scan."""

    step: int
    lasers: tuple[LaserResult, ...]
    """One for each of `scene.lasers`, in that order."""
    plan: Plan = field(default_factory=Plan)
    """`Frame.plan`: what was computed, what was left out and why."""
    quality: tuple[GroupQuality, ...] = field(default=(), kw_only=True)
    """`Frame.quality`; over the frames errors are averaged, work and losses summed."""
    seconds: dict[str, float] = field(default_factory=dict)
    """Wall time by stage, s, of this frame: those of `Frame.seconds` and those after it. Summed over the frames."""
    readings: tuple[Reading, ...] = field(default=(), kw_only=True)
    """Of the project's measures, by the first method."""
    patches: tuple[Patch, ...] = field(default=(), kw_only=True)
    """Of those that are of all steps, by the first method."""
    counts: Counts = field(default_factory=dict)
    """`Frame.counts`; over the frames they are summed or averaged as their kind says."""


def frame_rmse(frame: FrameResult) -> float:
    """Depth RMSE over all lasers of a frame, first method, m; NaN when nothing was measured."""
    depth = [laser.extractions[0].errors.depth for laser in frame.lasers if laser.extractions]
    error = np.concatenate([np.zeros(0), *depth])
    error = error[np.isfinite(error)]
    return float(np.sqrt(np.mean(error**2))) if len(error) else float("nan")
