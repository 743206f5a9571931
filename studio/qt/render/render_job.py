"""What the render panel's job does, apart from the panel."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from render.frame import Frame
from render.run import Run
from render.world.world import World, build_world
from studio.preview.inspection import view_warnings
from studio.project.project import Project
from studio.qt.core.session import Render
from studio.runtime.jobs import Progress
from studio.scan.kernel_warm_up import all_compiled, begin, needed, warm_up
from studio.scan.render_goal import goal_of


def render_frames(
    project: Project,
    root: Path,
    step: int,
    world: World | None,
    run: Run,
    progress: Progress,
    take: Callable[[World, Frame, tuple[str, ...]], None],
) -> None:
    """Prepare kernels, load what is not loaded and refine; every frame goes to `take`. Raises InputError, Cancelled.

    With it goes what `inspect` warns of in the first one, which has the line's light.

    run: with the project's seed, whatever its own.
    """
    from render.progressive import refine  # takes a while: not before something is rendered

    # what is compiled is loaded where it is called: most projects need a part of it
    for_line, for_all = ((), ()) if all_compiled() else needed(project)
    # what the live picture waits for goes first
    begin(("look",))
    warm_up(for_line, lambda stage, done: progress(stage, 0.0), run.cancelled)
    begin(for_all)
    if world is None:
        progress("loading meshes", 0.0)
        world = build_world(project.scene, root, step)
    doubts: tuple[str, ...] | None = None
    for frame in refine(
        world,
        project.scene,
        settings=project.render,
        step=step,
        axis=project.extraction.axis,
        run=replace(run, seed=project.seed, goal=goal_of(project, run.threads)),
        progress=progress,
    ):
        take(world, frame, doubts or ())
        # the line is there before the kernels of all other light
        warm_up(for_all, lambda stage, done: progress(stage, 0.0), run.cancelled)
        doubts = tuple(view_warnings(project, frame)) if doubts is None else doubts


def can_go_on(render: Render | None) -> bool:
    """It was stopped early, and what it takes to go on is there."""
    return render is not None and not render.final and render.state is not None
