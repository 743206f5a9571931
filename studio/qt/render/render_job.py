"""What the render panel's job does, apart from the panel."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from render.base.threads import Cancel
from render.checkpoint import RenderState
from render.frame import Frame
from render.progressive import refine
from render.world.world import World, build_world
from studio.preview.inspection import view_warnings
from studio.project.project import Project
from studio.qt.core.session import Render
from studio.runtime.jobs import Progress
from studio.scan.kernel_warm_up import begin, needed, warm_up


def render_frames(  # noqa: PLR0913
    project: Project,
    root: Path,
    step: int,
    world: World | None,
    progress: Progress,
    cancelled: Cancel,
    take: Callable[[World, Frame], None],
    keeps: Cancel,
    seconds: float | None = None,
    state: RenderState | None = None,
) -> None:
    """Prepare kernels, load what is not loaded and refine; every frame goes to `take`. Raises InputError, Cancelled.

    keeps: whether a cancelled render is kept, with all that was done. seconds, state: see `refine`.
    """
    for_line, for_all = needed(project)
    # what the live picture waits for goes first
    begin(("look",))
    warm_up(for_line, lambda stage, done: progress(stage, 0.0), cancelled)
    begin(for_all)
    if world is None:
        progress("loading meshes", 0.0)
        world = build_world(project.scene, root, step)
    doubts: tuple[str, ...] = ()
    for frame in refine(
        world,
        project.scene,
        settings=project.render,
        step=step,
        axis=project.extraction.axis,
        seed=project.seed,
        progress=progress,
        cancelled=cancelled,
        keeps=keeps,
        seconds=seconds,
        state=state,
    ):
        take(world, replace(frame, warnings=(*doubts, *frame.warnings)))
        # the line is there before the kernels of all other light
        warm_up(for_all, lambda stage, done: progress(stage, 0.0), cancelled)
        doubts = doubts or tuple(view_warnings(project, frame))


def can_go_on(render: Render | None) -> bool:
    """It was stopped early, and what it takes to go on is there."""
    return render is not None and not render.final and render.state is not None


def carried(frame: Frame, before: Frame) -> Frame:
    """What a render that goes on has not come to again yet stays as it was."""
    return replace(
        frame,
        laser_indirect=frame.laser_indirect or before.laser_indirect,
        ambient=before.ambient if frame.ambient is None else frame.ambient,
        truth=before.truth if frame.truth is None else frame.truth,
        counts={**before.counts, **frame.counts},
    )
