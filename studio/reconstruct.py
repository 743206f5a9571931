"""Points without rendering, from the frames of an earlier scan."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from analysis.report.model import FrameResult
from render.errors import InputError
from render.frame_files import read_frame
from render.world import build_world
from studio import scan_folder
from studio.project import Project
from studio.results import extraction_notes, measure_frame, now, write_points, write_reports
from studio.stages import Clock, develop_step, step_world
from studio.summary import summarise
from studio.sweep import Passing, Sweep, Taken


def reconstruct_folder(
    found: scan_folder.ScanFolder,
    project: Project,
    root: Path,
    out: Path,
    clock: Clock,
    *,
    report: bool,
    threads: int | None = None,
) -> dict[str, Any]:
    """Develop, extract and triangulate the frames of a scan anew; `project` may have another sensor or extraction.

    Writes points and, where asked for, the report into `out`. InputError: frames missing or not of this project.
    """
    results: list[FrameResult] = []
    with clock.stage("loading meshes"):
        first = world = build_world(project.scene, root, 0)
    sweep = Sweep(project)

    def take(ready: Iterable[tuple[Taken, Passing | None]]) -> None:
        keep = len(found.frames) <= 16
        for one, passing in ready:
            before = results[0] if results else None
            where = (one.frame, one.world, one.images)
            results.append(measure_frame(project, *where, clock, threads, keep=keep, passing=passing, first=before))

    for n in clock.frames(len(found.frames)):
        path = found.frames[n]
        with clock.stage("reading frames"):
            frame = read_frame(path)
        if not 0 <= frame.step < project.scene.frame_count:
            allowed = f"0 to {project.scene.frame_count - 1}"
            raise InputError(
                "the frame's step is not in the project", where=str(path), found=frame.step, allowed=allowed
            )
        world = step_world(project, root, frame.step, None if frame.step == 0 else world)
        images = develop_step(project, frame, clock, threads)
        take(sweep.add(frame, world, images))
    take(sweep.finish())
    if not results or not project.scene.lasers:
        raise InputError("the scan holds no laser image", where=str(found.folder))
    files, told = write_points(out, project, results, clock), extraction_notes(results, project)
    if report:
        notes = [*told, *(str(note) for note in found.manifest.get("notes", []))]
        created = str(found.manifest.get("created", now()))
        files += write_reports(out, project, first, results, clock, notes=notes, created=created)
    return {
        "name": project.name,
        "files": [str(path) for path in files],
        "results": summarise(results, project.scene),
        "extraction": told,
        "seconds": clock.seconds,
    }
