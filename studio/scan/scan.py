"""A whole scan: every step rendered, measured and written as it goes, the points and the report at the end."""

from __future__ import annotations

import time
from collections.abc import Sequence
from contextlib import ExitStack, closing
from dataclasses import dataclass, field, replace
from itertools import chain
from pathlib import Path
from typing import Any

from render.base.errors import Cancelled, InputError
from render.frame import Frame
from render.output.light_record import plan_record, quality_from, quality_record
from render.scan_plan import ScanPlan, plan_scan
from render.sensor.develop import Image
from render.world.world import World, build_world
from studio.project.date_and_time import now
from studio.project.input_files import input_hashes
from studio.project.project import Project
from studio.runtime.memory import return_what_is_free
from studio.scan import scan_folder
from studio.scan.cautions import Cautions
from studio.scan.depth_noise import foreseen_noise, noise_records, reached_noise, with_foretold
from studio.scan.frame_writer import FrameWriter
from studio.scan.frames_ahead import rendered_frames
from studio.scan.gauging import measures_record
from studio.scan.kernel_warm_up import PREPARING, needed, warm_up
from studio.scan.line_extraction import check_chooser
from studio.scan.logo import logo_remarks
from studio.scan.measuring import Measuring
from studio.scan.options import Listener, Scan, ScanOptions
from studio.scan.render_goal import goal_of
from studio.scan.run_record import ended_by_clock, run_text
from studio.scan.sheet_lean import section_note
from studio.scan.stages import Clock, Measurement, develop_step, moved_world, scaled, validated
from studio.scan.summary import profile_rate, summarise

__all__ = ["Measurement", "ScanResult", "run_scan"]


@dataclass(frozen=True)
class ScanResult:
    """What a scan left on disk."""

    folder: Path
    files: tuple[Path, ...]
    report: tuple[Path, ...]
    manifest: dict[str, Any]


@dataclass
class Written:
    """What became of the frames so far, in a few words each."""

    cautions: Cautions
    files: list[Path] = field(default_factory=list)
    names: list[str] = field(default_factory=list)
    """Of the frames' sidecars."""
    light: list[dict[str, Any]] = field(default_factory=list)

    def add(self, frame: Frame, images: Sequence[Image]) -> None:
        """Plan and quality of a frame, and what is doubtful about it."""
        record = light_record(frame)
        if self.light and self.light[-1]["plan"] == record["plan"]:
            record["plan"] = self.light[-1]["plan"]  # once in memory
        self.light.append(record)
        self.cautions.look(frame, frame.warnings, images)


def run_scan(
    project: Project,
    root: Path,
    *,
    out: Path,
    options: ScanOptions = ScanOptions(),
    listener: Listener = Listener(),
    source: Path | None = None,
) -> ScanResult:
    """Scan `project`, whose files are below `root`, into the folder `out`.

    source: the project's file, which is never written to. InputError: bad project, mesh or texture, nothing to see, or
    as `scan_folder.begin` and `finish`. Cancelled: files so far stay, whole, and what was rendered of the frame under
    way.
    """
    start = time.perf_counter()
    _check_options(options)
    image_scale = options.image_scale
    if not options.at_scale:
        project = validated(scaled(project, image_scale), f"at image scale {image_scale:g}")
    if options.seed is not None:
        project = validated(project.model_copy(update={"seed": options.seed}), "with another seed")
    if options.measure and not project.scene.lasers:
        raise InputError("the rig has no laser, so there is no line to measure", where="scene.rig.lasers", found="none")
    if options.measure:
        check_chooser(project)
    cautions = Cautions(project, image_scale)
    count = min(options.steps or project.scene.frame_count, project.scene.frame_count)
    clock = Clock(listener.progress, listener.cancelled)
    wanted = {"compare_all": options.frames != "none", "report": options.report}
    measuring = (
        Measuring(project, out, clock, options.threads, count, listener.measured, **wanted) if options.measure else None
    )
    with ExitStack() as held, cautions.listening():
        if measuring:
            held.enter_context(closing(measuring))
        written = Written(cautions)
        with clock.stage("loading meshes"):
            inputs = input_hashes(project.scene, root)
            first = build_world(project.scene, root, 0)
        reads = [] if source is None else [source]
        begun = held.enter_context(
            scan_folder.begin(out, project, root, inputs, count=count, resume=options.resume, reads=reads)
        )
        with clock.stage(PREPARING):
            warm_up(chain(*needed(project)), listener.progress, listener.cancelled)
        with clock.stage("noise in depth"):
            foreseen = foreseen_noise(project, root, options.threads)
        scan = Scan(begun, clock, options, listener.refined)
        scan = replace(scan, plan=_plan(scan, first))
        if scan.plan is not None:
            foreseen = with_foretold(foreseen, scan.plan.foretold, count)
        listener.foreseen(foreseen)
        _take_frames(scan, first, count, written, measuring)
        result: dict[str, Any] = {
            "name": project.name,
            "created": now(),
            "frames": written.names,
            "frames_kept": options.frames,
            "frame_count": count,
            "image_scale": image_scale,
            "seed": project.seed,
            "notes": [],
            "extraction": measuring.notes() if measuring else [],
            "light": written.light,
        }
        if measuring:
            written.files += measuring.write_points(out)
            result["profiles_per_second"] = profile_rate(measuring.record, clock.seconds)
            result["results"] = summarise(measuring.record)
            result["measures"] = measures_record(project.measures, measuring.record.readings)
            result["measures_note"] = section_note(project)
            result["remarks"] = [*measuring.remarks(), *logo_remarks(project, root)]
        noise = reached_noise(
            foreseen,
            quality_from(written.light[0]["groups"]),
            None if measuring is None else measuring.record,
            clock.seconds,
        )
        result["depth_noise"] = noise_records(noise)
        result["notes"] = cautions.notes(result.get("results", ()))

        def finish(reports: list[Path]) -> dict[str, Any]:
            result["report"] = [path.name for path in reports]
            result["seconds"] = {**clock.seconds, "all": time.perf_counter() - start}
            return scan_folder.finish(begun, result)

        # whole without its report, so that what fails there costs nothing else
        reports: list[Path] = []
        manifest = finish(reports)
        if measuring and options.report:
            run = run_text(
                project,
                measuring.record,
                image_scale=image_scale,
                inputs=inputs,
                finished=not ended_by_clock(written.light),
            )
            reports = measuring.write_reports(
                out,
                first,
                logo_folder=root,
                notes=result["notes"],
                created=result["created"],
                image_scale=image_scale,
                run=run,
            )
            manifest = finish(reports)
    return ScanResult(out, (*written.files, *reports, out / scan_folder.MANIFEST), tuple(reports), manifest)


