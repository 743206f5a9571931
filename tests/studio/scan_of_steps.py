"""A scan of three steps in few pixels, as it lies on disk, for the tests that look at results."""

from __future__ import annotations

from pathlib import Path

from render.motion import LinearStage
from studio.document import replaced
from studio.project import Project
from studio.scan import run_scan
from studio.stages import scaled
from studio.templates import template_folder

SCALE = 0.5


def small_project(steps: int = 3) -> Project:
    """The step block in 244 x 204 px on a stage."""
    project = scaled(Project.load(template_folder("step_block") / "project.json"), 0.1)
    settings = project.render.model_copy(update={"ambient_samples": 1, "laser_error": 0.05})
    motion = LinearStage(step=(0.0, 0.002, 0.0), steps=steps)
    return replaced(project.model_copy(update={"render": settings}), ("scene", "motion"), motion)


def small_scan(folder: Path) -> tuple[Path, Path]:
    """Writes and scans the project at half its size: its file, and the folder of the results."""
    file = folder / "project" / "steps.json"
    project = small_project().save(file)
    run_scan(project, file.parent, out=folder / "scan", image_scale=SCALE, report=False)
    return file, folder / "scan"
