"""Frames of a scan that are rendered, go on, or are there already: what `--resume` and `--time-limit` do."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from render.base.errors import Cancelled, InputError
from render.checkpoint import RenderState, read_state, state_of
from render.frame import Frame
from render.output.frame_files import read_frame
from render.scan_plan import ScanPlan
from render.world.material_checks import scene_warnings
from render.world.world import World
from studio.project.project import Project
from studio.project.strict_json import read_object
from studio.scan import scan_folder
from studio.scan.interrupt import stop_on_interrupt
from studio.scan.light_group_status import unfinished
from studio.scan.rendered_from import made_of
from studio.scan.stages import Clock, render_step

Refined = Callable[[Frame], None]


def saved_path(out: Path, step: int) -> Path:
    """The file of an unfinished frame."""
    return out / f"{scan_folder.frame_stem(step)}.state.npz"


def frame_of_step(  # noqa: PLR0913
    project: Project,
    world: World,
    step: int,
    scan: scan_folder.Begun,
    clock: Clock,
    threads: int | None,
    *,
    resume: bool = False,
    seconds: float | None = None,
    refined: Refined = lambda frame: None,
    plan: ScanPlan | None = None,
) -> tuple[Frame, RenderState]:
    """One frame: found, gone on with or rendered; and its state, for `settle` once the frame is written.

    plan: of all frames. resume: take what an earlier scan left in the folder. InputError: that is of something else.
    Cancelled: what was done is kept in a file.
    """
    path = saved_path(scan.folder, step)
    mark = None if plan is None else plan.mark
    state = state_of(world, project.scene, project.render, step=step, seed=project.seed, path=path, plan=mark)
    if resume:
        found = None if path.is_file() else _found(project, world, step, scan, state)
        if found is not None:
            refined(found)
            return found, state
        state = read_state(state)
    try:
        with stop_on_interrupt(clock.cancelled) as cancelled:
            frame = render_step(
                project,
                world,
                step,
                clock,
                threads,
                cancelled=cancelled,
                seconds=seconds,
                state=state,
                refined=refined,
                scan=plan,
            )
    except Cancelled:
        if state.write():
            raise Cancelled(f"what was rendered so far is in {path}; --resume goes on from there") from None
        raise
    return frame, state


def settle(project: Project, frame: Frame, state: RenderState) -> None:
    """After the frame is written: its state stays only where the frame ended by the time, short of its targets."""
    if unfinished(frame, project.scene, project.render):
        state.write()
    else:
        state.remove()


def _found(project: Project, world: World, step: int, scan: scan_folder.Begun, state: RenderState) -> Frame | None:
    """The frame that is there already, rendered in the same way; None: there is none."""
    sidecar = scan.folder / f"{scan_folder.frame_stem(step)}.json"
    if not sidecar.is_file():
        return None
    try:
        if read_object(sidecar, "frame").get("made_of") != made_of(project, state.marks, scan.inputs):
            return None
        frame = read_frame(sidecar)
    except InputError:
        return None
    return replace(frame, warnings=scene_warnings(world, project.scene, step))
