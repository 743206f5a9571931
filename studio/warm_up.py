"""The whole scan on a tiny scene, in memory: compiles every kernel, or loads it, and proves the installation."""

from __future__ import annotations

from render.world import build_world
from studio.project import Project
from studio.results import measure_frame
from studio.stages import Clock, develop_step, render_step, scaled
from studio.templates import template_folder

TEMPLATE, IMAGE_SCALE = "plane", 0.05


def warm_up(clock: Clock, threads: int | None = None) -> None:
    """Run the tilted plane at 122 x 102 px. Raises whatever is broken."""
    folder = template_folder(TEMPLATE)
    project = scaled(Project.load(folder / "project.json"), IMAGE_SCALE)
    quiet = Clock(progress=lambda stage, done: None, cancelled=clock.cancelled)
    world = build_world(project.scene, folder, 0)
    frame = render_step(project, world, 0, quiet, threads)
    images = develop_step(project, frame, quiet, threads)
    found = measure_frame(project, frame, world, images, quiet, threads, keep=False)
    if not found.lasers[0].extractions[0].points.valid.any():
        raise RuntimeError("the warm-up scan found no point: the installation is damaged")
