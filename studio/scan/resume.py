"""Frames of a scan that are rendered, go on, or are there already: what `--resume` and `--time-limit` do."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from render.base.errors import Cancelled, InputError
from render.checkpoint import RenderState, read_state, state_of
from render.frame import Frame
from render.lessons import Lessons
from render.output.frame_files import read_frame
from render.world.material_checks import scene_warnings
from render.world.world import World
from studio.project.strict_json import read_object
from studio.scan import scan_folder
from studio.scan.interrupt import stop_on_interrupt
from studio.scan.options import Scan
from studio.scan.rendered_from import made_of
from studio.scan.stages import render_step


def saved_path(out: Path, step: int) -> Path:
    """The file of an unfinished frame."""
    return out / f"{scan_folder.frame_stem(step)}.state.npz"


def frame_of_step(
    scan: Scan, world: World, step: int, lessons: Callable[[], Lessons | None] = lambda: None
) -> tuple[Frame, RenderState]:
    """One frame: found, gone on with or rendered; and its state, for `settle` once the frame is written.

    lessons: those of its block, which are asked for where the frame is not found. InputError: what an earlier scan
    left in the folder, and is to be gone on with, is of something else. Cancelled: what was done is kept in a file.
    """
    project = scan.rendered
    path = saved_path(scan.begun.folder, step)
    mark = None if scan.plan is None else scan.plan.mark
    if scan.options.frames == "none":
        state = RenderState({})  # nothing goes on from it, and all triangles would be hashed for its marks
    else:
        state = state_of(world, project.scene, project.render, step=step, seed=project.seed, path=path, plan=mark)
    if scan.options.resume:
        found = None if path.is_file() else _found(scan, world, step, state)
        if found is not None:
            scan.refined(found)
            return found, state
        state = read_state(state)
    try:
        with stop_on_interrupt(scan.clock.cancelled) as cancelled:
            run = replace(scan.run, cancelled=cancelled, checkpoint=state, lessons=lessons())
            frame = render_step(project, world, step, scan.clock, run, refined=scan.refined, scan=scan.plan)
    except Cancelled:
        if state.write():
            raise Cancelled(f"what was rendered so far is in {path}; --resume goes on from there") from None
        raise
    return frame, state


def settle(frame: Frame, state: RenderState) -> None:
    """After the frame is written: its state stays only where the frame ended by the time, short of its targets."""
    if frame.unfinished:
        state.write()
    else:
        state.remove()


def _found(scan: Scan, world: World, step: int, state: RenderState) -> Frame | None:
    """The frame that is there already, rendered in the same way; None: there is none."""
    project, begun = scan.project, scan.begun
    sidecar = begun.folder / f"{scan_folder.frame_stem(step)}.json"
    if not sidecar.is_file():
        return None
    try:
        record = read_object(sidecar, "frame")
        if record.get("made_of") != made_of(project, state.marks, begun.inputs):
            return None
        if record.get("band") is not None and scan.options.frames == "all":
            return None
        frame = read_frame(sidecar)
    except InputError:
        return None
    return replace(frame, warnings=(*frame.warnings, *scene_warnings(world, project.scene, step)))
