"""A whole scan: every step rendered, measured and written as it goes, the points and the report at the end."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from analysis.report.model import FrameResult
from render.develop import Image, develop
from render.errors import InputError
from render.frame import Frame
from render.frame_files import write_frame
from render.world import build_world
from studio import scan_folder
from studio.light_groups import group_lines
from studio.project import Project
from studio.remarks import result_remarks
from studio.results import extraction_notes, measure_frame, now, write_points, write_reports
from studio.resume import Refined, frame_of_step, made_of, settle
from studio.stages import Cancel, Clock, Measurement, StageProgress, develop_step, scaled, step_world
from studio.summary import summarise
from studio.sweep import Passing, Sweep, Taken
from studio.warm_up import PREPARING, needed, warm_up

__all__ = ["Measurement", "ScanResult", "run_scan"]

IMAGES_KEPT = 16
"""Of a long scan only so many images stay in memory for the report, evenly spread."""


@dataclass(frozen=True)
class ScanResult:
    """What a scan left on disk."""

    folder: Path
    files: tuple[Path, ...]
    report: tuple[Path, ...]
    manifest: dict[str, Any]


def never() -> bool:
    """A scan that nobody cancels."""
    return False


def run_scan(
    project: Project,
    root: Path,
    *,
    out: Path,
    steps: int | None = None,
    threads: int | None = None,
    seed: int | None = None,
    image_scale: float = 1.0,
    measure: bool = True,
    report: bool = True,
    resume: bool = False,
    seconds: float | None = None,
    refined: Refined = lambda frame: None,
    progress: StageProgress = lambda stage, done: None,
    cancelled: Cancel = never,
    each: Callable[[FrameResult], None] = lambda frame: None,
) -> ScanResult:
    """Scan `project`, whose files are below `root`, into the folder `out`.

    steps: only the first so many frames; seed: in place of the project's; measure off: stop after the frames;
    report off: stop after the points; resume: take the frames that an earlier scan left in `out`, and go on with the
    one it left unfinished; seconds: time for the light of each frame; refined: hears of every frame as it gets better;
    each: of every frame once it is measured.
    InputError: bad project, mesh or texture, nothing to see, `out` not writable. Cancelled: files so far stay, whole,
    and what was rendered of the frame under way.
    """
    began = time.perf_counter()
    project = scaled(project, image_scale)
    if seed is not None:
        project = project.model_copy(update={"seed": seed})
    if measure and not project.scene.lasers:
        raise InputError("the rig has no laser, so there is no line to measure", where="scene.rig.lasers", found="none")
    sweep = Sweep(project) if measure else None
    count = min(steps or project.scene.frame_count, project.scene.frame_count)
    clock = Clock(progress, cancelled)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", UserWarning)
        with clock.stage("loading meshes"):
            first = build_world(project.scene, root, 0)
        scan_folder.begin(out, project)
        with clock.stage(PREPARING):
            warm_up(chain(*needed(project)), progress, cancelled)
        results: list[FrameResult] = []
        shown = set(np.linspace(0, count - 1, min(count, IMAGES_KEPT)).astype(int).tolist())
        files: list[Path] = []
        doubts: dict[str, str] = {}
        names: list[str] = []
        light: list[dict[str, Any]] = []
        world = first

        def take(found: Iterable[tuple[Taken, Passing | None]]) -> None:
            for taken, passing in found:
                keep, before = taken.frame.step in shown, results[0] if results else None
                results.append(
                    measure_frame(
                        project,
                        taken.frame,
                        taken.world,
                        taken.images,
                        clock,
                        threads,
                        keep=keep,
                        passing=passing,
                        first=before,
                    )
                )
                each(results[-1])

        for step in clock.frames(count):
            world = world if step == 0 else step_world(project, root, step, world)
            frame, state = frame_of_step(
                project, world, step, out, clock, threads, resume=resume, seconds=seconds, refined=refined
            )
            light.append(light_record(frame, project))
            for text in frame.warnings:  # in words as at first, though figures change from step to step
                doubts.setdefault(text.split(",", 1)[0], text)
            images = develop_step(project, frame, clock, threads)
            with clock.stage("writing frames"):
                stem = scan_folder.frame_stem(step)
                written = write_frame(
                    out,
                    stem,
                    frame,
                    together(project, frame, images),
                    project.scene,
                    sensor=project.sensor,
                    made_of=made_of(project, state),
                )
                settle(project, frame, state)
                files += written
                names.append(written[-1].name)
            if sweep is not None:
                take(sweep.add(frame, world, images))
        if sweep is not None:
            take(sweep.finish())
        told = extraction_notes(results, project)
        notes = list(doubts.values())
        notes += [str(warning.message) for warning in caught if issubclass(warning.category, UserWarning)]
        result: dict[str, Any] = {
            "name": project.name,
            "created": now(),
            "frames": names,
            "image_scale": image_scale,
            "seed": project.seed,
            "notes": notes,
            "extraction": told,
            "light": light,
        }
        reports: list[Path] = []
        if measure:
            files += write_points(out, project, results, clock)
            result["results"] = summarise(results, project.scene)
            result["remarks"] = result_remarks(project, results)
            if report:
                reports = write_reports(
                    out, project, first, results, clock, notes=[*told, *notes], created=result["created"]
                )
    result["report"] = [path.name for path in reports]
    result["seconds"] = {**clock.seconds, "all": time.perf_counter() - began}
    manifest = scan_folder.finish(out, root, result)
    return ScanResult(out, (*files, *reports, out / scan_folder.MANIFEST), tuple(reports), manifest)


def light_record(frame: Frame, project: Project) -> dict[str, Any]:
    """The plan of a frame, and how well each light group is known."""
    groups = {name: text for _, name, text in group_lines(frame, project.scene, project.render)}
    return {"plan": frame.plan.splitlines(), "groups": groups}


def together(project: Project, frame: Frame, images: list[Image]) -> Image:
    """The image to keep as a file: the only laser's own, else one with all lasers at once."""
    if len(images) == 1:
        return images[0]
    return develop(frame, project.scene, project.sensor, seed=project.seed)