def _check_options(options: ScanOptions) -> None:
    """InputError: what is to be kept of the frames does not go with what else is asked for."""
    if options.frames != "none":
        return
    if options.resume:
        raise InputError(
            "a scan goes on from the frames that an earlier one left, and none are to be kept",
            where="--frames",
            found="none, with --resume",
            allowed="all or band",
        )
    if not options.measure:
        raise InputError("a render that keeps no frame leaves nothing", where="--frames", found="none", cure="run")


def _take_frames(scan: Scan, first: World, count: int, written: Written, measuring: Measuring | None) -> None:
    """Render, write and measure one frame after the other; `first`: the world of step 0.

    Cancelled: it says so where nothing is kept.
    """
    try:
        _take_each(scan, first, count, written, measuring)
        if count > 1:
            return_what_is_free()  # so that what the points and the report take comes in place of what frames took
    except (Cancelled, KeyboardInterrupt):
        if scan.options.frames != "none" or measuring is None:
            raise
        done = f"{len(measuring.record.steps)} of {count} were measured"
        raise Cancelled(
            f"nothing is kept: by --frames none the points of all frames are written at the end ({done}), and "
            "--resume has nothing to go on from; with --frames band it has"
        ) from None


def _take_each(scan: Scan, first: World, count: int, written: Written, measuring: Measuring | None) -> None:
    with FrameWriter(scan) as writer, closing(rendered_frames(scan, first, count)) as frames:
        for _ in scan.clock.frames(count):
            found = next(frames)
            images = develop_step(scan.project, found.frame, scan.clock, scan.options.threads)
            written.add(found.frame, images)
            writer.add(found.frame, found.state, images)
            if measuring is not None:
                measuring.add(found.frame, found.world, images)
        writer.finish()
    if measuring is not None:
        measuring.finish()
    written.files += writer.files
    written.names += writer.names


def _plan(scan: Scan, first: World) -> ScanPlan | None:
    """What all frames compute, whichever of them are taken; None: there is only one."""
    project = scan.rendered
    if project.scene.frame_count == 1:
        return None

    def world(step: int) -> World:
        return moved_world(project, step, first)

    with scan.clock.stage("plan for all frames") as progress:
        run = replace(scan.run, progress=progress, goal=goal_of(project, scan.run.threads))
        return plan_scan(project.scene, project.render, world, run)


def light_record(frame: Frame) -> dict[str, Any]:
    """The plan of a frame, and how well each light group is known, as the manifest has them."""
    return {"plan": plan_record(frame.plan), "groups": quality_record(frame.quality)}
