"""A scan of three steps in few pixels, as it lies on disk, for the tests that look at results."""

from __future__ import annotations

from pathlib import Path

from render.scene.motion import LinearStage
from studio.project.document import replaced
from studio.project.project import Project
from studio.project.templates import template_folder
from studio.scan.options import ScanOptions
from studio.scan.scan import run_scan
from studio.scan.stages import scaled

SCALE = 0.5


def small_project(steps: int = 3) -> Project:
    """The step block in 244 x 204 px on a stage."""
    project = scaled(Project.load(template_folder("step_block") / "project.json"), 0.1)
    settings = project.render.model_copy(update={"ambient_samples": 1, "laser_error": 0.05, "goal": None})
    motion = LinearStage(step=(0.0, 0.002, 0.0), steps=steps)
    return replaced(project.model_copy(update={"render": settings}), ("scene", "motion"), motion)


def small_scan(folder: Path) -> tuple[Path, Path]:
    """Writes and scans the project at half its size: its file, and the folder of the results."""
    file = folder / "project" / "steps.json"
    project = small_project().save(file)
    run_scan(project, file.parent, out=folder / "scan", options=ScanOptions(image_scale=SCALE, report=False))
    return file, folder / "scan"
