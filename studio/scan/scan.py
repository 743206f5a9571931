"""A whole scan: every step rendered, measured and written as it goes, the points and the report at the end."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import ExitStack, closing
from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path
from typing import Any

from analysis.report.model import FrameResult
from render.base.errors import InputError
from render.frame import Frame
from render.output.frame_files import write_frame
from render.scan_plan import ScanPlan, plan_scan
from render.sensor.develop import Image, develop
from render.world.world import World, build_world
from studio.project.date_and_time import now
from studio.project.input_files import input_hashes
from studio.project.project import Project
from studio.scan import scan_folder
from studio.scan.cautions import Cautions
from studio.scan.kernel_warm_up import PREPARING, needed, warm_up
from studio.scan.light_group_status import group_lines
from studio.scan.measuring import Measuring
from studio.scan.remarks import result_remarks
from studio.scan.rendered_from import made_of
from studio.scan.resume import Refined, frame_of_step, settle
from studio.scan.stages import Cancel, Clock, Measurement, StageProgress, develop_step, scaled, step_world, validated
from studio.scan.summary import summarise

__all__ = ["Measurement", "ScanResult", "run_scan"]


@dataclass(frozen=True)
class ScanResult:
    """What a scan left on disk."""

    folder: Path
    files: tuple[Path, ...]
    report: tuple[Path, ...]
    manifest: dict[str, Any]


@dataclass(frozen=True)
class Rendering:
    """How the frames of a scan come about."""

    project: Project
    root: Path
    scan: scan_folder.Begun
    clock: Clock
    threads: int | None
    resume: bool
    seconds: float | None
    refined: Refined


@dataclass
class Written:
    """What became of the frames so far, in a few words each."""

    cautions: Cautions
    files: list[Path] = field(default_factory=list)
    names: list[str] = field(default_factory=list)
    """Of their sidecars."""
    light: list[dict[str, Any]] = field(default_factory=list)

    def tell(self, frame: Frame, project: Project) -> None:
        """The light of a frame, and what is doubtful about it."""
        record = light_record(frame, project)
        if self.light and self.light[-1]["plan"] == record["plan"]:
            record["plan"] = self.light[-1]["plan"]  # the same words, once in memory
        self.light.append(record)
        self.cautions.look(frame, frame.warnings)


def never() -> bool:
    """A scan that nobody cancels."""
    return False


def run_scan(  # noqa: PLR0913
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
    source: Path | None = None,
) -> ScanResult:
    """Scan `project`, whose files are below `root`, into the folder `out`.

    steps: only the first so many frames; seed: in place of the project's; measure off: stop after the frames;
    report off: stop after the points; resume: take the frames that an earlier scan left in `out`, and go on with the
    one it left unfinished; seconds: time for the light of each frame; refined: hears of every frame as it gets better;
    each: of every frame once it is measured; source: the project's file, which is never written to.
    InputError: bad project, mesh or texture, nothing to see, or as `scan_folder.begin` and `finish`. Cancelled: files
    so far stay, whole, and what was rendered of the frame under way.
    """
    began = time.perf_counter()
    project = validated(scaled(project, image_scale), f"at image scale {image_scale:g}")
    if seed is not None:
        project = validated(project.model_copy(update={"seed": seed}), "with another seed")
    if measure and not project.scene.lasers:
        raise InputError("the rig has no laser, so there is no line to measure", where="scene.rig.lasers", found="none")
    cautions = Cautions(project, image_scale)
    count = min(steps or project.scene.frame_count, project.scene.frame_count)
    clock = Clock(progress, cancelled)
    measuring = Measuring(project, out, clock, threads, count, each) if measure else None
    with ExitStack() as held, cautions.listening():
        if measuring:
            held.enter_context(closing(measuring))
        written = Written(cautions)
        with clock.stage("loading meshes"):
            inputs = input_hashes(project.scene, root)
            first = build_world(project.scene, root, 0)
        reads = [] if source is None else [source]
        scan = held.enter_context(
            scan_folder.begin(out, project, root, inputs, count=count, resume=resume, reads=reads)
        )
        with clock.stage(PREPARING):
            warm_up(chain(*needed(project)), progress, cancelled)
        how = Rendering(project, root, scan, clock, threads, resume, seconds, refined)
        _take_frames(how, first, count, written, measuring)
        result: dict[str, Any] = {
            "name": project.name,
            "created": now(),
            "frames": written.names,
            "image_scale": image_scale,
            "seed": project.seed,
            "notes": [],
            "extraction": measuring.notes() if measuring else [],
            "light": written.light,
        }
        if measuring:
            written.files += measuring.write_points(out)
            result["results"] = summarise(measuring.record)
            result["remarks"] = result_remarks(measuring.record)
        result["notes"] = cautions.notes(result.get("results", ()))

        def finish(reports: list[Path]) -> dict[str, Any]:
            result["report"] = [path.name for path in reports]
            result["seconds"] = {**clock.seconds, "all": time.perf_counter() - began}
            return scan_folder.finish(scan, result)

        # whole without its report, so that what fails there costs nothing else
        reports: list[Path] = []
        manifest = finish(reports)
        if measuring and report:
            reports = measuring.write_reports(
                out, first, notes=result["notes"], created=result["created"], image_scale=image_scale
            )
            manifest = finish(reports)
    return ScanResult(out, (*written.files, *reports, out / scan_folder.MANIFEST), tuple(reports), manifest)


def _take_frames(how: Rendering, first: World, count: int, written: Written, measuring: Measuring | None) -> None:
    """Render, write and measure one frame after the other; `first`: the world of step 0."""
    plan, world = _plan(how, first), first
    for step in how.clock.frames(count):
        world = world if step == 0 else step_world(how.project, how.root, step, world)
        frame, images = _write_frame(how, world, step, plan, written)
        if measuring is not None:
            measuring.add(frame, world, images)
    if measuring is not None:
        measuring.finish()


def _plan(how: Rendering, first: World) -> ScanPlan | None:
    """What all frames compute, whichever of them are taken; None: there is only one."""
    project = how.project
    if project.scene.frame_count == 1:
        return None
    with how.clock.stage("plan for all frames") as progress:
        return plan_scan(
            project.scene,
            project.render,
            lambda step: first if step == 0 else step_world(project, how.root, step, first),
            seed=project.seed,
            threads=how.threads,
            cancelled=how.clock.cancelled,
            progress=progress,
        )


def _write_frame(
    how: Rendering, world: World, step: int, plan: ScanPlan | None, written: Written
) -> tuple[Frame, list[Image]]:
    """One frame as files, and its image of each laser."""
    project, clock, threads = how.project, how.clock, how.threads
    frame, state = frame_of_step(
        project,
        world,
        step,
        how.scan,
        clock,
        threads,
        resume=how.resume,
        seconds=how.seconds,
        refined=how.refined,
        plan=plan,
    )
    written.tell(frame, project)
    images = develop_step(project, frame, clock, threads)
    with clock.stage("writing frames"):
        files = write_frame(
            how.scan.folder,
            scan_folder.frame_stem(step),
            frame,
            together(project, frame, images),
            project.scene,
            sensor=project.sensor,
            made_of=made_of(project, state.marks, how.scan.inputs),
        )
        settle(project, frame, state)
    written.files += files
    written.names.append(files[-1].name)
    return frame, images


def light_record(frame: Frame, project: Project) -> dict[str, Any]:
    """The plan of a frame, and how well each light group is known."""
    groups = {name: text for _, name, text in group_lines(frame, project.scene, project.render)}
    return {"plan": frame.plan.splitlines(), "groups": groups}


def together(project: Project, frame: Frame, images: list[Image]) -> Image:
    """The image to keep as a file: the only laser's own, else one with all lasers at once."""
    if len(images) == 1:
        return images[0]
    return develop(frame, project.scene, project.sensor, seed=project.seed)
