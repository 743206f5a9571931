"""A render that the window has, with what was measured in it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from render.checkpoint import RenderState
from render.frame import Frame
from render.sensor.develop import Image
from render.world.world import World
from studio.project.project import Project
from studio.scan.redevelop import Development, is_stale
from studio.scan.scan_results import ScanResults
from studio.scan.stages import Measurement


@dataclass
class Render:
    """One finished or refining render in the history."""

    number: int
    project: Project
    """As it was when the render began."""
    world: World
    frame: Frame
    measurements: dict[str, list[Measurement]] = field(default_factory=dict)
    """By extraction method: one for each laser."""
    final: bool = True
    """False while it refines, and when it was stopped early."""
    stopped: bool = False
    """It was stopped early before it was kept, so that no more of its light comes."""
    name: str = ""
    """As the history shows it; empty: by its number."""
    created: str = ""
    """Time of day, as the history shows it."""
    image_scale: float = 1.0
    """`project` is at this scale."""
    state: RenderState | None = None
    """To go on with a render that was stopped early; None: there is nothing to go on from."""
    source: Project | None = None
    """The project at full scale, None: `project` is."""
    images: list[Image] = field(default_factory=list)
    """As developed last: one for each laser, or one without any."""
    noise: bool = True
    """`images` have the sensor's noise."""
    report: Path | None = None
    """Where a report of it was written last."""
    scan: ScanResults | None = None
    """The scan that the frame is a step of; None: it was rendered alone."""
    made_from: dict[str, tuple[Frame, Development]] = field(default_factory=dict)
    """Frame and settings that "images" and "measurements" are of: while light refines, both lag behind."""
    doubts: Sequence[str] = ()
    """What `inspect` warns of, by the settings that `measurements` were made with."""
    asked: bool = True
    """False: the program made it unasked, as its first picture."""
    kept: Path | None = None
    """Where it is with the project's files, too; None: nowhere."""
    cell: str = ""
    """Key of the study's cell that it is: developed and measured by its own `source`, whatever the open project has."""

    @property
    def scanner_scale(self) -> float:
        """Of the image, to the scanner's."""
        return self.image_scale if self.scan is None else self.scan.image_scale

    @property
    def scan_lines(self) -> tuple[str, int, int]:
        """Their direction and the image's size; where these are alike, so is what a number of a scan line means."""
        camera = self.project.scene.camera
        return self.project.extraction.axis, camera.width, camera.height

    @property
    def measured_as(self) -> Project:
        """The project by whose sensor, lens and extraction `measurements` were made last."""
        made = self.made_from.get("measurements")
        return self.project if made is None else made[1].project

    @property
    def refining(self) -> bool:
        """More of its light is to come by itself."""
        return not self.final and self.state is None and not self.stopped

    @property
    def is_kept_nowhere(self) -> bool:
        """A person made it, and it goes with the session."""
        return self.asked and not (self.kept or self.scan or self.cell or self.refining)

    def developed_by(self, now: Project) -> Project:
        """The project, at full scale, by whose sensor, power and extraction it is developed and measured."""
        return self.source if self.cell and self.source is not None else now

    def awaits_depth(self, now: Project) -> bool:
        """What the sensor's defocus needs of it is still to be rendered."""
        return not self.final and self.frame.truth is None and now.sensor.needs_depth(now.scene.camera.lens.model)

    def is_measured(self, how: Development) -> bool:
        """Images and measurements are of the present frame, developed like this."""
        return self.has("images", how) and self.has("measurements", how)

    def has(self, what: str, how: Development) -> bool:
        """ "images" or "measurements" of the present frame, developed like this."""
        made = self.made_from.get(what)
        return made is not None and made[0] is self.frame and made[1] == how

    def repeatable(self, now: Project) -> bool:
        """A run of its first step gives the same images: those of a step follow the scan's plan, a cell its study's."""
        alone = self.scan is None and not self.cell
        return alone and self.noise and self.frame.step == 0 and self.project.seed == now.seed

    def is_stale(self, now: Project) -> bool:
        """The scene has changed since, in a way that developing cannot follow; what a study measured stays as it is."""
        return not self.cell and not self.shows(now)

    def shows(self, now: Project) -> bool:
        """The scene is as it was, but for what developing can follow."""
        still = self.scan is None and self.frame.step == 0
        return not is_stale(self.source or self.project, now, still=still)
