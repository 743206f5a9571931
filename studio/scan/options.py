"""What is requested of a scan, who hears of it, and the scan under way that goes down to its stages."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from analysis.report.frame_result import FrameResult
from render.base.threads import Cancel
from render.frame import Frame
from render.run import Run, never, unseen
from studio.project.project import Project
from studio.runtime.console import StageProgress, silent
from studio.scan.depth_noise import DepthNoise
from studio.scan.scan_folder import Begun
from studio.scan.stages import Clock

if TYPE_CHECKING:
    from render.scan_plan import ScanPlan

Keep = Literal["all", "band", "none"]


@dataclass(frozen=True)
class ScanOptions:
    """How much of a project is scanned, and what it leaves."""

    steps: int | None = None
    """Only the first so many frames; None: all."""
    image_scale: float = 1.0
    """Pixels a side over those of the camera."""
    at_scale: bool = False
    """The project is at the image scale already, with the exposure that goes with it."""
    seed: int | None = None
    """In place of the project's."""
    threads: int | None = None
    """None: as many as this process may use."""
    seconds: float | None = None
    """Time for the light of each frame."""
    measure: bool = True
    """Off: stop after the frames."""
    report: bool = True
    """Off: stop after the points."""
    frames: Keep = "all"
    """What is kept of each frame as files: all; a band about the line, coarse elsewhere; nothing."""
    resume: bool = False
    """Take the frames that an earlier scan left in the folder, and go on with the one that it left unfinished."""


@dataclass(frozen=True)
class Listener:
    """Who watches a scan, and may stop it."""

    progress: StageProgress = silent
    cancelled: Cancel = never
    foreseen: Callable[[tuple[DepthNoise, ...]], None] = lambda noise: None
    """Hears, before anything but pilots is rendered, of the noise that rendering may add to the depth."""
    refined: Callable[[Frame], None] = unseen
    """Hears of every frame as it gets better."""
    measured: Callable[[FrameResult], None] = lambda result: None
    """Hears of every frame once it is measured."""


@dataclass(frozen=True)
class Scan:
    """A scan under way."""

    begun: Begun
    """Its folder, and its project: at the image scale, with the seed."""
    clock: Clock
    options: ScanOptions
    refined: Callable[[Frame], None]
    plan: ScanPlan | None = None
    """Of all frames; None: there is only one."""

    @property
    def project(self) -> Project:
        return self.begun.project

    @property
    def rendered(self) -> Project:
        """The project as its frames are rendered: without the truth of pixels where no frame is kept to hold it."""
        project = self.project
        depth_is_used = project.sensor.needs_depth(project.scene.camera.lens.model)
        kept = depth_is_used or (project.render.truth_images and self.options.frames != "none")
        return project.model_copy(update={"render": project.render.model_copy(update={"truth_images": kept})})

    @property
    def run(self) -> Run:
        """How its work is done."""
        return Run(
            self.project.seed, self.options.threads, cancelled=self.clock.cancelled, seconds=self.options.seconds
        )
