"""Points without rendering, from the frames of an earlier scan."""

from __future__ import annotations

from collections.abc import Generator
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from pathlib import Path
from typing import Any

from analysis.report.record import ScanRecord
from render.base.errors import InputError
from render.frame import Frame
from render.output.frame_files import read_frame
from render.run import never
from render.world.material_checks import scene_warnings
from render.world.world import build_world
from studio.project.date_and_time import now
from studio.project.project import Project
from studio.scan import scan_folder
from studio.scan.cautions import Cautions, is_aimed, light_note
from studio.scan.gauging import measures_record
from studio.scan.logo import logo_remarks
from studio.scan.measuring import Measuring
from studio.scan.redevelop import Development, development
from studio.scan.run_record import ended_by_clock, run_text
from studio.scan.sheet_lean import section_note
from studio.scan.stages import Clock, develop_step, moved_world
from studio.scan.summary import summarise


def reconstruct_folder(
    found: scan_folder.ScanFolder,
    project: Project,
    root: Path,
    out: Path,
    clock: Clock,
    *,
    report: bool,
    threads: int | None = None,
    logo_folder: Path | None = None,
) -> dict[str, Any]:
    """Develop, extract and triangulate the frames of a scan anew; `project` may have another sensor or extraction.

    Writes points and, where requested, the report into `out`. logo_folder: where the report's logo is looked for, if
    not where the meshes are. InputError: frames missing or damaged, `project` differs in what the frames fix, or as
    `scan_folder.measuring`.
    """
    scan_folder.check_kept(found)
    scan_folder.check_measures(found, project)
    with scan_folder.measuring(found, root, out):
        logos = root if logo_folder is None else logo_folder
        return _measured(found, project, root, out, clock, report=report, threads=threads, logo_folder=logos)


def _measured(
    found: scan_folder.ScanFolder,
    requested: Project,
    root: Path,
    out: Path,
    clock: Clock,
    *,
    report: bool,
    threads: int | None,
    logo_folder: Path,
) -> dict[str, Any]:
    how = development(found.project, requested)
    project = how.project
    image_scale = scan_folder.image_scale_of(found)
    cautions = Cautions(project, image_scale, how.laser_power)
    with clock.stage("loading meshes"), cautions.listening():
        first = build_world(project.scene, root, 0)
    aimed = False
    with (
        closing(Measuring(project, out, clock, threads, len(found.frames), report=report)) as measuring,
        closing(_read_ahead(found)) as frames,
    ):
        for n in clock.frames(len(found.frames)):
            path = found.frames[n]
            with clock.stage("reading frames"):
                frame = next(frames)
            if not 0 <= frame.step < project.scene.frame_count:
                allowed = f"0 to {project.scene.frame_count - 1}"
                raise InputError(
                    "the frame's step is not in the project", where=str(path), found=frame.step, allowed=allowed
                )
            world = moved_world(project, frame.step, first)
            aimed |= is_aimed(frame)
            images = develop_step(project, frame, clock, threads, how.laser_power)
            cautions.look(frame, (*frame.warnings, *scene_warnings(world, project.scene, frame.step)), images)
            measuring.add(frame, world, images)
        measuring.finish()
        if not measuring.record.steps or not project.scene.lasers:
            raise InputError("the scan holds no laser image", where=str(found.folder))
        # the old points go now: what would be cancelled from here on would leave the folder without any
        clock.cancelled = never
        with scan_folder.replacing(found, out) as measured:
            files = measuring.write_points(out)
            figures = summarise(measuring.record)
            notes = [*cautions.notes(figures), *(light_note(found.project, how.powered) if aimed else ())]
            measured["measures"] = measures_record(project.measures, measuring.record.readings)
            measured["measures_note"] = section_note(project)
            measured |= {"results": figures, "extraction": measuring.notes(), "notes": notes}
            measured["remarks"] = [*measuring.remarks(), *logo_remarks(project, logo_folder)]
            if any(getattr(requested, name) != getattr(found.project, name) for name in scan_folder.MEASURED_WITH):
                measured["measured_with"] = requested.model_dump(mode="json", include=set(scan_folder.MEASURED_WITH))
            if report:
                created = str(found.manifest.get("created", now()))
                # another laser power scales the frames' light, which a render with that power repeats but for rounding
                run = _run_text(found, how, measuring.record) if how.powered.scene == project.scene else ""
                reports = measuring.write_reports(
                    out, first, logo_folder=logo_folder, notes=notes, created=created, image_scale=image_scale, run=run
                )
                measured["report"] = [path.name for path in reports]
                files += reports
    return {
        "name": requested.name,
        "files": [str(path) for path in files],
        "image_scale": image_scale,
        "results": measured["results"],
        "measures": measured["measures"],
        "measures_note": measured["measures_note"],
        "notes": notes,
        "extraction": measured["extraction"],
        "seconds": clock.seconds,
    }


def _read_ahead(found: scan_folder.ScanFolder) -> Generator[Frame, None, None]:
    """The scan's frames in their order, each read while the one before it is measured. InputError: as `read_frame`, or
    a frame is of another project."""

    def read(path: Path) -> Frame:
        scan_folder.check_frame(found, path)
        return read_frame(path)

    with ThreadPoolExecutor(1, "frame reader") as reader:
        coming = reader.submit(read, found.frames[0]) if found.frames else None
        for path in (*found.frames[1:], None):
            if coming is not None:
                frame = coming.result()
                coming = None if path is None else reader.submit(read, path)
                yield frame


def _run_text(found: scan_folder.ScanFolder, how: Development, record: ScanRecord) -> str:
    light = found.manifest.get("light")
    return run_text(
        how.project,
        record,
        image_scale=scan_folder.image_scale_of(found),
        inputs=found.inputs,
        finished=not ended_by_clock(light),
    )
