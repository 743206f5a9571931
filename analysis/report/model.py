"""What a report is made of: a scan with its scene, its settings and whom it is handed to."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from analysis.report.delivery import Delivery
from analysis.report.record import ScanRecord
from render.base.arrays import Float, Int
from render.scene.scene import Scene
from render.sensor.sensor import Sensor

if TYPE_CHECKING:
    from analysis.report.calibration import FoundCalibration

Tables = dict[str, dict[str, str]]
"""Table title -> label -> value, ready to read ("Exposure time" -> "1.00 ms")."""


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
    part_of: str = ""
    """Of which scan it is one step, a sentence; empty: it is whole. Among the notes as well."""
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
