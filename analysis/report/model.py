"""What a report is made of: plain results, filled in by whoever ran the scan."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from analysis.error import Errors
from analysis.gauges.of_scan import Patch
from analysis.gauges.read import Reading
from analysis.line.result import Line
from analysis.report.delivery import Delivery
from analysis.triangulate import Points
from render.base.arrays import Float, Int
from render.base.counts import Counts
from render.frame import LaserCurve
from render.plan import GroupQuality, Plan
from render.scene.scene import Scene
from render.sensor.sensor import Sensor

if TYPE_CHECKING:
    from analysis.report.calibration import FoundCalibration
    from analysis.report.record import ScanRecord

Tables = dict[str, dict[str, str]]
"""Table title -> label -> value, ready to read ("Exposure time" -> "1.00 ms")."""


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


@dataclass(frozen=True)
class ReportInput:
    """A whole scan. Geometry is that of step 0 in the world frame; where objects move, the report moves it."""

    title: str
    scene: Scene
    record: ScanRecord
    """Of at least one frame, in the order of their steps."""
    vertices: Float
    """(v, 3) m, world frame, step 0."""
    triangles: Int
    """(t, 3)."""
    object_id: Int
    """(t,) index into `scene.visible_objects`."""
    sensor: Sensor | None = None
    """None for photographs."""
    display_max: float | None = None
    """DN shown as white; None: the largest in the image."""
    settings: Tables = field(default_factory=dict)
    """Tables beyond those that the report makes itself from scene and sensor: extraction settings, rendering, ..."""
    seconds: dict[str, float] = field(default_factory=dict)
    """Wall time of stages that belong to no frame (loading, compiling), s."""
    seed: int | None = None
    versions: dict[str, str] = field(default_factory=dict)
    """Library -> version."""
    notes: tuple[str, ...] = ()
    """Warnings and remarks of the run, one sentence each; shown near the top."""
    image_scale: float = 1.0
    """Pixels a side of what was measured, over those of the scanner."""
    created: str = ""
    """Date and time of the run, as it shall be printed."""
    measures: tuple[dict[str, Any], ...] = ()
    """The part's measures, as the scan's record has them."""
    measures_note: str = ""
    """In which section they were read, where that matters."""
    delivery: Delivery = field(default_factory=Delivery)
    """Whom it is handed to."""
    logo: str = ""
    """data: URI of a PNG; empty: none."""
    calibration: FoundCalibration | None = None
    """With which points were made; None: camera and lasers were taken as the scene has them."""
    run: str = ""
    """What was run, for a program that reads the page: any text; empty: it is not told."""


def frame_rmse(frame: FrameResult) -> float:
    """Depth RMSE over all lasers of a frame, first method, m; NaN when nothing was measured."""
    depth = [laser.extractions[0].errors.depth for laser in frame.lasers if laser.extractions]
    error = np.concatenate([np.zeros(0), *depth])
    error = error[np.isfinite(error)]
    return float(np.sqrt(np.mean(error**2))) if len(error) else float("nan")
